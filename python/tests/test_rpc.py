"""The messages and stubs that the package ships, with grpcio."""

from __future__ import annotations

import asyncio
import json
import unittest
from pathlib import Path
from typing import Any

import grpc
import osteon
from osteon import rpc
from osteon.v1 import jobs_pb2, jobs_pb2_grpc, specification_pb2
from support import OPTIMUM, Service, TestCase, program, small_job

LONGEST_S = 60.0


def fetched(stub: jobs_pb2_grpc.JobsStub, job: str) -> Any:
    """The result of a job."""
    for response in stub.Fetch(jobs_pb2.FetchRequest(job=job), timeout=LONGEST_S):
        if response.WhichOneof("part") == "result":
            return json.loads(response.result.json)
    raise AssertionError("no result")


def run(stub: jobs_pb2_grpc.JobsStub, job: osteon.Job, request_id: str) -> Any:
    """Submits a job, and waits for its result."""
    request = jobs_pb2.SubmitRequest(specification=rpc.specification(job), request_id=request_id)
    name = stub.Submit(request, timeout=LONGEST_S).job
    for _ in stub.Watch(jobs_pb2.WatchRequest(job=name), timeout=LONGEST_S):
        pass
    return fetched(stub, name)


class Plain(TestCase):
    service: Service

    @classmethod
    def setUpClass(cls) -> None:
        cls.service = Service([])
        cls.addClassCleanup(cls.service.stop)
        cls.service.worker()

    def test_command_line_python_coordinator_and_grpc_give_one_digest(self) -> None:
        job = small_job()
        file = self.scratch() / "job.toml"
        file.write_text(job.to_toml())
        stub, channel = rpc.jobs(self.service.url)
        self.addCleanup(channel.close)
        digests = {
            "command line": json.loads(program("identify", file, "--json"))["digest"],
            "embedded": job.identify(progress=False).digest,
            "coordinator": job.identify(coordinator=self.service.url, progress=False).digest,
            "gRPC": run(stub, job, "one digest")["digest"],
        }
        self.assertEqual(len(set(digests.values())), 1, digests)

    def test_a_message_has_every_default(self) -> None:
        message = rpc.specification(small_job())
        self.assertEqual(message.kind, specification_pb2.JOB_KIND_IDENTIFICATION)
        self.assertEqual(message.monte_carlo.realizations, 64)
        self.assertEqual(message.data.count, 1000)
        self.assertGreater(message.search.max_evaluations, 0)
        propagation = rpc.specification(small_job(), kind="propagation")
        self.assertEqual(propagation.kind, specification_pb2.JOB_KIND_PROPAGATION)

    def test_asyncio(self) -> None:
        job = osteon.Job(parameters=OPTIMUM, monte_carlo={"realizations": 50})

        async def status() -> int:
            stub, channel = rpc.jobs_async(self.service.url)
            async with channel:
                request = jobs_pb2.SubmitRequest(specification=rpc.specification(job), request_id="async")
                name = (await stub.Submit(request, timeout=LONGEST_S)).job
                watched = stub.Watch(jobs_pb2.WatchRequest(job=name), timeout=LONGEST_S)
                return [int(response.snapshot.state) async for response in watched][-1]

        self.assertEqual(asyncio.run(status()), jobs_pb2.JOB_STATE_ENDED)

    def test_an_address_that_is_none_is_refused(self) -> None:
        token = self.scratch() / "token"
        token.write_text("x")
        holder = osteon.Credentials(token_file=token)
        for address, credentials in (
            ("127.0.0.1:7000", None),
            ("https://host", None),
            ("http://host:x", None),
            ("http://example.org:7000", holder),
        ):
            with self.subTest(address):
                self.refused("coordinator", address, rpc.jobs, address, credentials)
        missing = osteon.Credentials(tls_ca="no-such-file")
        with self.assertRaises(osteon.errors.UnreadableFileError) as caught:
            rpc.jobs("https://127.0.0.1:7000", missing)
        self.assertIn("credentials.tls_ca", str(caught.exception))


class Secure(TestCase):
    def secure(self, *options: object, listen: str = "127.0.0.1:0") -> tuple[Service, Path]:
        """A coordinator that wants tokens, and the directory with a token of each role."""
        files = self.scratch()
        for role in ("read", "submit"):
            program("token", f"{role}-holder", "--role", role, "--out", files / f"{role}.token",
                    "--tokens", files / "tokens")  # fmt: skip
        service = Service([*options, "--tokens", files / "tokens"], listen)
        self.addCleanup(service.stop)
        return service, files

    def check_roles(self, service: Service, files: Path, ca: Path | None) -> None:
        """Who may read sees the jobs, and is refused a submission."""
        reader = osteon.Credentials(tls_ca=ca, token_file=files / "read.token")
        stub, channel = rpc.jobs(service.url, reader)
        with channel:
            stub.List(jobs_pb2.ListRequest(page_size=1), timeout=LONGEST_S)
            job = osteon.Job(parameters=OPTIMUM, monte_carlo={"realizations": 5})
            request = jobs_pb2.SubmitRequest(specification=rpc.specification(job), request_id="x")
            with self.assertRaises(grpc.RpcError) as caught:
                stub.Submit(request, timeout=LONGEST_S)
            self.assertEqual(caught.exception.code(), grpc.StatusCode.PERMISSION_DENIED)
        writer = osteon.Credentials(tls_ca=ca, token_file=files / "submit.token")
        stub, channel = rpc.jobs(service.url, writer)
        with channel:
            self.assertTrue(stub.Submit(request, timeout=LONGEST_S).job)

    def test_tls_with_tokens(self) -> None:
        certs = self.scratch() / "certs"
        program("certs", certs)
        tls = ["--tls-ca", certs / "ca.pem", "--tls-cert", certs / "server.pem",
               "--tls-key", certs / "server-key.pem"]  # fmt: skip
        service, files = self.secure(*tls)
        self.check_roles(service, files, certs / "ca.pem")

    def test_a_unix_socket_with_tokens(self) -> None:
        service, files = self.secure(listen=f"unix:{self.scratch() / 'socket'}")
        self.check_roles(service, files, None)

    def test_this_machine_with_tokens(self) -> None:
        service, files = self.secure()
        self.check_roles(service, files, None)


if __name__ == "__main__":
    unittest.main()
