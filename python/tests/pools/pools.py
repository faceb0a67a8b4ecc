"""What the tests of both clusters use."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import osteon

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from support import FREE, OPTIMUM, Service, program  # noqa: E402

__all__ = ["BIG", "SMALL", "Service", "digest_of", "program_workers", "until"]

LONGEST_S = 60.0
"""Longest time that anything may take."""

SMALL = osteon.Job(
    parameters=FREE,
    data={"mean": 3908.0, "coefficient_of_variation": 0.0267, "count": 1000},
    monte_carlo={"sampling": "sobol", "realizations": 64, "control_variate": True},
    search={"method": "newton"},
)
"""A search of a second."""

BIG = osteon.Job(parameters=OPTIMUM, monte_carlo={"realizations": 10_000, "seed": 7})
"""A propagation that takes long enough to be disturbed."""

DIGESTS: dict[str, str] = {}


def digest_of(job: osteon.Job) -> str:
    """The digest of a job on this machine; computed once."""
    text = job.to_toml()
    if text not in DIGESTS:
        run = job.identify if job.kind == "identification" else job.propagate
        DIGESTS[text] = run(progress=False).digest
    return DIGESTS[text]


def program_workers(url: str) -> int:
    """How many workers are attached to the coordinator."""
    import json

    return len(json.loads(program("worker", "list", "--json", "--coordinator", url))["workers"])


def until(is_so: Callable[[], bool], what: str) -> None:
    """Waits until something is so."""
    deadline = time.monotonic() + LONGEST_S
    while not is_so():
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {LONGEST_S:g} s: {what}")
        time.sleep(0.1)
