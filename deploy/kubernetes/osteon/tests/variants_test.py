"""What holds for every set of values: the default ones, and each file in ci/."""

import itertools
import unittest

import helm_python as helm
import kubernetes_validate

import chart
import custom_resources
from machine import CONTAINER_USER, options_of

NOT_OF_KUBERNETES = {"ServiceMonitor", "ScaledObject"}


def every():
    for variant, values in chart.variants().items():
        for key, found in chart.objects(values).items():
            yield f"{variant}: {'/'.join(key)}", values, found


def pods():
    for what, values, found in every():
        if chart.pod(found) is not None:
            yield what, values, found


class Variants(unittest.TestCase):
    def test_helm_finds_no_fault(self):
        for variant, values in chart.variants().items():
            # The chart has no icon, which is all that Helm may say.
            messages = [m for m in self.lint(values) if m["error"] != "icon is recommended"]
            self.assertEqual(messages, [], variant)

    def lint(self, values):
        found = helm.lint(str(chart.HERE), values=values, namespace=chart.NAMESPACE)
        self.assertEqual(found["total_charts_linted"], 1)
        self.assertEqual(found["errors"], [])
        return found["messages"]

    def test_every_object_fits_the_schemas_of_kubernetes(self):
        count = 0
        for what, _, found in every():
            for version in chart.KUBERNETES:
                if found["kind"] in NOT_OF_KUBERNETES:
                    continue
                count += 1
                with self.subTest(what, version=version):
                    checked = kubernetes_validate.validate(found, version, strict=True)
                    self.assertEqual(checked, version)
        self.assertGreater(count, 70)

    def test_custom_resources_have_known_fields_only(self):
        count = 0
        for what, _, found in every():
            if found["kind"] in NOT_OF_KUBERNETES:
                count += 1
                with self.subTest(what):
                    custom_resources.validate(found)
        self.assertEqual(count, 2)

    def test_objects_are_named_for_their_release_and_namespace(self):
        for what, values, found in every():
            prefix = values.get("fullnameOverride", chart.NAME)
            with self.subTest(what):
                self.assertTrue(found["metadata"]["name"].startswith(prefix))
                self.assertLessEqual(len(found["metadata"]["name"]), 63)
                self.assertEqual(found["metadata"]["namespace"], chart.NAMESPACE)
                labels = found["metadata"]["labels"]
                self.assertEqual(labels["app.kubernetes.io/instance"], chart.NAME)
                for label, value in values.get("labels", {}).items():
                    self.assertEqual(labels[label], value)

    def test_pods_have_no_rights(self):
        count = 0
        for what, _, found in pods():
            count += 1
            with self.subTest(what):
                spec, container = chart.pod(found), chart.container(found)
                self.assertIs(spec["automountServiceAccountToken"], False)
                self.assertIs(spec["enableServiceLinks"], False)
                security = spec["securityContext"]
                self.assertIs(security["runAsNonRoot"], True)
                for number in ("runAsUser", "runAsGroup", "fsGroup"):
                    self.assertEqual(security[number], CONTAINER_USER)
                self.assertEqual(security["seccompProfile"], {"type": "RuntimeDefault"})
                self.assertEqual(
                    container["securityContext"],
                    {
                        "allowPrivilegeEscalation": False,
                        "readOnlyRootFilesystem": True,
                        "capabilities": {"drop": ["ALL"]},
                    },
                )
                self.assertIn("memory", container["resources"]["limits"])
                self.assertIn("cpu", container["resources"]["requests"])
                for never in ("hostNetwork", "hostPID", "hostIPC", "initContainers"):
                    self.assertNotIn(never, spec)
        self.assertEqual(count, 3 * len(chart.variants()))

    def test_every_mount_has_a_volume_and_every_volume_a_mount(self):
        for what, _, found in pods():
            with self.subTest(what):
                volumes = [volume["name"] for volume in chart.pod(found).get("volumes", [])]
                claims = found["spec"].get("volumeClaimTemplates", [])
                volumes += [claim["metadata"]["name"] for claim in claims]
                mounts = [mount["name"] for mount in chart.container(found).get("volumeMounts", [])]
                self.assertEqual(sorted(volumes), sorted(mounts))

    def test_secrets_are_readable_by_the_group_only(self):
        count = 0
        for what, _, found in pods():
            for volume in chart.pod(found).get("volumes", []):
                if "secret" in volume:
                    count += 1
                    with self.subTest(what, volume=volume["name"]):
                        # osteon refuses a key or a list of tokens that others can read.
                        self.assertEqual(volume["secret"]["defaultMode"], 0o440)
                        self.assertNotIn("optional", volume["secret"])
        self.assertGreater(count, 10)

    def test_the_program_knows_every_option(self):
        for what, _, found in pods():
            with self.subTest(what):
                self.assertEqual(chart.container(found)["command"], ["/usr/bin/osteon"])
                self.check_options(chart.container(found)["args"])
            for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
                if probe in chart.container(found):
                    program, *words = chart.container(found)[probe]["exec"]["command"]
                    self.assertEqual(program, "/usr/bin/osteon")
                    self.check_options(words)

    def check_options(self, words):
        # The command is one word or two, as `coordinator health`.
        command = itertools.takewhile(lambda word: not word.startswith("--"), words)
        given = {word for word in words if word.startswith("--")}
        self.assertLessEqual(given, options_of(*command))

    def test_selectors_find_their_pods_and_no_others(self):
        for variant, values in chart.variants().items():
            found = chart.objects(values)
            labels = {
                key: (o["spec"]["template"] if "template" in o["spec"] else o)["metadata"]["labels"]
                for key, o in found.items()
                if "spec" in o and chart.pod(o) is not None
            }
            for key, o in found.items():
                selector = selector_of(o)
                if selector is None:
                    continue
                chosen = [pod for pod, has in labels.items() if selector.items() <= has.items()]
                with self.subTest(variant, object=key):
                    self.assertEqual(len(chosen), 1, chosen)
                    component = "coordinator" if "coordinator" in key[1] else "worker"
                    self.assertIn(component, chosen[0][1])


def selector_of(found):
    """The labels by which an object finds pods; None if it finds none."""
    spec = found.get("spec", {})
    match found["kind"]:
        case "Service":
            return spec["selector"]
        case "NetworkPolicy":
            return spec["podSelector"]["matchLabels"]
        case "StatefulSet" | "Deployment" | "PodDisruptionBudget":
            return spec["selector"]["matchLabels"]
    return None
