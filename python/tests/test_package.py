"""The package: its import, its program, its documentation."""

from __future__ import annotations

import doctest
import importlib
import os
import pkgutil
import subprocess
import sys
import unittest
from unittest import mock

import osteon
from osteon import _program
from support import ROOT, TestCase, program


class Package(TestCase):
    def test_the_program_has_the_version_of_the_module(self) -> None:
        self.assertIn(f"osteon {osteon.__version__}", program("--version"))
        self.assertIn(f"numerics {osteon.NUMERICS_REVISION}", program("--version"))

    def test_an_import_loads_nothing_that_is_slow(self) -> None:
        script = "import sys, osteon; print('\\n'.join(sys.modules))"
        loaded = subprocess.run([sys.executable, "-c", script], check=True, stdout=subprocess.PIPE, text=True)
        modules = set(loaded.stdout.split())
        for name in ("pandas", "polars", "xarray", "scipy", "arviz_base", "asyncio", "IPython", "grpc", "distributed", "ray", "importlib.metadata"):
            self.assertNotIn(name, modules)

    def test_a_missing_program_is_an_exception(self) -> None:
        with mock.patch("os.access", return_value=False), self.assertRaises(osteon.ProgramError) as caught:
            _program.find()
        self.assertIn("install the package again", str(caught.exception))

    def test_a_program_of_another_version_is_an_exception(self) -> None:
        script = self.scratch() / "osteon"
        script.write_text("#!/bin/sh\necho 'osteon 0.0.1 (commit 0, numerics 1, result schema 1)'\n")
        script.chmod(0o755)
        with self.assertRaises(osteon.ProgramError) as caught:
            _program.check_version(script)
        for words in ("0.0.1", osteon.__version__, "install the package again"):
            self.assertIn(words, str(caught.exception))

    def test_a_program_that_dies_is_an_exception(self) -> None:
        script = self.scratch() / "osteon"
        script.write_text("#!/bin/sh\nkill -KILL $$\n")
        script.chmod(0o755)
        with mock.patch.object(_program, "find", return_value=script):
            with self.assertRaises(osteon.ProgramError) as caught:
                _program.run(["jobs"])
        self.assertIn("SIGKILL", str(caught.exception))

    def test_every_example_of_the_documentation_runs(self) -> None:
        os.chdir(ROOT)
        tried = 0
        for module in pkgutil.iter_modules(osteon.__path__):
            if module.name in ("_dask", "_ray"):
                # They import packages that are not installed here; they have no examples.
                continue
            found = importlib.import_module(f"osteon.{module.name}")
            tried += self.doctest(found)
        tried += self.doctest(osteon)
        self.assertGreater(tried, 10)

    def doctest(self, module: object) -> int:
        results = doctest.testmod(module, verbose=False)  # type: ignore[arg-type]
        self.assertEqual(results.failed, 0)
        return results.attempted

    def test_every_example_of_the_page_runs(self) -> None:
        page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
        blocks = [block.split("```")[0] for block in page.split("```python\n")[1:]]
        self.assertGreater(len(blocks), 4)
        scratch = self.scratch()
        (scratch / "examples").symlink_to(ROOT / "examples")
        script = scratch / "page.py"
        script.write_text("\n".join(blocks), encoding="utf-8")
        subprocess.run([sys.executable, script], check=True, cwd=scratch, stdout=subprocess.DEVNULL)

    def test_everything_public_is_documented(self) -> None:
        for name in osteon.__all__:
            found = getattr(osteon, name)
            if callable(found):
                self.assertTrue(found.__doc__, name)
                for member, value in vars(found).items():
                    if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                        self.assertTrue(value.__doc__, f"{name}.{member}")


if __name__ == "__main__":
    unittest.main()
