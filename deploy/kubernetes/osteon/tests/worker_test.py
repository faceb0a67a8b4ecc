"""The workers: their Deployment and budget, and what scales them."""

import unittest

import chart


def worker(values=None, **release):
    return chart.one("Deployment", values, **release)


def scaled(kind, **values):
    return {"worker": {"threads": 8, "autoscaling": {"kind": kind, **values}}}


def keda(**values):
    return scaled("keda", keda={"prometheusAddress": "http://p:9090"}, **values)


class Workers(unittest.TestCase):
    def test_they_dial_the_coordinators_service(self):
        for values, release, url in [
            ({}, {}, "https://osteon-coordinator.bones.svc:7000"),
            ({}, {"namespace": "x"}, "https://osteon-coordinator.x.svc:7000"),
            ({"coordinator": {"service": {"port": 443}}}, {}, "https://osteon-coordinator.bones.svc:443"),
            ({"tls": {"enabled": False}}, {}, "http://osteon-coordinator.bones.svc:7000"),
        ]:
            found = worker(values, **release)
            self.assertEqual(chart.argument(found, "--coordinator"), url)
        services = [name for kind, name in chart.objects() if kind == "Service"]
        self.assertIn("osteon-coordinator", services)

    def test_each_thread_has_a_processor(self):
        found = worker({"worker": {"threads": 12}})
        self.assertEqual(chart.argument(found, "--threads"), "12")
        resources = chart.container(found)["resources"]
        self.assertEqual(resources["requests"], {"cpu": "12", "memory": "512Mi"})
        self.assertEqual(resources["limits"], {"memory": "1Gi"})

    def test_requested_processors_may_be_given(self):
        values = {"worker": {"threads": 12, "resources": {"requests": {"cpu": "500m"}}}}
        resources = chart.container(worker(values))["resources"]
        self.assertEqual(resources["requests"], {"cpu": "500m", "memory": "512Mi"})

    def test_they_have_time_to_drain(self):
        # DRAIN_S_MAX of worker/src/state.rs, and some time to end.
        self.assertGreaterEqual(chart.pod(worker())["terminationGracePeriodSeconds"], 15)

    def test_they_have_no_probes(self):
        for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
            self.assertNotIn(probe, chart.container(worker()))

    def test_where_they_run(self):
        values = {"nodeSelector": {"a": "b"}, "tolerations": [{"operator": "Exists"}], "priorityClassName": "low"}
        spec = chart.pod(worker({"worker": values}))
        for key, value in values.items():
            self.assertEqual(spec[key], value)
            self.assertNotIn(key, chart.pod(worker()))
            self.assertNotIn(key, chart.pod(chart.one("StatefulSet", {"worker": values})))

    def test_their_budget(self):
        budget = chart.one("PodDisruptionBudget")
        self.assertEqual(budget["spec"]["maxUnavailable"], "50%")
        none = {"worker": {"podDisruptionBudget": {"enabled": False}}}
        self.assertNotIn(("PodDisruptionBudget", "osteon-worker"), chart.objects(none))


class Scaling(unittest.TestCase):
    def test_a_number_of_workers_that_is_scaled_is_not_set(self):
        self.assertEqual(worker()["spec"]["replicas"], 2)
        self.assertEqual(worker({"worker": {"replicas": 0}})["spec"]["replicas"], 0)
        for values in (scaled("hpa"), keda()):
            self.assertNotIn("replicas", worker(values)["spec"])

    def test_one_thing_scales_at_a_time(self):
        for values, expected in [
            ({}, set()),
            (scaled("hpa"), {"HorizontalPodAutoscaler"}),
            (keda(), {"ScaledObject"}),
        ]:
            kinds = {kind for kind, _ in chart.objects(values)}
            self.assertEqual(kinds & {"HorizontalPodAutoscaler", "ScaledObject"}, expected)

    def test_the_autoscaler_wants_a_slot_for_each_that_is_wanted(self):
        values = scaled("hpa", minReplicas=2, maxReplicas=30, scaleDownSeconds=60)
        found = chart.objects(values)
        spec = found["HorizontalPodAutoscaler", "osteon-worker"]["spec"]
        self.assertEqual((spec["minReplicas"], spec["maxReplicas"]), (2, 30))
        self.assertEqual(spec["behavior"]["scaleDown"], {"stabilizationWindowSeconds": 60})
        (metric,) = spec["metrics"]
        metric = metric["object"]
        self.assertEqual(metric["metric"], {"name": "osteon_slots_wanted"})
        self.assertEqual(metric["target"], {"type": "AverageValue", "averageValue": "8"})
        described = metric["describedObject"]
        self.assertIn((described["kind"], described["name"]), found)
        target = spec["scaleTargetRef"]
        self.assertIn((target["kind"], target["name"]), found)

    def test_keda_wants_a_slot_for_each_that_is_wanted(self):
        found = chart.objects(keda(minReplicas=0))
        spec = found["ScaledObject", "osteon-worker"]["spec"]
        self.assertEqual((spec["minReplicaCount"], spec["maxReplicaCount"]), (0, 10))
        (trigger,) = spec["triggers"]
        self.assertEqual(trigger["metadata"]["threshold"], "8")
        query = 'sum(osteon_slots_wanted{namespace="bones",service="osteon-coordinator-metrics"})'
        self.assertEqual(trigger["metadata"]["query"], query)
        self.assertIn(("Service", "osteon-coordinator-metrics"), found)
        target = spec["scaleTargetRef"]
        self.assertIn((target["kind"], target["name"]), found)

    def test_kedas_query_may_be_given(self):
        values = keda()
        values["worker"]["autoscaling"]["keda"]["query"] = "max(x)"
        (trigger,) = chart.one("ScaledObject", values)["spec"]["triggers"]
        self.assertEqual(trigger["metadata"]["query"], "max(x)")
