"""Jobs on a coordinator."""

from __future__ import annotations

import asyncio
import os
import signal
import unittest
from pathlib import Path

import osteon
from support import OPTIMUM, Service, TestCase, program, small_job


class Plain(TestCase):
    service: Service
    client: osteon.Client

    @classmethod
    def setUpClass(cls) -> None:
        cls.service = Service([])
        cls.addClassCleanup(cls.service.stop)
        cls.service.worker()
        cls.client = osteon.Client(cls.service.url)

    def propagation(self, realizations: int = 200) -> osteon.Job:
        return osteon.Job(parameters=OPTIMUM, monte_carlo={"realizations": realizations, "seed": 7})

    def test_the_same_job_has_one_digest_everywhere(self) -> None:
        job = small_job()
        here = job.identify(progress=False)
        there = job.identify(coordinator=self.service.url, progress=False)
        self.assertEqual(there.digest, here.digest)
        submitted = self.client.submit(job, name="small")
        self.assertEqual(self.client.wait(submitted).status, "converged")
        fetched = self.client.fetch(submitted)
        self.assertEqual(fetched.digest, here.digest)
        self.assertEqual(fetched.table("history").keys(), here.table("history").keys())

    def test_a_job_is_submitted_once_watched_and_fetched(self) -> None:
        job = self.propagation()
        first = self.client.submit(job, request_id="once", name="n", priority=2)
        self.assertEqual(self.client.submit(job, request_id="once", name="n", priority=2), first)
        states = list(self.client.watch(first))
        self.assertTrue(states[-1].has_ended)
        self.assertEqual((states[-1].name, states[-1].priority), ("n", 2))
        self.assertIn(first, [state.job for state in self.client.jobs()])
        out = self.scratch() / "out"
        result = self.client.fetch(first, out=out)
        self.assertEqual(result.digest, job.propagate(progress=False).digest)
        self.assertTrue((out / "realizations.csv").is_file())

    def test_a_job_can_be_watched_asynchronously(self) -> None:
        submitted = self.client.submit(self.propagation())

        async def last() -> osteon.JobState:
            states = [state async for state in self.client.watch_async(submitted)]
            return states[-1]

        self.assertTrue(asyncio.run(last()).has_ended)

    def test_cancel(self) -> None:
        submitted = self.client.submit(self.propagation(10_000_000))
        self.assertFalse(self.client.state(submitted).has_ended)
        with self.assertRaises(osteon.CoordinatorError):
            self.client.fetch(submitted)
        self.client.cancel(submitted)
        self.assertEqual(self.client.wait(submitted).status, "cancelled")

    def test_ctrl_c_cancels_on_the_coordinator(self) -> None:
        jobs: list[str] = []

        def interrupt(state: osteon.JobState) -> None:
            jobs.append(state.job)
            os.kill(os.getpid(), signal.SIGINT)

        with self.assertRaises(KeyboardInterrupt):
            self.propagation(10_000_000).propagate(coordinator=self.service.url, progress=interrupt)
        self.assertEqual(self.client.wait(jobs[0]).status, "cancelled")

    def test_what_the_coordinator_does_not_know(self) -> None:
        with self.assertRaises(osteon.InputError) as caught:
            self.client.cancel("no-such-job")
        self.assertIn("no-such-job", str(caught.exception))
        with self.assertRaises(osteon.InputError):
            list(self.client.watch("no-such-job"))

    def test_a_coordinator_that_is_away_is_named(self) -> None:
        # No service listens on the port for discarded data.
        away = "http://127.0.0.1:9"
        with self.assertRaises(osteon.CoordinatorError) as caught:
            osteon.Client(away).jobs()
        self.assertIn("127.0.0.1:9", str(caught.exception))

    def test_an_address_is_needed(self) -> None:
        self.assertNotIn("OSTEON_COORDINATOR", os.environ)
        self.refused("coordinator", "OSTEON_COORDINATOR", osteon.Client)


class Secure(TestCase):
    def test_certificates_and_tokens(self) -> None:
        files = self.scratch()
        program("certs", files / "certs")
        for role in ("read", "submit"):
            program("token", f"{role}-holder", "--role", role, "--out", files / f"{role}.token",
                    "--tokens", files / "tokens")  # fmt: skip
        ca = files / "certs" / "ca.pem"

        def of(name: str) -> list[object]:
            certificate, key = (files / "certs" / f"{name}{end}.pem" for end in ("", "-key"))
            return ["--tls-ca", ca, "--tls-cert", certificate, "--tls-key", key]

        service = Service([*of("server"), "--tokens", files / "tokens"])
        self.addCleanup(service.stop)
        service.worker(*of("worker"))
        job = osteon.Job(parameters=OPTIMUM, monte_carlo={"realizations": 50})

        def holder(role: str) -> osteon.Credentials:
            return osteon.Credentials(tls_ca=ca, token_file=Path(files, f"{role}.token"))

        result = job.propagate(coordinator=service.url, credentials=holder("submit"), progress=False)
        self.assertEqual(result.digest, job.propagate(progress=False).digest)
        reader = osteon.Client(service.url, credentials=holder("read"))
        self.assertEqual(len(reader.jobs()), 1)
        with self.assertRaises(osteon.CoordinatorError) as caught:
            reader.submit(job)
        self.assertIn("submit", str(caught.exception))


if __name__ == "__main__":
    unittest.main()
