"""The solver as functions."""

from __future__ import annotations

import json
import multiprocessing
import os
import pickle
import threading
import unittest
from typing import Any

import numpy as np
import osteon
from osteon import errors
from support import CASE_A, EXAMPLES, TestCase, interrupt_after, program

OPTIMUM = {
    "density": 1598.8,
    "longitudinal_young_modulus": 17.717e9,
    "longitudinal_poisson_ratio": 0.3816,
    "longitudinal_shear_modulus": 4.795e9,
    "transverse_young_modulus": 9.8254e9,
    "transverse_poisson_ratio": 0.4495,
}
NO_ARRIVAL = {"bone": OPTIMUM, "layers": {"bone": {"thickness": 4e-3}}, "picking": {"threshold": 0.99}}


def resident_kb() -> int:
    """Memory of this process, kB."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024


class Simulate(TestCase):
    def test_a_velocity_is_that_of_the_command_line_to_the_bit(self) -> None:
        for name in ("A", "D", "G"):
            path = EXAMPLES / "cases" / f"{name}.toml"
            expected = json.loads(program("simulate", path, "--json"))
            found = osteon.simulate(path)
            self.assertEqual(found.velocity, expected["velocity"])
            times = [receiver["time"] for receiver in expected["receivers"]]
            self.assertEqual(found.arrival_times.tolist(), times)

    def test_path_dictionary_and_case_are_the_same(self) -> None:
        velocity = osteon.simulate(str(CASE_A)).velocity
        self.assertEqual(osteon.simulate({"bone": OPTIMUM}).velocity, velocity)
        case = osteon.Case.read(CASE_A)
        self.assertEqual(osteon.simulate(case).velocity, velocity)
        tensor = {"density": np.float64(1598.8), "mandel": case.tensor}
        self.assertEqual(osteon.simulate({"bone": tensor}).velocity, velocity)

    def test_a_case_survives_its_text_and_a_pickle(self) -> None:
        case = osteon.Case.read(CASE_A)
        self.assertEqual(osteon.Case.parse(case.to_toml(), "toml"), case)
        self.assertEqual(pickle.loads(pickle.dumps(case)), case)
        self.assertNotEqual(case.with_bone(case.tensor, 1700.0), case)
        self.assertEqual(case.density, 1598.8)

    def test_pressures_have_coordinates(self) -> None:
        found = osteon.simulate(CASE_A, duration=10e-6, time_step=1e-7)
        self.assertEqual(found.pressures.shape, (14, 101))
        self.assertEqual((found.times[0], found.times[-1]), (0.0, 100 * 1e-7))
        data = found.to_xarray()
        self.assertEqual(data["pressure"].dims, ("receiver", "time"))
        np.testing.assert_array_equal(data["receiver"], found.receivers)
        self.assertEqual(data["time"].attrs["units"], "s")

    def test_what_is_refused_names_the_field(self) -> None:
        def case(section: str, **values: Any) -> dict[str, Any]:
            return {"bone": OPTIMUM, section: values}

        for field, words, given in (
            ("bone.density", "did you mean", {"bone": OPTIMUM | {"density": 1.5988}}),
            ("bone.density", "nan", {"bone": OPTIMUM | {"density": float("nan")}}),
            ("probe.recievers", "did you mean `receivers`?", case("probe", recievers={})),
            ("layers.coupling.sound_speed", "did you mean 1.5 km/s",
             case("layers", coupling={"sound_speed": 1.5})),
            ("bone.mandel[0][1]", "is inf", {"bone": {"density": 1.0, "mandel": np.full((6, 6), [1, np.inf, 0, 0, 0, 0])}}),
            ("bone", "", {}),
            ("bone.density", "give numbers", {"bone": OPTIMUM | {"density": object()}}),
        ):  # fmt: skip
            with self.subTest(field):
                self.refused(field, words, osteon.simulate, given)
        with self.assertRaises(errors.UnreadableFileError):
            osteon.simulate("no-such-file.toml")
        with self.assertRaises(OSError):
            osteon.simulate("no-such-file.toml")
        with self.assertRaises(ValueError):
            osteon.simulate("case.yaml")
        with self.assertRaises(osteon.InputError):
            osteon.simulate(CASE_A, time_step=-1.0).pressures
        with self.assertRaises(osteon.InputError):
            osteon.simulate(3.0)  # type: ignore[arg-type]

    def test_a_case_without_velocity_is_an_exception_of_its_kind(self) -> None:
        slow = {"density": 1000.0, "mandel": (np.eye(6) * 1e7).tolist()}
        with self.assertRaises(errors.DirectWaveFirstError) as caught:
            osteon.simulate({"bone": slow})
        self.assertIsInstance(caught.exception, osteon.SimulationError)
        self.assertEqual(caught.exception.kind, "direct_wave_first")
        self.assertIn("receiver", caught.exception.detail)
        self.assertEqual(str(pickle.loads(pickle.dumps(caught.exception))), str(caught.exception))

    def test_the_kinds_are_those_of_the_program(self) -> None:
        schema = json.loads(program("schema", "result"))
        kinds = {kind["const"] for kind in schema["$defs"]["FailureKind"]["oneOf"]}
        self.assertEqual(kinds, set(errors.KINDS))

    def test_an_input_error_survives_a_pickle(self) -> None:
        with self.assertRaises(osteon.InputError) as caught:
            osteon.simulate({"bone": OPTIMUM | {"density": -1.0}})
        again = pickle.loads(pickle.dumps(caught.exception))
        self.assertEqual(again.violations, caught.exception.violations)
        self.assertEqual(again.field, "bone.density")


class Velocities(TestCase):
    def test_many_are_each_that_of_one(self) -> None:
        tensors = osteon.ensemble(CASE_A, 0.2, 3).draw(40)
        case = osteon.Case.read(CASE_A)
        one_by_one = [osteon.simulate(case.with_bone(tensor, 1598.8)).velocity for tensor in tensors]
        for threads in (1, 2, 5):
            found = osteon.velocities(tensors, density=1598.8, threads=threads)
            self.assertEqual(found.tolist(), one_by_one)
        np.testing.assert_array_equal(osteon.velocities(tensors, setup=case), one_by_one)
        np.testing.assert_array_equal(
            osteon.velocities([CASE_A, EXAMPLES / "cases/G.toml", CASE_A]),
            [osteon.simulate(path).velocity for path in (CASE_A, EXAMPLES / "cases/G.toml", CASE_A)],
        )
        self.assertEqual(osteon.velocities(np.empty((0, 6, 6)), density=1.0).shape, (0,))

    def test_a_failure_is_nan_with_its_kind(self) -> None:
        tensors = np.stack([osteon.Case.read(CASE_A).tensor, np.eye(6) * 1e7])
        found, failures = osteon.velocities(tensors, density=1598.8, return_failures=True)
        self.assertTrue(np.isfinite(found[0]))
        self.assertTrue(np.isnan(found[1]))
        self.assertEqual(failures.tolist(), ["", "direct_wave_first"])

    def test_what_is_refused_names_the_tensor(self) -> None:
        tensors = osteon.ensemble(CASE_A, 0.1, 1).draw(3)
        wrong = tensors.copy()
        wrong[2, 0, 0] = np.nan
        call = osteon.velocities
        self.refused("tensors[2]", "entry (1,1) is NaN", call, wrong, density=1.0)
        self.refused("densities[1]", "above 0", call, tensors, density=[1.0, -1.0, 1.0])
        self.refused("densities", "one for each of 3", call, tensors, density=[1.0, 1.0])
        self.refused("density", "is missing", call, tensors)
        self.refused("tensors", "(n, 6, 6)", call, np.ones((2, 5, 5)), density=1.0)
        self.refused("threads", "must be 1 to", call, tensors, density=1.0, threads=0)
        self.refused("cases", "is one case", call, str(CASE_A))

    def test_progress_is_reported_and_may_end_it(self) -> None:
        tensors = osteon.ensemble(CASE_A, 0.1, 1).draw(50)
        seen: list[tuple[int, int]] = []
        osteon.velocities(tensors, density=1.0e3, progress=lambda *pair: seen.append(pair))
        self.assertEqual(seen[-1], (50, 50))
        self.assertEqual(sorted(seen), seen)

        def fail(_done: int, _total: int) -> None:
            raise LookupError("enough")

        with self.assertRaises(LookupError):
            osteon.velocities(tensors, density=1.0e3, progress=fail)

    def test_ctrl_c_ends_it_and_other_threads_run(self) -> None:
        tensors = np.broadcast_to(osteon.Case.read(CASE_A).tensor, (200_000, 6, 6))
        counted, stop = [0], threading.Event()

        def count() -> None:
            while not stop.wait(0.001):
                counted[0] += 1

        counter = threading.Thread(target=count)
        counter.start()
        try:
            with self.assertRaises(KeyboardInterrupt), interrupt_after(0.5):
                osteon.velocities(tensors, density=1598.8)
        finally:
            stop.set()
            counter.join()
        self.assertGreater(counted[0], 10)

    def test_a_forked_process_computes_the_same(self) -> None:
        expected = osteon.simulate(CASE_A).velocity
        with multiprocessing.get_context("fork").Pool(2) as pool:
            found = pool.map(velocity_of, [str(CASE_A)] * 4)
        self.assertEqual(found, [expected] * 4)


def velocity_of(path: str) -> float:
    """In a process of its own."""
    return osteon.velocities([path, path], threads=2).tolist()[1]  # type: ignore[no-any-return]


class Ensembles(TestCase):
    def test_tensors_are_those_of_a_job_to_the_bit(self) -> None:
        drawn = osteon.ensemble(CASE_A, dispersion=0.1029, seed=20081).draw(4)
        job = osteon.Job.read(EXAMPLES / "optimum.toml").ensemble().draw(4)
        np.testing.assert_array_equal(drawn, job)
        for index in (0, 3):
            text = program("draw", EXAMPLES / "optimum.toml", "--index", index)
            np.testing.assert_array_equal(drawn[index], osteon.Case.parse(text, "toml").tensor)

    def test_a_sobol_job_draws_its_own_points(self) -> None:
        job = EXAMPLES / "fast.toml"
        drawn = osteon.Job.read(job).ensemble().draw(1, first=5)
        text = program("draw", job, "--index", 5)
        np.testing.assert_array_equal(drawn[0], osteon.Case.parse(text, "toml").tensor)

    def test_what_is_refused_names_the_argument(self) -> None:
        for field, arguments in (
            ("dispersion", (CASE_A, 0.9, 1)),
            ("dispersion", (CASE_A, float("nan"), 1)),
            ("seed", (CASE_A, 0.1, -1)),
            ("mean", (np.eye(5), 0.1, 1)),
            ("mean", (-np.eye(6), 0.1, 1)),
        ):
            with self.subTest(field, arguments=arguments):
                self.refused(field, "", osteon.ensemble, *arguments)
        self.refused("n", "negative", osteon.ensemble(CASE_A, 0.1, 1).draw, -1)


class Memory(TestCase):
    def test_ten_thousand_calls_hold_their_memory(self) -> None:
        case = osteon.Case.read(CASE_A)
        bones = osteon.ensemble(case, 0.1, 1)

        def call(index: int) -> None:
            tensor = bones.draw(1, first=index, threads=1)
            osteon.Case.parse(case.to_toml(), "toml").with_bone(tensor[0], 1.0e3)
            with self.assertRaises(osteon.InputError):
                osteon.simulate({"bone": OPTIMUM | {"density": -1.0}})
            if index % 10 == 0:
                # Of few bones, because tables for new ones are kept, within a bound.
                osteon.velocities(bones.draw(1, first=index % 50), density=1598.8)
            if index % 100 == 0:
                osteon.simulate(case, duration=2e-6).pressures.sum()

        for index in range(500):
            call(index)
        before = resident_kb()
        for index in range(10_000):
            call(index)
        grown = resident_kb() - before
        # One array of 288 bytes lost in each call would be 2900 kB.
        self.assertLess(grown, 2000, f"{grown} kB more")


if __name__ == "__main__":
    unittest.main()
