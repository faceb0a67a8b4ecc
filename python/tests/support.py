"""What several tests use: the files of the repository, the program, services."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import tempfile
import threading
import unittest
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import osteon
from osteon import _program

# Background processes of a shell ignore SIGINT, but some tests send it to themselves.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parent.parent.parent
EXAMPLES = ROOT / "examples"
CASE_A = EXAMPLES / "cases" / "A.toml"

OPTIMUM = {
    "density": {"fixed": 1598.8},
    "longitudinal_young_modulus": {"fixed": 17.717e9},
    "longitudinal_poisson_ratio": {"fixed": 0.3816},
    "longitudinal_shear_modulus": {"fixed": 4.795e9},
    "transverse_young_modulus": {"fixed": 9.8254e9},
    "transverse_poisson_ratio": {"fixed": 0.4495},
    "dispersion": {"fixed": 0.1029},
}
"""The parameters of examples/optimum.toml."""

SEARCHED = OPTIMUM | {
    "longitudinal_young_modulus": {"start": 20.0e9, "bounds": [12.0e9, 25.0e9]},
    "dispersion": {"start": 0.15, "bounds": [0.02, 0.3]},
}
"""The parameters of examples/groups.toml."""


FREE = {
    "density": {"start": 1750.0, "bounds": [1500.0, 2000.0]},
    "longitudinal_young_modulus": {"start": 20.0e9, "bounds": [12.0e9, 25.0e9]},
    "longitudinal_poisson_ratio": {"start": 0.32, "bounds": [0.2, 0.45]},
    "longitudinal_shear_modulus": {"start": 4.5e9, "bounds": [3.0e9, 6.5e9]},
    "transverse_young_modulus": {"start": 12.0e9, "bounds": [8.0e9, 16.0e9]},
    "transverse_poisson_ratio": {"start": 0.38, "bounds": [0.2, 0.5]},
    "dispersion": {"start": 0.15, "bounds": [0.02, 0.3]},
}
"""The parameters of examples/fast.toml."""


def small_job() -> osteon.Job:
    """A search of few realizations."""
    return osteon.Job(
        parameters=FREE,
        data={"mean": 3908.0, "coefficient_of_variation": 0.0267, "count": 1000},
        monte_carlo={"sampling": "sobol", "realizations": 64, "control_variate": True},
        search={"method": "newton"},
    )


def program(*words: object) -> str:
    """Runs the program of the package; its output."""
    environment = dict(os.environ)
    environment.pop("OSTEON_COORDINATOR", None)
    command = [str(_program.find()), *map(str, words)]
    return subprocess.run(
        command, check=True, stdout=subprocess.PIPE, text=True, env=environment, cwd=ROOT
    ).stdout


class TestCase(unittest.TestCase):
    """A test with a directory of its own."""

    def scratch(self) -> Path:
        """A directory that is removed after the test."""
        directory = tempfile.TemporaryDirectory(prefix="osteon-test-")
        self.addCleanup(directory.cleanup)
        return Path(directory.name)

    def refused(self, field: str, words: str, call: Any, *arguments: Any, **named: Any) -> None:
        """The call raises an InputError about the field with these words."""
        with self.assertRaises(osteon.InputError) as caught:
            call(*arguments, **named)
        fields = [violation.field for violation in caught.exception.violations]
        self.assertIn(field, fields, str(caught.exception))
        self.assertIn(words, str(caught.exception))


@contextlib.contextmanager
def interrupt_after(seconds: float) -> Iterator[None]:
    """Sends this process what Ctrl-C sends, unless the block has ended by then."""
    timer = threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


class Service:
    """A coordinator on this machine, and a worker; ended by :meth:`stop`."""

    def __init__(self, options: list[object], listen: str = "127.0.0.1:0") -> None:
        self.scratch = tempfile.TemporaryDirectory(prefix="osteon-service-")
        self.processes: list[subprocess.Popen[str]] = []
        store = Path(self.scratch.name, "store")
        coordinator = self.start("coordinator", "--listen", listen, "--store", store, *options)
        assert coordinator.stdout is not None
        self.url = coordinator.stdout.readline().strip()

    def start(self, *words: object) -> subprocess.Popen[str]:
        """Starts the program."""
        process = subprocess.Popen(
            [str(_program.find()), *map(str, words)],
            stdout=subprocess.PIPE,
            text=True,
            env=dict(os.environ, RUST_LOG="error"),
        )
        self.processes.append(process)
        return process

    def worker(self, *options: object) -> None:
        """Starts a worker of one thread."""
        self.start("worker", "--coordinator", self.url, "--threads", 1, *options)

    def stop(self) -> None:
        """Ends all that was started here."""
        for process in reversed(self.processes):
            process.kill()
            process.wait()
            if process.stdout is not None:
                process.stdout.close()
        self.scratch.cleanup()
