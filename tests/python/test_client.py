"""osteon as its clients in Python see it: over TLS, with tokens, by the official grpcio."""

import json
import math
import statistics
import unittest

import grpc
from google.rpc import error_details_pb2
from grpc_health.v1 import health_pb2, health_pb2_grpc
from grpc_reflection.v1alpha.proto_reflection_descriptor_database import (
    ProtoReflectionDescriptorDatabase,
)

from osteon.v1 import jobs_pb2, jobs_pb2_grpc, results_pb2, specification_pb2
from osteon_client import (
    details,
    every_job,
    fetch,
    identification,
    propagation,
    submit,
    violations,
    watch,
)
from service import Service, osteon

# Of anything that must come, s.
DEADLINE = 120

JOB_FILE = """
[parameters]
density                    = { fixed = 1598.8 }
longitudinal_young_modulus = { fixed = 17.717e9 }
longitudinal_poisson_ratio = { fixed = 0.3816 }
longitudinal_shear_modulus = { fixed = 4.795e9 }
transverse_young_modulus   = { fixed = 9.8254e9 }
transverse_poisson_ratio   = { fixed = 0.4495 }
dispersion                 = { fixed = 0.1029 }
[monte_carlo]
realizations = 60
seed = 7
"""


GROUPS_JOB_FILE = """
[parameters]
density                    = { fixed = 1598.8 }
longitudinal_young_modulus = { start = 18e9, bounds = [12e9, 25e9] }
longitudinal_poisson_ratio = { fixed = 0.3816 }
longitudinal_shear_modulus = { fixed = 4.795e9 }
transverse_young_modulus   = { fixed = 9.8254e9 }
transverse_poisson_ratio   = { fixed = 0.4495 }
dispersion                 = { start = 0.1, bounds = [0.02, 0.3] }
[monte_carlo]
realizations = 60
seed = 7
[search]
method = "newton"
"""


class WithService(unittest.TestCase):
    """Tests that share a coordinator without workers."""

    @classmethod
    def setUpClass(cls):
        cls.service = Service()
        cls.addClassCleanup(cls.service.stop)

    def refused(self, code, call, *words, **options):
        """Asserts that a call is refused with a code; the error."""
        with self.assertRaises(grpc.RpcError) as caught:
            call(*words, **options)
        self.assertEqual(caught.exception.code(), code, caught.exception.details())
        return caught.exception


class Computing(unittest.TestCase):
    def test_a_job_ends_with_the_result_of_an_embedded_run(self):
        service = Service()
        self.addCleanup(service.stop)
        jobs = service.jobs("submit")
        job = submit(jobs, propagation(60, seed=7), "python-1")
        self.assertEqual(submit(jobs, propagation(60, seed=7), "python-1"), job)
        service.worker()
        seen = []
        last = watch(jobs, job, seen.append)
        self.assertEqual(last.state, jobs_pb2.JOB_STATE_ENDED)
        self.assertEqual(last.status, results_pb2.JOB_STATUS_CONVERGED)
        self.assertIs(last, seen[-1])
        result, velocities = fetch(jobs, job)
        self.assertEqual(list(velocities), [None])
        velocities = velocities[None]

        file = service.directory / "job.toml"
        file.write_text(JOB_FILE)
        expected = json.loads(osteon("propagate", file, "--json"))
        self.assertEqual(result, expected)
        self.assertEqual(len(velocities), 60)
        successes = [velocity for velocity in velocities if not math.isnan(velocity)]
        failures = sum(result["failures"].values())
        self.assertEqual(len(successes), 60 - failures)
        # Both sum in double precision, in another order.
        mean = statistics.fmean(successes)
        self.assertAlmostEqual(mean / result["velocity"]["mean"], 1.0, delta=1e-12)


    def test_groups_are_identified_with_their_uncertainty(self):
        service = Service()
        self.addCleanup(service.stop)
        service.worker()
        jobs = service.jobs("submit")
        data = {"left": spread(3900.0, 360.0), "right": spread(3850.0, 400.0)}
        job = submit(jobs, identification(data, 60, seed=7), "")
        last = watch(jobs, job, lambda snapshot: None)
        self.assertEqual(last.status, results_pb2.JOB_STATUS_CONVERGED, last.reason)
        result, velocities = fetch(jobs, job)
        self.assertEqual([group["name"] for group in result["groups"]], list(data))

        # The same by osteon itself.
        file = service.directory / "groups.toml"
        lists = [f"{name} = {values}\n" for name, values in data.items()]
        file.write_text("[data.groups]\n" + "".join(lists) + GROUPS_JOB_FILE)
        expected = json.loads(osteon("identify", file, "--json"))
        self.assertEqual(result, expected)
        for number, group in enumerate(result["groups"]):
            for name in ["bulk_velocity", "dispersion"]:
                quantity = group["identified"][name]
                lower, upper = quantity["interval"]
                self.assertLess(lower, quantity["value"])
                self.assertLess(quantity["value"], upper)
            self.assertEqual(group["data"]["count"], 25)
            self.assertEqual(len(velocities[number]), 60)
            successes = [velocity for velocity in velocities[number] if not math.isnan(velocity)]
            mean = statistics.fmean(successes)
            self.assertAlmostEqual(mean / group["velocity"]["mean"], 1.0, delta=1e-12)


def spread(mean, width, count=25):
    """So many velocities, m/s, evenly over a width."""
    return [mean + width * (k / (count - 1) - 0.5) for k in range(count)]


class Refusals(WithService):
    def test_a_wrong_specification_is_refused_whole_with_every_field(self):
        wrong = propagation(0, seed=7)
        wrong.layers.coupling.density = -1.0
        wrong.probe.receivers.count = 2
        wrong.solver.method = 17
        jobs = self.service.jobs("submit")
        error = self.refused(grpc.StatusCode.INVALID_ARGUMENT, submit, jobs, wrong, "")
        found = violations(error)
        self.assertEqual(
            sorted(found),
            [
                "layers.coupling.density",
                "monte_carlo.realizations",
                "probe.receivers.count",
                "solver.method",
            ],
        )
        self.assertIn("-1", found["layers.coupling.density"])
        self.assertIn("3 to 64", found["probe.receivers.count"])
        self.assertIn("SOLVER_METHOD_EXACT or SOLVER_METHOD_HYBRID", found["solver.method"])
        wrong = propagation(60, seed=7)
        wrong.parameters.ClearField("density")
        wrong.parameters.dispersion.free.start = 0.1
        error = self.refused(grpc.StatusCode.INVALID_ARGUMENT, submit, jobs, wrong, "")
        found = violations(error)
        self.assertEqual(sorted(found), ["parameters.density", "parameters.dispersion.free"])
        self.assertIn("`free` with `start`, `lower` and `upper`", found["parameters.density"])

    def test_a_wrong_request_is_refused_with_its_field(self):
        jobs = self.service.jobs("submit")
        code = grpc.StatusCode.INVALID_ARGUMENT
        error = self.refused(code, submit, jobs, propagation(1, seed=1), "x" * 257)
        self.assertEqual(list(violations(error)), ["request_id"])
        error = self.refused(code, jobs.Submit, jobs_pb2.SubmitRequest())
        self.assertEqual(list(violations(error)), ["specification"])
        error = self.refused(code, jobs.List, jobs_pb2.ListRequest(page_token="nonsense"))
        self.assertEqual(list(violations(error)), ["page_token"])

    def test_an_unknown_job_is_named(self):
        jobs = self.service.jobs("submit")
        calls = [
            lambda job: jobs.Get(jobs_pb2.GetRequest(job=job)),
            lambda job: jobs.Cancel(jobs_pb2.CancelRequest(job=job)),
            lambda job: list(jobs.Watch(jobs_pb2.WatchRequest(job=job))),
            lambda job: list(jobs.Fetch(jobs_pb2.FetchRequest(job=job))),
        ]
        for call in calls:
            for job in ["999999", "nonsense"]:
                error = self.refused(grpc.StatusCode.NOT_FOUND, call, job)
                resource = details(error, error_details_pb2.ResourceInfo)
                self.assertEqual((resource.resource_type, resource.resource_name), ("job", job))

    def test_who_may_not_is_told_why(self):
        request = jobs_pb2.ListRequest()
        bare = jobs_pb2_grpc.JobsStub(self.service.channel_without_token())
        error = self.refused(grpc.StatusCode.UNAUTHENTICATED, bare.List, request)
        self.assertIn("requires a token", error.details())
        reader = self.service.jobs("read")
        reader.List(request)
        code = grpc.StatusCode.PERMISSION_DENIED
        error = self.refused(code, submit, reader, propagation(1, seed=1), "")
        self.assertIn("read-holder", error.details())

    def test_a_foreign_authority_is_not_trusted(self):
        foreign = self.service.directory / "foreign"
        osteon("certs", foreign)
        channel = self.service.channel_without_token(foreign / "ca.pem")
        stub = health_pb2_grpc.HealthStub(channel)
        request = health_pb2.HealthCheckRequest()
        self.refused(grpc.StatusCode.UNAVAILABLE, stub.Check, request, timeout=DEADLINE)


class Listing(WithService):
    def test_pages_hold_every_job_once_oldest_first(self):
        jobs = self.service.jobs("submit")
        submitted = [submit(jobs, propagation(1, seed), "") for seed in range(5)]
        for page_size in [1, 2, 5, 100]:
            listed = [snapshot.job for snapshot in every_job(jobs, page_size)]
            self.assertEqual(listed, submitted)
        first = jobs.List(jobs_pb2.ListRequest(page_size=2))
        self.assertEqual(len(first.jobs), 2)
        self.assertNotEqual(first.next_page_token, "")


class Waiting(WithService):
    """No worker: what is submitted waits."""

    def setUp(self):
        self.jobs = self.service.jobs("submit")
        self.job = submit(self.jobs, propagation(60, seed=7), "")

    def test_a_waiting_job_says_why_and_can_be_cancelled(self):
        snapshot = self.jobs.Get(jobs_pb2.GetRequest(job=self.job)).snapshot
        self.assertIn("no worker is attached", snapshot.waiting_for)
        code = grpc.StatusCode.FAILED_PRECONDITION
        self.refused(code, fetch, self.jobs, self.job)
        for _ in range(2):
            snapshot = self.jobs.Cancel(jobs_pb2.CancelRequest(job=self.job)).snapshot
            self.assertEqual(snapshot.status, results_pb2.JOB_STATUS_CANCELLED)
        last = watch(self.jobs, self.job, lambda snapshot: None)
        self.assertEqual(last.status, results_pb2.JOB_STATUS_CANCELLED)

    def test_a_stream_that_is_taken_up_again_repeats_nothing(self):
        first = next(self.jobs.Watch(jobs_pb2.WatchRequest(job=self.job), timeout=DEADLINE)).snapshot
        request = jobs_pb2.WatchRequest(job=self.job, after=first.sequence)
        again = next(self.jobs.Watch(request, timeout=DEADLINE)).snapshot
        self.assertGreater(again.sequence, first.sequence)

    def test_whoever_gives_up_leaves_the_job_alone(self):
        request = jobs_pb2.WatchRequest(job=self.job)
        stream = self.jobs.Watch(request, timeout=0.5)
        self.refused(grpc.StatusCode.DEADLINE_EXCEEDED, list, stream)
        stream = self.jobs.Watch(request)
        next(stream)
        self.assertTrue(stream.cancel())
        self.refused(grpc.StatusCode.CANCELLED, list, stream)
        snapshot = self.jobs.Get(jobs_pb2.GetRequest(job=self.job)).snapshot
        self.assertNotEqual(snapshot.state, jobs_pb2.JOB_STATE_ENDED)


class Standard(WithService):
    def test_health_answers_everybody(self):
        stub = health_pb2_grpc.HealthStub(self.service.channel_without_token())
        for name in ["", "osteon.v1.Jobs", "osteon.v1.Workers"]:
            request = health_pb2.HealthCheckRequest(service=name)
            answer = stub.Check(request, timeout=DEADLINE)
            self.assertEqual(answer.status, health_pb2.HealthCheckResponse.SERVING, name)
        request = health_pb2.HealthCheckRequest(service="osteon.v1.Nothing")
        self.refused(grpc.StatusCode.NOT_FOUND, stub.Check, request, timeout=DEADLINE)

    def test_reflection_describes_the_services_to_holders_of_tokens(self):
        database = ProtoReflectionDescriptorDatabase(self.service.channel("read"))
        services = set(database.get_services())
        self.assertLessEqual(
            {"osteon.v1.Jobs", "osteon.v1.Workers", "grpc.health.v1.Health"}, services
        )
        described = database.FindFileContainingSymbol("osteon.v1.JobSpecification")
        compiled = specification_pb2.DESCRIPTOR
        self.assertEqual(described.name, compiled.name)
        self.assertEqual(
            [message.name for message in described.message_type],
            [message.name for message in compiled.message_types_by_name.values()],
        )
        bare = ProtoReflectionDescriptorDatabase(self.service.channel_without_token())
        self.refused(grpc.StatusCode.UNAUTHENTICATED, bare.get_services)


if __name__ == "__main__":
    unittest.main()
