"""Runs what the pods run, as a kubelet would: with the commands of the manifests, the files of the Secrets that
README.md has users create, and the user of the pods. Only addresses and paths are those of this machine."""

import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import socket
import ssl
import subprocess
import tempfile
import unittest
import urllib.request

import chart
from machine import CONTAINER_USER, OSTEON, ROOT, commands_of_page, output
from services import Service, url_of, wait_for

# The ports on which a coordinator listens in its pod; here it takes free ones.
PORT = "7000"
METRICS_PORT = "9464"


class Cluster:
    """The Secrets that README.md has users create, and the release that it has them install."""

    def __init__(self, directory):
        self.directory = directory
        self.secrets = {}
        self.release = None
        for line in commands_of_page(chart.HERE / "README.md"):
            words = shlex.split(line)
            if words[0] == "osteon":
                output(OSTEON, *words[1:], cwd=directory)
            elif words[:1] == ["kubectl"] and "secret" in words:
                self.create_secret(words)
            elif words[:2] == ["helm", "install"]:
                self.release = {"name": words[2], "namespace": words[words.index("--namespace") + 1]}

    def create_secret(self, words):
        name = words[words.index("generic") + 1]
        files = [word.split("=", 1)[1] for word in words if word.startswith("--from-file=")]
        read = {pathlib.Path(file).name: (self.directory / file).read_bytes() for file in files}
        self.secrets[name] = read

    def mount(self, found, at):
        """Makes the volumes of a pod below a directory, with owners and modes as a kubelet gives them; the
        directory of each mount path."""
        volumes = {volume["name"]: volume for volume in chart.pod(found).get("volumes", [])}
        mounts = {}
        for mount in chart.container(found).get("volumeMounts", []):
            target = at / mount["name"]
            target.mkdir()
            volume = volumes.get(mount["name"], {})
            if "secret" in volume:
                self.write_secret(volume["secret"], target)
            else:
                give_to_group(target, 0o2775)
            mounts[mount["mountPath"]] = target
        return mounts

    def write_secret(self, volume, target):
        for item in volume["items"]:
            path = target / item["path"]
            path.write_bytes(self.secrets[volume["secretName"]][item["key"]])
            give_to_group(path, volume["defaultMode"])

# The name of the node of every pod: what a variable has whose value Kubernetes knows.
NODE = "node-1"


def give_to_group(path, mode):
    if os.geteuid() == 0:
        os.chown(path, 0, CONTAINER_USER)
    path.chmod(mode)


class Pod(Service):
    """A container of a manifest as a process."""

    def __init__(self, program, cluster, found, directory, replaced):
        directory.mkdir()
        self.program = program
        self.mounts = cluster.mount(found, directory)
        self.replaced = replaced
        self.found = found
        container = chart.container(found)
        environment = {entry["name"]: entry.get("value", NODE) for entry in container["env"]}
        command = [*container["command"], *container["args"]]
        super().__init__(self.local(command), directory, environment, CONTAINER_USER)

    def local(self, command):
        """A command with the program, paths and addresses of this machine."""
        here = {"/usr/bin/osteon": self.program, **self.mounts, **self.replaced}
        longest_first = sorted(here, key=len, reverse=True)
        known = re.compile("|".join(re.escape(text) for text in longest_first))
        return [known.sub(lambda text: str(here[text[0]]), word) for word in command]

    def end_as_kubernetes(self):
        """Its exit code after SIGTERM, within the time before it would be killed."""
        return self.end(signal.SIGTERM, chart.pod(self.found)["terminationGracePeriodSeconds"])


class Pods(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        # A copy that the pods' user can reach.
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        pathlib.Path(scratch.name).chmod(0o755)
        cls.program = shutil.copy(OSTEON, scratch.name)

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.directory = pathlib.Path(scratch.name)
        # The pods' user must be able to pass.
        self.directory.chmod(0o755)
        self.cluster = Cluster(self.directory)
        values = {"metrics": {"enabled": True}, "worker": {"threads": 1}}
        self.objects = chart.objects(values, **self.cluster.release)

    def start(self, kind, name, label, replaced):
        service = Pod(self.program, self.cluster, self.objects[kind, name], self.directory / label, replaced)
        self.addCleanup(service.__exit__)
        return service

    def start_coordinator(self):
        replaced = {f"0.0.0.0:{port}": "127.0.0.1:0" for port in (PORT, METRICS_PORT)}
        pod = self.start("StatefulSet", "osteon-coordinator", "coordinator", replaced)
        store = pod.mounts["/var/lib/osteon"] / "store"
        self.port = url_of(pod, store).rsplit(":", 1)[1]
        pod.replaced = {f"localhost:{PORT}": f"localhost:{self.port}"}
        return pod

    def start_worker(self, label):
        service = f"osteon-coordinator.{self.cluster.release['namespace']}.svc:{PORT}"
        replaced = {service: f"localhost:{self.port}"}
        return self.start("Deployment", "osteon-worker", label, replaced)

    def client(self):
        """Options of a client outside of the cluster, as in README.md."""
        certs = self.directory / "certs" / "ca.pem"
        token = self.directory / "ann.token"
        url = f"https://localhost:{self.port}"
        return ["--coordinator", url, "--tls-ca", str(certs), "--token-file", str(token)]

    def short_job(self):
        """An identification of a few seconds, with its data."""
        examples = self.directory / "examples"
        shutil.copytree(ROOT / "examples", examples)
        text = (examples / "quick.toml").read_text()
        self.assertIn("realizations = 200\n", text)
        path = examples / "short.toml"
        path.write_text(text.replace("realizations = 200\n", "realizations = 30\n"))
        return str(path)

    def workers(self):
        return json.loads(output(OSTEON, "worker", "list", "--json", *self.client()))["workers"]

    def attached(self, number):
        return wait_for(f"attachment of {number} workers", lambda: len(self.workers()) == number)

    def test_probes_tell_whether_the_coordinator_serves(self):
        coordinator = self.start_coordinator()
        container = chart.container(coordinator.found)
        for name in ("startupProbe", "readinessProbe", "livenessProbe"):
            command = coordinator.local(container[name]["exec"]["command"])
            done = subprocess.run(command, capture_output=True, timeout=30, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
        coordinator.send(signal.SIGSTOP)
        done = subprocess.run(command, capture_output=True, timeout=30, check=False)
        self.assertEqual(done.returncode, 1, done.stderr)
        coordinator.send(signal.SIGCONT)
        self.assertEqual(coordinator.end_as_kubernetes(), 0)
        done = subprocess.run(command, capture_output=True, timeout=30, check=False)
        self.assertEqual(done.returncode, 1, done.stderr)

    def test_the_certificate_is_for_the_name_that_workers_dial(self):
        self.start_coordinator()
        (worker,) = [o for (kind, _), o in self.objects.items() if kind == "Deployment"]
        host = chart.argument(worker, "--coordinator").removeprefix("https://").rsplit(":", 1)[0]
        context = ssl.create_default_context(cafile=self.directory / "certs" / "ca.pem")
        context.set_alpn_protocols(["h2"])
        with socket.create_connection(("127.0.0.1", int(self.port)), timeout=30) as plain:
            with context.wrap_socket(plain, server_hostname=host) as encrypted:
                self.assertEqual(encrypted.selected_alpn_protocol(), "h2")

    def test_the_metric_that_scales_workers_is_served(self):
        coordinator = self.start_coordinator()
        written = coordinator.mounts["/var/lib/osteon"] / "store" / "metrics-address"
        url = wait_for("the address of the metrics", lambda: written.is_file() and written.read_text().strip())
        monitor = chart.one("ServiceMonitor", {"metrics": {"serviceMonitor": {"enabled": True}}})
        self.assertTrue(url.endswith(monitor["spec"]["endpoints"][0]["path"]), url)
        hpa = chart.one("HorizontalPodAutoscaler", {"worker": {"autoscaling": {"kind": "hpa"}}})
        name = hpa["spec"]["metrics"][0]["object"]["metric"]["name"]
        with urllib.request.urlopen(url, timeout=30) as answer:
            lines = answer.read().decode().splitlines()
        values = dict(line.rsplit(" ", 1) for line in lines if not line.startswith("#"))
        self.assertEqual(float(values[name]), 0.0)

    def test_the_store_is_private_and_outlives_its_pod(self):
        coordinator = self.start_coordinator()
        store = coordinator.mounts["/var/lib/osteon"] / "store"
        self.assertEqual(store.stat().st_mode & 0o777, 0o700)
        self.assertNotIn("other users", coordinator.text())
        self.assertEqual(coordinator.end_as_kubernetes(), 0)
        self.assertTrue((store / "osteon.sqlite").is_file())

    def test_removing_workers_changes_no_bit_and_loses_no_job(self):
        job = self.short_job()
        self.start_coordinator()
        workers = [self.start_worker(f"worker-{number}") for number in range(2)]
        self.attached(2)
        identity = output(OSTEON, "submit", job, *self.client()).strip()

        def state():
            (only,) = json.loads(output(OSTEON, "jobs", "--json", *self.client()))
            return only

        wait_for("the first evaluations", lambda: state()["evaluations"] >= 3)
        # Down to one, to none, and up again.
        for left, worker in [(1, workers[0]), (0, workers[1])]:
            self.assertEqual(worker.end_as_kubernetes(), 0, worker.text())
            self.assertEqual(len(self.workers()), left)
        self.assertEqual(state()["state"], "running", state())
        self.start_worker("worker-2")
        scaled, undisturbed = self.directory / "scaled", self.directory / "undisturbed"
        output(OSTEON, "watch", identity, *self.client())
        output(OSTEON, "fetch", identity, "--out", str(scaled), *self.client())
        output(OSTEON, "identify", job, "--out", str(undisturbed))
        digests = [json.loads((run / "result.json").read_text())["digest"] for run in (scaled, undisturbed)]
        self.assertEqual(digests[0], digests[1])
