"""Jobs on this machine, and what is refused of them."""

from __future__ import annotations

import inspect
import json
import os
import signal
import unittest
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import osteon
import pandas
import polars
from osteon import sections
from support import EXAMPLES, FREE, OPTIMUM, ROOT, SEARCHED, TestCase, program, small_job

MANY = {"parameters": SEARCHED, "search": {"method": "newton"}, "objective": {"kind": "moments"}}
SOBOL = {"sampling": "sobol", "realizations": 256, "control_variate": True, "seed": 1}
DIGEST_OF: dict[str, str] = {}


def digest_of(command: str, job: Path) -> str:
    """The digest of a job of the command line; computed once."""
    key = f"{command} {job}"
    if key not in DIGEST_OF:
        DIGEST_OF[key] = json.loads(program(command, job, "--json"))["digest"]
    return DIGEST_OF[key]


def groups_frame() -> pandas.DataFrame:
    """The velocities of examples/groups.toml."""
    return pandas.read_csv(EXAMPLES / "data" / "groups.csv", comment="#")


class Run(TestCase):
    def test_a_job_from_a_file_has_the_digest_of_the_command_line(self) -> None:
        file = self.scratch() / "job.toml"
        file.write_text(small_job().to_toml())
        job = osteon.Job.read(file)
        self.assertEqual(job, small_job())
        result = job.identify(progress=False)
        self.assertEqual(result.digest, digest_of("identify", file))
        self.assertEqual(result.status, "converged")

    def test_a_job_from_arguments_and_frames_has_the_same(self) -> None:
        expected = digest_of("identify", EXAMPLES / "groups.toml")
        frame = groups_frame()
        for velocities in (frame, polars.DataFrame(frame.to_dict("list"))):
            data = {"velocities": velocities, "group": "patient"}
            job = osteon.Job(data=data, monte_carlo=SOBOL, **MANY)  # type: ignore[arg-type]
            self.assertEqual(job, osteon.Job.read(EXAMPLES / "groups.toml"))
        self.assertEqual(job.identify(progress=False).digest, expected)

    def test_an_array_is_a_file_of_velocities(self) -> None:
        values = np.loadtxt(EXAMPLES / "data" / "velocities.csv", comments="#", skiprows=0,
                            converters=lambda text: float(text) if text[0].isdigit() else np.nan,
                            encoding="utf-8")  # fmt: skip
        values = values[np.isfinite(values)]
        job = osteon.Job.read(EXAMPLES / "fast.toml")
        for data in (values, pandas.DataFrame({"velocity": values}), values.tolist()):
            same = osteon.Job(
                data=data,
                parameters=FREE,
                monte_carlo=SOBOL | {"realizations": 1024},
                objective={"kind": "moments"},
                search={"method": "newton"},
            )
            self.assertEqual(same, job)

    def test_propagate_shows_progress_and_keeps_its_files(self) -> None:
        out = self.scratch() / "out"
        states: list[osteon.JobState] = []
        job = osteon.Job(parameters=OPTIMUM, monte_carlo={"realizations": 400, "seed": 20081})
        result = job.propagate(out=out, progress=states.append)
        self.assertEqual(result.directory, out)
        self.assertTrue(states[0].job)
        self.assertTrue(states[-1].has_ended)
        velocities = result.table("realizations")["velocity"]
        tensors = job.ensemble().draw(400)
        np.testing.assert_array_equal(osteon.velocities(tensors, density=1598.8), velocities)
        # The same call shows it again, and another job in the same directory is refused.
        self.assertEqual(job.propagate(out=out, progress=False).digest, result.digest)
        self.assertEqual(osteon.Result.read(out).digest, result.digest)
        other = osteon.Job(parameters=OPTIMUM, monte_carlo={"realizations": 401})
        with self.assertRaises(osteon.InputError):
            other.propagate(out=out, progress=False)

    def test_an_ensemble_has_the_pores_of_its_job(self) -> None:
        job = osteon.Job(
            bone={"porosity": 0.1},
            parameters={"dispersion": {"fixed": 0.1}},
            monte_carlo={"realizations": 20},
        )
        velocities = job.propagate(progress=False).table("realizations")["velocity"]
        # Density of the default matrix, of which a tenth is water.
        density = 0.9 * 1665.33 + 0.1 * 1000.0
        np.testing.assert_array_equal(
            osteon.velocities(job.ensemble().draw(20), density=density), velocities
        )
        profile = osteon.Job(
            bone={"porosity": {"surface": 0.05, "marrow": 0.15}},
            parameters={"dispersion": {"fixed": 0.1}},
        )
        with self.assertRaisesRegex(osteon.InputError, "bone.porosity.*changes through the thickness"):
            profile.ensemble()

    def test_the_address_in_the_environment_is_not_used(self) -> None:
        os.environ["OSTEON_COORDINATOR"] = "http://127.0.0.1:9"
        self.addCleanup(os.environ.pop, "OSTEON_COORDINATOR")
        job = osteon.Job(parameters=OPTIMUM, monte_carlo={"realizations": 10})
        self.assertEqual(job.propagate(progress=False).realizations, 10)

    def test_ctrl_c_cancels_it_and_the_same_call_resumes(self) -> None:
        out = self.scratch() / "out"
        job = small_job()

        def interrupt(state: osteon.JobState) -> None:
            if state.evaluations >= 1:
                os.kill(os.getpid(), signal.SIGINT)

        with self.assertRaises(KeyboardInterrupt):
            job.identify(out=out, progress=interrupt)
        self.assertFalse((out / "result.json").exists())
        result = job.identify(out=out, progress=False)
        self.assertEqual(result.digest, job.identify(progress=False).digest)

    def test_an_exception_of_the_callback_ends_the_job(self) -> None:
        def fail(_state: osteon.JobState) -> None:
            raise LookupError("enough")

        with self.assertRaises(LookupError):
            osteon.Job.read(EXAMPLES / "paper.toml").identify(progress=fail)

    def test_too_many_failures_are_an_exception(self) -> None:
        soft = OPTIMUM | {"longitudinal_young_modulus": {"fixed": 2e9}, "dispersion": {"fixed": 0.7}}
        soft = soft | {"longitudinal_poisson_ratio": {"fixed": 0.1}, "transverse_young_modulus": {"fixed": 2e9}}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", osteon.OsteonWarning)
            job = osteon.Job(parameters=soft, monte_carlo={"realizations": 20})
            with self.assertRaises(osteon.JobFailedError) as caught:
                job.propagate(progress=False)
        self.assertEqual(caught.exception.exit_code, 1)


class Refused(TestCase):
    def job(self, **sections: Any) -> osteon.Job:
        return osteon.Job(**({"parameters": SEARCHED} | sections))

    def test_what_is_wrong_with_the_data(self) -> None:
        frame = groups_frame()
        good = frame["velocity"].to_numpy()
        missing = frame.copy()
        missing.loc[3, "velocity"] = None
        nameless = frame.astype({"patient": object}).copy()
        nameless.loc[2, "patient"] = None
        for field, words, data in (
            ("data.velocities", "did you mean", good / 1000.0),
            ("data.velocities", "km/s", pandas.DataFrame({"velocity": good / 1000.0})),
            ("data.velocities", "the frame is empty", frame.iloc[:0]),
            ("data.velocities", "is empty", []),
            ("data.velocities", "is nan in row 3", missing),
            ("data.velocities", "did you mean 'velocities'?", frame.rename(columns={"velocity": "velocities"})),
            ("data.velocities", "no numbers", frame.astype({"velocity": str}).replace({"velocity": {str(good[0]): "x"}})),
            ("data.velocities[1]", "is nan", np.array([3900.0, np.nan, 3950.0])),
            ("data.group", "did you mean 'patient'?", {"velocities": frame, "group": "patients"}),
            ("data.group", "is empty in row 2", {"velocities": nameless, "group": "patient"}),
            ("data.subject", "no column", {"velocities": frame, "subject": "x"}),
            ("data.known", "requires data.group", {"velocities": frame, "known": {"bone_thickness": "x"}}),
            ("data.velocities", "axes", np.ones((3, 2))),
            ("data.mean", "km/s", {"mean": 3.9, "coefficient_of_variation": 0.03}),
        ):  # fmt: skip
            with self.subTest(words):
                self.refused(field, words, self.job, data=data)

    def test_what_is_wrong_with_other_sections(self) -> None:
        for field, words, given in (
            ("monte_carlo.realisations", "did you mean `realizations`?", {"monte_carlo": {"realisations": 3}}),
            ("monte_carlo.seed", "", {"monte_carlo": {"seed": -1}}),
            ("search.max_evaluations", "", {"search": {"max_evaluations": 0}}),
            ("parameters.density.bounds", "is missing", {"parameters": SEARCHED | {"density": {"start": 1598.8}}}),
            ("layers.bone.thickness", "above 0", {"layers": {"bone": {"thickness": 0.0}}}),
        ):  # fmt: skip
            with self.subTest(field):
                self.refused(field, words, self.job, **given)

    def test_all_that_is_wrong_is_named_at_once(self) -> None:
        with self.assertRaises(osteon.InputError) as caught:
            self.job(monte_carlo={"seed": -1}, search={"max_evaluations": 0})
        fields = {violation.field for violation in caught.exception.violations}
        self.assertEqual(fields, {"monte_carlo.seed", "search.max_evaluations"})

    def test_a_file_is_named_with_its_line(self) -> None:
        path = self.scratch() / "job.toml"
        path.write_text("[monte_carlo]\nseed = -1\n")
        with self.assertRaises(osteon.InputError) as caught:
            osteon.Job.read(path)
        [seed] = [found for found in caught.exception.violations if found.field == "monte_carlo.seed"]
        self.assertEqual(seed.line, 2)

    def test_an_identification_needs_data(self) -> None:
        job = self.job()
        self.assertEqual(job.kind, "propagation")
        self.refused("data", "is missing", job.identify)

    def test_where_a_job_runs_must_fit_together(self) -> None:
        job = self.job()
        self.refused("workers", "not for a coordinator", job.propagate, workers=1, coordinator="http://h:1")
        self.refused("credentials", "coordinator", job.propagate, credentials=osteon.Credentials())

    def test_an_unusual_value_is_a_warning(self) -> None:
        with self.assertWarns(osteon.OsteonWarning):
            self.job(layers={"bone": {"thickness": 0.4}})


class Sections(TestCase):
    def test_the_arguments_are_the_sections_of_a_job_file(self) -> None:
        schema = json.loads((ROOT / "docs" / "job.schema.json").read_text())
        arguments = set(inspect.signature(osteon.Job.__init__).parameters) - {"self"}
        self.assertEqual(arguments, set(schema["properties"]))
        self.assertEqual(
            set(sections.MonteCarlo.__annotations__),
            set(schema["properties"]["monte_carlo"]["properties"]),
        )


if __name__ == "__main__":
    unittest.main()
