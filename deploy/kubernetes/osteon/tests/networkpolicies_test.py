"""Who may connect to whom."""

import unittest

import chart


def policy(name, values=None):
    return chart.one("NetworkPolicy", values, f"osteon-{name}")["spec"]


def peers(rules, port):
    return [peer for rule in rules if port in [p["port"] for p in rule["ports"]] for peer in rule.get("from", rule.get("to"))]


def component(name):
    labels = {
        "app.kubernetes.io/name": "osteon",
        "app.kubernetes.io/instance": chart.NAME,
        "app.kubernetes.io/component": name,
    }
    return {"podSelector": {"matchLabels": labels}}


class NetworkPolicies(unittest.TestCase):
    def test_both_directions_are_closed_unless_opened(self):
        for name in ("coordinator", "worker"):
            self.assertEqual(policy(name)["policyTypes"], ["Ingress", "Egress"])

    def test_the_coordinator_admits_workers_the_test_and_clients(self):
        closed = {"networkPolicy": {"clients": []}}
        admitted = peers(policy("coordinator", closed)["ingress"], "grpc")
        self.assertEqual(admitted, [component("worker"), component("test")])
        block = {"ipBlock": {"cidr": "192.0.2.0/24"}}
        admitted = peers(policy("coordinator", {"networkPolicy": {"clients": [block]}})["ingress"], "grpc")
        self.assertEqual(admitted[2:], [block])

    def test_the_coordinator_opens_no_connections(self):
        self.assertEqual(policy("coordinator")["egress"], [])

    def test_metrics_are_for_those_named_only(self):
        prometheus = {"namespaceSelector": {"matchLabels": {"name": "monitoring"}}}
        for values, expected in [
            ({"networkPolicy": {"metrics": [prometheus]}}, [prometheus]),
            ({"networkPolicy": {"metrics": []}}, []),
            ({"metrics": {"enabled": False}}, []),
        ]:
            self.assertEqual(peers(policy("coordinator", values)["ingress"], "metrics"), expected)

    def test_workers_reach_the_coordinator_and_names_only(self):
        spec = policy("worker")
        self.assertEqual(spec["ingress"], [])
        self.assertEqual(peers(spec["egress"], "grpc"), [component("coordinator")])
        self.assertEqual(peers(spec["egress"], 53), [{"namespaceSelector": {}}])
        self.assertEqual(len(spec["egress"]), 2)
        self.assertEqual(len(policy("worker", {"networkPolicy": {"dns": []}})["egress"]), 1)

    def test_there_are_none_if_told_so(self):
        kinds = {kind for kind, _ in chart.objects({"networkPolicy": {"enabled": False}})}
        self.assertNotIn("NetworkPolicy", kinds)
