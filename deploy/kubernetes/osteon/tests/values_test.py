"""Values: which are refused and why, and what README.md says of them."""

import json
import tomllib
import unittest

import yaml

import chart
from machine import ROOT


def nested(path, value):
    for key in reversed(path.split(".")):
        value = {key: value}
    return value


# A key, a value that it must not have, and what the message must contain.
REFUSED = [
    ("worker.replica", 3, "additional properties 'replica' not allowed"),
    ("workers", {}, "additional properties 'workers' not allowed"),
    ("tls.enabled", "false", "at '/tls/enabled': got string, want boolean"),
    ("tls.coordinator.secretName", "", "at '/tls/coordinator/secretName'"),
    ("tls.coordinator.secretName", "No", "at '/tls/coordinator/secretName'"),
    ("tls.worker.keys.ca", "a/b", "at '/tls/worker/keys/ca'"),
    ("tokens.secretName", "", "at '/tokens/secretName'"),
    ("image.tag", "a b", "at '/image/tag'"),
    ("image.digest", "sha256:1", "at '/image/digest'"),
    ("image.pullPolicy", "always", "at '/image/pullPolicy'"),
    ("imagePullSecrets", ["registry"], "at '/imagePullSecrets/0': got string, want object"),
    ("nameOverride", "Name", "at '/nameOverride'"),
    ("coordinator.replicas", 2, "additional properties 'replicas' not allowed"),
    ("coordinator.listenAddress", "127.0.0.1", "at '/coordinator/listenAddress'"),
    ("coordinator.probeHost", "https://x", "at '/coordinator/probeHost'"),
    ("coordinator.probeHost", "osteon-coordinator", "use localhost or osteon-coordinator-0"),
    ("coordinator.probeHost", "osteon-coordinator.bones.svc", "use localhost or osteon-coordinator-0"),
    ("coordinator.auditFraction", 1.5, "at '/coordinator/auditFraction': maximum"),
    ("coordinator.keepEnded", "90", "at '/coordinator/keepEnded'"),
    ("coordinator.leaseSeconds", 0, "at '/coordinator/leaseSeconds': minimum"),
    ("coordinator.leaseSeconds", 3601, "at '/coordinator/leaseSeconds': maximum"),
    ("coordinator.logLevel", "info; rm", "at '/coordinator/logLevel'"),
    ("coordinator.store.size", "10 GB", "at '/coordinator/store/size'"),
    ("coordinator.service.type", "ExternalName", "at '/coordinator/service/type'"),
    ("coordinator.service.port", 70000, "at '/coordinator/service/port': maximum"),
    ("coordinator.service.loadBalancerSourceRanges", ["192.0.2.0"], "at '/coordinator/service/loadBalancer"),
    ("coordinator.service.loadBalancerSourceRanges", ["192.0.2.0/24"], "set it to LoadBalancer"),
    ("coordinator.resources.limits.gpu", 1, "additional properties 'gpu' not allowed"),
    ("coordinator.resources.limits.memory", "4 GB", "at '/coordinator/resources/limits/memory'"),
    ("worker.threads", 0, "at '/worker/threads': minimum"),
    ("worker.threads", 2.5, "at '/worker/threads': got number, want integer"),
    ("worker.threads", 4097, "at '/worker/threads': maximum"),
    ("worker.terminationGracePeriodSeconds", 10, "at '/worker/terminationGracePeriodSeconds': minimum"),
    ("worker.podDisruptionBudget.maxUnavailable", 0, "at '/worker/podDisruptionBudget/maxUnavailable'"),
    ("worker.podDisruptionBudget.maxUnavailable", "0%", "at '/worker/podDisruptionBudget/maxUnavailable'"),
    ("worker.autoscaling.kind", "vpa", "at '/worker/autoscaling/kind'"),
    ("worker.autoscaling", {"kind": "hpa", "minReplicas": 0}, "at '/worker/autoscaling/minReplicas': minimum"),
    ("worker.autoscaling", {"kind": "hpa", "minReplicas": 11}, "must not exceed maxReplicas, which is 10"),
    ("worker.autoscaling", {"kind": "keda"}, "at '/worker/autoscaling/keda/prometheusAddress'"),
    ("worker.autoscaling.keda.prometheusAddress", "prometheus", "at '/worker/autoscaling/keda/prometheusAddress'"),
    ("networkPolicy.clients", {}, "at '/networkPolicy/clients': got object, want array"),
    ("metrics.port", 80, "at '/metrics/port': minimum"),
    ("metrics.port", 7000, "at '/metrics/port': 'not' failed"),
]


def described(schema, defaults, path=""):
    """Rows of the table of README.md: key, default and meaning of each value."""
    for key, default in defaults.items():
        inner = schema["properties"][key]
        whole = f"{path}{key}"
        if isinstance(default, dict) and "properties" in inner and key not in ("requests", "limits"):
            yield from described(inner, default, f"{whole}.")
        else:
            yield f"| `{whole}` | `{json.dumps(default)}` | {inner['description']} |"


def objects_of(schema, path=""):
    """Every object of a schema that lists its properties, by path."""
    if schema.get("type") == "object" and "properties" in schema:
        yield path, schema
        for key, inner in schema["properties"].items():
            yield from objects_of(inner, f"{path}/{key}")
    if "items" in schema:
        yield from objects_of(schema["items"], f"{path}/0")


class Values(unittest.TestCase):
    def test_wrong_ones_are_refused_with_their_key(self):
        for path, value, message in REFUSED:
            with self.subTest(path, value=value):
                self.assertIn(message, chart.refusal(nested(path, value)))

    def test_metrics_are_needed_for_what_reads_them(self):
        for path, value in [
            ("worker.autoscaling.kind", "hpa"),
            ("metrics.serviceMonitor.enabled", True),
        ]:
            values = nested(path, value)
            values.setdefault("metrics", {})["enabled"] = False
            self.assertIn("at '/metrics/enabled'", chart.refusal(values))

    def test_no_unknown_key_is_taken_anywhere(self):
        schema = chart.loaded().schema
        found = list(objects_of(schema))
        self.assertGreater(len(found), 25)
        for path, inner in found:
            self.assertIs(inner["additionalProperties"], False, path)

    def test_the_schema_lists_the_values_that_there_are(self):
        defaults = yaml.safe_load((chart.HERE / "values.yaml").read_text())
        for path, inner in objects_of(chart.loaded().schema):
            value = defaults
            for key in path.strip("/").split("/") if path else []:
                value = value.get(key, {}) if isinstance(value, dict) else {}
            if value and path.split("/")[-1] not in ("requests", "limits"):
                self.assertEqual(set(value), set(inner["properties"]) - {"global"}, path)

    def test_the_readme_describes_each(self):
        defaults = yaml.safe_load((chart.HERE / "values.yaml").read_text())
        rows = list(described(chart.loaded().schema, defaults))
        text = (chart.HERE / "README.md").read_text()
        written = [line for line in text.splitlines() if line.startswith("| `")]
        self.assertEqual(written, rows, "the table must be:\n" + "\n".join(rows))

    def test_the_chart_is_of_the_programs_version(self):
        cargo = tomllib.loads((ROOT / "Cargo.toml").read_text())
        version = cargo["workspace"]["package"]["version"]
        self.assertEqual(chart.loaded().metadata["appVersion"], version)
