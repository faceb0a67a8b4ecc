"""Workers inside of a real Dask cluster on this machine."""

from __future__ import annotations

import os
import signal
import unittest
from pathlib import Path
from typing import Any

import distributed
import osteon
from osteon import _dask, workers
from pools import BIG, SMALL, Service, digest_of, program_workers, until


class Dask(unittest.TestCase):
    service: Service
    cluster: Any
    client: Any

    @classmethod
    def setUpClass(cls) -> None:
        cls.service = Service([])
        cls.addClassCleanup(cls.service.stop)
        cls.cluster = distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
        )
        cls.addClassCleanup(cls.cluster.close)
        cls.client = distributed.Client(cls.cluster)
        cls.addClassCleanup(cls.client.close)

    def test_a_job_has_the_digest_of_this_machine(self) -> None:
        with workers.dask(self.client, self.service.url) as pool:
            statuses = pool.statuses()
            self.assertEqual([status.has_attached for status in statuses], [True, True])
            result = SMALL.identify(coordinator=self.service.url, progress=False)
        self.assertEqual(result.digest, digest_of(SMALL))
        until(lambda: program_workers(self.service.url) == 0, "the workers leave")

    def test_a_killed_dask_worker_loses_nothing(self) -> None:
        with workers.dask(self.client, self.service.url) as pool:
            client = osteon.Client(self.service.url)
            job = client.submit(BIG)
            for state in client.watch(job):
                if state.realizations_done > 0:
                    break
            killed = self.client.run(os.getpid)
            address, pid = next(iter(killed.items()))
            before = {status.place: status.pid for status in pool.statuses()}
            os.kill(pid, signal.SIGKILL)
            self.assertFalse(client.state(job).has_ended)
            until(lambda: not is_alive(before[address]), "the dead Dask worker's worker ends")
            self.assertEqual(client.wait(job).status, "converged")
            self.assertEqual(client.fetch(job).digest, digest_of(BIG))
            # Dask starts another one, which gets a worker, too.
            until(lambda: len({status.pid for status in pool.statuses()} - set(before.values())) == 1,
                  "the new Dask worker has a worker")  # fmt: skip

    def test_they_leave_when_the_cluster_shrinks_and_join_when_it_grows(self) -> None:
        with workers.dask(self.client, self.service.url):
            self.cluster.scale(1)
            until(lambda: program_workers(self.service.url) == 1, "one worker leaves")
            self.cluster.scale(2)
            until(lambda: program_workers(self.service.url) == 2, "one worker joins")

    def test_what_is_refused(self) -> None:
        with self.assertRaises(osteon.CoordinatorError) as caught:
            workers.dask(self.client, "http://127.0.0.1:9", patience=0.5)
        self.assertIn("127.0.0.1:9", str(caught.exception))
        with self.assertRaises(osteon.InputError) as refused:
            workers.dask(self.client, "tcp://127.0.0.1:9")
        self.assertEqual(refused.exception.field, "coordinator")
        with self.assertRaises(osteon.ProgramError) as differs:
            _dask.check_versions(self.client, "0.0.0")
        self.assertIn(f"has osteon {osteon.__version__}, and this process 0.0.0", str(differs.exception))
        self.assertEqual(self.client.run(plugins), dict.fromkeys(self.client.run(plugins), 0))


def plugins(dask_worker: Any) -> int:
    """How many plugins of osteon a Dask worker has."""
    return sum(name.startswith("osteon-") for name in dask_worker.plugins)


def is_alive(pid: int) -> bool:
    """Whether a process runs; one that nobody has waited for yet does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state not in "ZX"


if __name__ == "__main__":
    unittest.main()
