"""A coordinator with TLS and tokens, set up by osteon's own commands, for tests."""

import os
import pathlib
import subprocess
import tempfile

import grpc

from osteon.v1 import jobs_pb2_grpc
from osteon_client import connect

OSTEON = os.environ["OSTEON"]
ROLES = ["read", "submit", "admin"]


class Service:
    """Processes and files of one coordinator. Everything ends with `stop`."""

    def __init__(self):
        self._scratch = tempfile.TemporaryDirectory(prefix="osteon-python-")
        self.directory = pathlib.Path(self._scratch.name)
        self._processes = []
        self._channels = []
        try:
            self._start()
        except BaseException:
            self.stop()
            raise

    def _start(self):
        certs, tokens = self.directory / "certs", self.directory / "tokens"
        osteon("certs", certs)
        for role in ROLES:
            out = self.directory / f"{role}.token"
            osteon("token", f"{role}-holder", "--role", role, "--out", out, "--tokens", tokens)
        options = ["--tls-ca", certs / "ca.pem", "--tokens", tokens]
        options += ["--tls-cert", certs / "server.pem", "--tls-key", certs / "server-key.pem"]
        store = self.directory / "store"
        coordinator = self._spawn("coordinator", "--listen", "127.0.0.1:0", "--store", store, *options)
        self.url = coordinator.stdout.readline().strip()
        assert self.url.startswith("https://127.0.0.1:"), self.url
        self.address = self.url.removeprefix("https://")

    def worker(self):
        """Starts a worker with a worker's certificate."""
        certs = self.directory / "certs"
        options = ["--tls-ca", certs / "ca.pem", "--tls-cert", certs / "worker.pem"]
        options += ["--tls-key", certs / "worker-key.pem", "--threads", "1"]
        self._spawn("worker", "--coordinator", self.url, *options)

    def channel(self, role):
        """A channel with the token of a role."""
        ca, token = self.directory / "certs" / "ca.pem", self.directory / f"{role}.token"
        return self._keep(connect(self.address, ca, token))

    def jobs(self, role):
        """The service of clients, with the token of a role."""
        return jobs_pb2_grpc.JobsStub(self.channel(role))

    def channel_without_token(self, ca_file=None):
        """A channel over TLS that shows no token."""
        ca_file = ca_file or self.directory / "certs" / "ca.pem"
        tls = grpc.ssl_channel_credentials(root_certificates=ca_file.read_bytes())
        return self._keep(grpc.secure_channel(self.address, tls))

    def stop(self):
        """Ends all that was started here."""
        for channel in self._channels:
            channel.close()
        for process in reversed(self._processes):
            process.kill()
            process.wait()
            process.stdout.close()
        self._scratch.cleanup()

    def _keep(self, channel):
        self._channels.append(channel)
        return channel

    def _spawn(self, *words):
        environment = dict(os.environ, RUST_LOG="warn")
        command = [OSTEON, *map(str, words)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
        self._processes.append(process)
        return process


def osteon(*words):
    """Runs the program to its end; what it prints."""
    command = [OSTEON, *map(str, words)]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
