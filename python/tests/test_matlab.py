"""What Octave reads of a result."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
import unittest

import numpy as np
import osteon
from support import EXAMPLES, ROOT, TestCase, small_job

OCTAVE = shutil.which("octave-cli") or shutil.which("octave")
LONGEST_S = 120


class Octave(TestCase):
    def setUp(self) -> None:
        if OCTAVE is None and os.environ.get("CI") == "true":
            raise AssertionError("CI must have octave: see .ci/run")
        if OCTAVE is None:
            self.skipTest("octave is not installed")

    def run_octave(self, script: str, directory: object) -> str:
        """Runs a script; its output."""
        assert OCTAVE is not None
        command = [OCTAVE, "--norc", "--no-history", "--quiet", "--eval", script]
        ended = subprocess.run(
            command, capture_output=True, text=True, cwd=str(directory), timeout=LONGEST_S, check=False
        )
        self.assertEqual(ended.returncode, 0, ended.stderr)
        return ended.stdout

    def test_the_page_runs(self) -> None:
        page = (ROOT / "docs" / "matlab.md").read_text(encoding="utf-8")
        python, matlab = (
            page.split(f"```{language}\n")[1].split("```")[0] for language in ("python", "matlab")
        )
        scratch = self.scratch()
        (scratch / "examples").symlink_to(EXAMPLES)
        subprocess.run([sys.executable, "-c", python], check=True, cwd=scratch, timeout=LONGEST_S)
        printed = self.run_octave(matlab, scratch)
        result = osteon.Job.read(EXAMPLES / "groups.toml").identify(progress=False)
        self.assertIn(result.digest, printed)
        for name, group in result.groups.items():
            estimate = group.estimates["longitudinal_young_modulus"]
            # The table of groups leaves out what has no interval.
            numbers = [estimate.value, *estimate.interval] if estimate.interval else [math.nan] * 3
            value, low, high = (f"{1e-9 * number:.2f}".replace("nan", "NaN") for number in numbers)
            self.assertIn(f"{name}: {value} GPa, 95 % within {low} to {high}", printed)

    def test_numbers_are_the_same_to_the_bit(self) -> None:
        scratch = self.scratch()
        result = small_job().identify(progress=False)
        result.to_mat(scratch / "result.mat")
        script = """
        found = load('result.mat');
        assert(isstruct(found.result));
        velocity = found.realizations.velocity;
        fprintf('%s\\n', class(velocity), cellstr(num2hex(velocity)){:});
        """
        kind, *lines = self.run_octave(script, scratch).split()
        self.assertEqual(kind, "double")
        velocities = result.table("realizations")["velocity"]
        self.assertEqual(lines, [f"{bits:016x}" for bits in velocities.view(np.uint64).tolist()])


if __name__ == "__main__":
    unittest.main()
