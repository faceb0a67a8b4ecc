"""Velocities from signals as arrays."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import osteon
from support import CASE_A, EXAMPLES, TestCase, program

ARRAY: dict[str, Any] = {"signals": {"axes": ["receiver", "time"], "sampling_interval": 1e-8}}


class Pick(TestCase):
    def test_a_simulated_array_has_the_velocity_of_the_model(self) -> None:
        found = osteon.simulate(CASE_A)
        picks = osteon.pick(found.pressures, ARRAY)
        self.assertEqual(len(picks), 1)
        self.assertLess(abs(picks.velocities[0] / found.velocity - 1), 1e-5)
        self.assertEqual(picks.times.shape, (1, 14))
        simulated = json.loads(program("simulate", CASE_A, "--json"))
        self.assertLess(abs(picks.decays[0] / simulated["first_signal"]["decay"] - 1), 1e-3)
        frame = picks.to_pandas()
        self.assertEqual(frame["decay"][0], picks.decays[0])
        self.assertEqual(frame["center_frequency"][0], picks.center_frequencies[0])
        self.assertEqual(list(picks.failures), [""])
        # Numbers of other types, and views, are signals, too.
        turned = {"signals": ARRAY["signals"] | {"axes": ["time", "receiver"]}}
        again = osteon.pick(found.pressures.T, turned)
        self.assertEqual(picks.velocities[0], again.velocities[0])

    def test_a_file_is_picked_as_by_the_program(self) -> None:
        signals, probe = EXAMPLES / "signals" / "signals.npy", EXAMPLES / "signals" / "probe.toml"
        expected = json.loads(program("pick", signals, "--describe", probe, "--json"))["series"]
        picks = osteon.pick(signals, probe)
        self.assertEqual(list(picks.velocities), [one["velocity"] for one in expected])
        self.assertEqual(list(picks.qualities), [one["quality"] for one in expected])
        out = self.scratch() / "velocities.csv"
        picks.to_csv(out)
        self.assertIn("# picking.extremum", out.read_text())
        job = osteon.Job(
            parameters={"porosity": {"bounds": [0.01, 0.4]}, "dispersion": {"start": 0.15, "bounds": [0.02, 0.3]}},
            bone={"porosity": 0.15},
            data={"velocities": str(out), "error_column": "standard_error", "missing": [""]},
            probe={"bidirectional": True},
        )
        self.assertIn("repeatability", job.to_toml())

    def test_series_without_a_velocity_say_why(self) -> None:
        noise = np.random.default_rng(1).normal(size=(2, 14, 800))
        probe = {"signals": {"sampling_interval": 2e-8}}
        picks = osteon.pick(noise, probe)
        self.assertTrue(np.isnan(picks.velocities).all())
        self.assertTrue(all(picks.failures), picks.failures)

    def test_what_is_no_signal_is_refused(self) -> None:
        refused: list[tuple[Any, Any, str]] = [
            (np.zeros((14, 800), complex), ARRAY, "signals: is an array of complex128"),
            (np.zeros((14, 800)), {"signals": {"axis": 1}}, "signals.axis"),
            (np.zeros((14, 800)), 3, "probe: is a int"),
            (np.zeros((14, 800)), None, "does not say where its receivers are"),
            ("nowhere.npy", ARRAY, "nowhere.npy"),
        ]
        for signals, probe, expected in refused:
            with self.subTest(expected), self.assertRaisesRegex(osteon.InputError, expected):
                osteon.pick(signals, probe)
