"""Workers inside of a real Ray cluster on this machine."""

from __future__ import annotations

import os
import unittest

# Before Ray is imported, which reads them.
os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")

import osteon
import ray
from osteon import workers
from pools import BIG, SMALL, Service, digest_of, program_workers, until


class Ray(unittest.TestCase):
    service: Service

    @classmethod
    def setUpClass(cls) -> None:
        cls.service = Service([])
        cls.addClassCleanup(cls.service.stop)
        ray.init(
            num_cpus=2,
            include_dashboard=False,
            _node_ip_address="127.0.0.1",
            object_store_memory=100 << 20,
            logging_level="error",
            log_to_driver=False,
        )
        cls.addClassCleanup(ray.shutdown)

    def test_a_job_has_the_digest_of_this_machine_while_the_pool_shrinks(self) -> None:
        with workers.ray(self.service.url) as pool:
            self.assertEqual(len(pool.statuses()), 2)
            result = SMALL.identify(coordinator=self.service.url, progress=False)
            self.assertEqual(result.digest, digest_of(SMALL))
            client = osteon.Client(self.service.url)
            job = client.submit(BIG)
            for state in client.watch(job):
                if state.realizations_done > 0:
                    break
            pool.scale(1)
            until(lambda: program_workers(self.service.url) == 1, "one worker leaves")
            self.assertFalse(client.state(job).has_ended)
            self.assertEqual(client.wait(job).status, "converged")
            self.assertEqual(client.fetch(job).digest, digest_of(BIG))
        until(lambda: program_workers(self.service.url) == 0, "the workers leave")

    def test_a_killed_actor_is_started_again(self) -> None:
        with workers.ray(self.service.url, workers=1) as pool:
            [before] = pool.statuses()
            ray.kill(pool._actors[0], no_restart=False)
            until(lambda: [status.pid for status in pool.statuses()] not in ([], [before.pid]), "it starts again")
            until(lambda: program_workers(self.service.url) == 1, "its worker attaches")

    def test_what_is_refused(self) -> None:
        with self.assertRaises(osteon.CoordinatorError) as caught:
            workers.ray("http://127.0.0.1:9", workers=1, patience=0.5)
        self.assertIn("127.0.0.1:9", str(caught.exception))
        with self.assertRaises(osteon.CoordinatorError) as too_many:
            workers.ray(self.service.url, workers=3, patience=3.0)
        self.assertIn("processors", str(too_many.exception))


if __name__ == "__main__":
    unittest.main()
