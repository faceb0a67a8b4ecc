"""The coordinator: its StatefulSet, services and budget."""

import unittest

import chart

TLS = ["--tls-ca", "--tls-cert", "--tls-key", "--tokens"]


def coordinator(values=None, **release):
    return chart.one("StatefulSet", values, **release)


class Coordinator(unittest.TestCase):
    def test_there_is_one(self):
        self.assertEqual(coordinator()["spec"]["replicas"], 1)

    def test_it_serves_with_tls_and_tokens(self):
        found = coordinator()
        for option in TLS:
            self.assertTrue(chart.argument(found, option).startswith("/etc/osteon/"), option)
        self.assertNotIn("--insecure", chart.container(found)["args"])

    def test_it_serves_without_only_if_told_to(self):
        found = coordinator({"tls": {"enabled": False}})
        self.assertIn("--insecure", chart.container(found)["args"])
        for option in TLS:
            self.assertIsNone(chart.argument(found, option), option)
        self.assertIn("WARNING", chart.notes({"tls": {"enabled": False}}))
        self.assertNotIn("WARNING", chart.notes())

    def test_its_options_are_the_values(self):
        for values, option, expected in [
            ({}, "--audit-fraction", "0.01"),
            ({"auditFraction": 0}, "--audit-fraction", "0"),
            ({"auditFraction": 1}, "--audit-fraction", "1"),
            ({}, "--lease", "10"),
            ({"leaseSeconds": 60}, "--lease", "60"),
            ({}, "--keep-ended", None),
            ({"keepEnded": "90d"}, "--keep-ended", "90d"),
            ({}, "--listen", "0.0.0.0:7000"),
            ({"listenAddress": "[::]"}, "--listen", "[::]:7000"),
            ({}, "--store", "/var/lib/osteon/store"),
            ({}, "--metrics", "0.0.0.0:9464"),
        ]:
            found = coordinator({"coordinator": values})
            self.assertEqual(chart.argument(found, option), expected, values)
        for speculation in (True, False):
            found = coordinator({"coordinator": {"speculation": speculation}})
            self.assertEqual("--no-speculation" in chart.container(found)["args"], not speculation)

    def test_its_store_is_on_a_volume(self):
        claims = coordinator()["spec"]["volumeClaimTemplates"]
        self.assertEqual(claims[0]["spec"]["resources"], {"requests": {"storage": "10Gi"}})
        self.assertNotIn("storageClassName", claims[0]["spec"])
        fast = {"coordinator": {"store": {"storageClassName": "fast", "size": "1Ti"}}}
        claims = coordinator(fast)["spec"]["volumeClaimTemplates"]
        self.assertEqual(claims[0]["spec"]["resources"], {"requests": {"storage": "1Ti"}})
        self.assertEqual(claims[0]["spec"]["storageClassName"], "fast")

    def test_its_store_may_be_on_a_volume_that_exists(self):
        found = coordinator({"coordinator": {"store": {"existingClaim": "mine"}}})
        self.assertNotIn("volumeClaimTemplates", found["spec"])
        volumes = {volume["name"]: volume for volume in chart.pod(found)["volumes"]}
        self.assertEqual(volumes["store"]["persistentVolumeClaim"], {"claimName": "mine"})

    def test_a_large_store_has_time_to_open(self):
        probe = chart.container(coordinator())["startupProbe"]
        # About a second for each GB is read.
        self.assertGreaterEqual(probe["periodSeconds"] * probe["failureThreshold"], 600)

    def test_probes_end_within_their_time(self):
        for name in ("startupProbe", "readinessProbe", "livenessProbe"):
            probe = chart.container(coordinator())[name]
            command = probe["exec"]["command"]
            own = float(command[command.index("--timeout") + 1])
            self.assertLess(own, probe["timeoutSeconds"])
            self.assertLessEqual(probe["timeoutSeconds"], probe["periodSeconds"])

    def test_probes_use_the_certificate_that_clients_use(self):
        for values, url, authority in [
            ({}, "https://localhost:7000", True),
            ({"coordinator": {"probeHost": "osteon-coordinator-0"}}, "https://osteon-coordinator-0:7000", True),
            ({"tls": {"enabled": False}}, "http://localhost:7000", False),
        ]:
            command = chart.container(coordinator(values))["readinessProbe"]["exec"]["command"]
            self.assertEqual(command[command.index("--coordinator") + 1], url)
            self.assertEqual("--tls-ca" in command, authority)

    def test_services_lead_to_its_ports(self):
        found = chart.objects({"coordinator": {"service": {"port": 443, "type": "NodePort"}}})
        ports = {p["name"]: p["containerPort"] for p in chart.container(found["StatefulSet", "osteon-coordinator"])["ports"]}
        self.assertEqual(ports, {"grpc": 7000, "metrics": 9464})
        service = found["Service", "osteon-coordinator"]["spec"]
        self.assertEqual(service["type"], "NodePort")
        self.assertEqual([(p["port"], p["targetPort"]) for p in service["ports"]], [(443, "grpc")])
        service = found["Service", "osteon-coordinator-metrics"]["spec"]
        self.assertEqual(service["type"], "ClusterIP")
        self.assertEqual([(p["port"], p["targetPort"]) for p in service["ports"]], [(9464, "metrics")])

    def test_without_metrics_there_is_no_trace_of_them(self):
        found = chart.objects({"metrics": {"enabled": False}})
        self.assertNotIn(("Service", "osteon-coordinator-metrics"), found)
        self.assertIsNone(chart.argument(found["StatefulSet", "osteon-coordinator"], "--metrics"))
        self.assertNotIn("9464", str(found))

    def test_metrics_are_found_by_the_prometheus_operator(self):
        found = chart.objects({"metrics": {"serviceMonitor": {"enabled": True}}})
        selector = found["ServiceMonitor", "osteon-coordinator"]["spec"]["selector"]["matchLabels"]
        services = [
            name
            for (kind, name), o in found.items()
            if kind == "Service" and selector.items() <= o["metadata"]["labels"].items()
        ]
        self.assertEqual(services, ["osteon-coordinator-metrics"])

    def test_its_eviction_is_forbidden_only_if_told_to(self):
        self.assertNotIn(("PodDisruptionBudget", "osteon-coordinator"), chart.objects())
        values = {"coordinator": {"podDisruptionBudget": {"enabled": True}}}
        budget = chart.one("PodDisruptionBudget", values, "osteon-coordinator")
        self.assertEqual(budget["spec"]["maxUnavailable"], 0)

    def test_the_image(self):
        digest = "sha256:" + "0" * 64
        for image, expected in [
            ({}, "osteon:0.1.0"),
            ({"tag": "x"}, "osteon:x"),
            ({"repository": "r.example:5000/a/osteon"}, "r.example:5000/a/osteon:0.1.0"),
            ({"tag": "x", "digest": digest}, f"osteon@{digest}"),
        ]:
            for found in chart.objects({"image": image}).values():
                if chart.pod(found) is not None:
                    self.assertEqual(chart.container(found)["image"], expected)

    def test_names_for_every_release(self):
        for name, values, expected in [
            ("osteon", {}, "osteon-coordinator"),
            ("my-osteon", {}, "my-osteon-coordinator"),
            ("bones", {}, "bones-osteon-coordinator"),
            ("bones", {"nameOverride": "x"}, "bones-x-coordinator"),
            ("bones", {"fullnameOverride": "y"}, "y-coordinator"),
            ("a" * 53, {}, "a" * 40 + "-coordinator"),
        ]:
            found = coordinator(values, name=name)
            self.assertEqual(found["metadata"]["name"], expected)
            self.assertEqual(found["spec"]["serviceName"], expected)
