"""Jobs of a coordinator: their states, and who may see them."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any, Literal, Union


@dataclass(frozen=True)
class Credentials:
    """What a client shows to a coordinator, and whom it trusts. All are paths of files.

    Attributes:
        tls_ca: certificates of the authorities that may sign the coordinator's certificate (PEM).
        tls_cert: client certificate (PEM).
        tls_key: private key of the certificate (PEM).
        token_file: file with an access token.
    """

    tls_ca: str | os.PathLike[str] | None = None
    tls_cert: str | os.PathLike[str] | None = None
    tls_key: str | os.PathLike[str] | None = None
    token_file: str | os.PathLike[str] | None = None

    def options(self) -> list[str]:
        """The options of the program."""
        found = []
        for entry in fields(self):
            path = getattr(self, entry.name)
            if path is not None:
                found += ["--" + entry.name.replace("_", "-"), os.fspath(path)]
        return found


@dataclass(frozen=True)
class JobState:
    """The state of a job.

    Attributes:
        job: its id.
        kind: `identification` or `propagation`.
        state: `waiting`, `running` or `ended`.
        status: how it ended; None before.
        reason: why it ended so, if there is more to say.
        evaluations: evaluations that are complete.
        max_evaluations: the largest number of evaluations.
        realizations_done: realizations of the present evaluation that are computed.
        realizations: realizations of each evaluation.
        best_cost: cost of the best point so far.
        best_mean: mean velocity there, m/s.
        best_coefficient_of_variation: coefficient of variation there.
        realizations_per_second: the present rate.
        workers: workers that compute it.
        elapsed_s: time since it was submitted, s.
        waiting_for: what it waits for.
        name: its name for display.
        user: who submitted it.
        priority: its priority.
        submitted: time of submission (UTC).
        ended: time of its end (UTC).
    """

    job: str
    kind: str
    state: str
    status: str | None = None
    reason: str | None = None
    evaluations: int = 0
    max_evaluations: int = 0
    realizations_done: int = 0
    realizations: int = 0
    best_cost: float | None = None
    best_mean: float | None = None
    best_coefficient_of_variation: float | None = None
    realizations_per_second: float = 0.0
    workers: int = 0
    elapsed_s: float = 0.0
    waiting_for: str | None = None
    name: str | None = None
    user: str | None = None
    priority: int = 0
    submitted: str | None = None
    ended: str | None = None
    others: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> JobState:
        """The state of an object of the program; keys that are not known here go to `others`."""
        names = {entry.name for entry in fields(cls)} - {"others"}
        known = {key: value for key, value in values.items() if key in names}
        others = {key: value for key, value in values.items() if key not in names}
        return cls(**known, others=others)

    @property
    def has_ended(self) -> bool:
        """Whether it has ended."""
        return self.status is not None

    @property
    def summary(self) -> str:
        """The state in one line."""
        if self.has_ended:
            return f"{self.status}"
        if self.waiting_for:
            return f"waiting: {self.waiting_for}"
        parts = []
        if self.kind == "identification":
            number = min(self.evaluations + 1, self.max_evaluations)
            parts.append(f"evaluation {number} of at most {self.max_evaluations}")
            if self.best_cost is not None:
                parts.append(f"best cost {self.best_cost:.3g}")
        else:
            parts.append(f"{self.realizations_done} of {self.realizations} realizations")
        parts.append(f"{self.realizations_per_second:.0f} realizations/s")
        return ", ".join(parts)


JobProgress = Union[bool, Literal["auto"], Callable[[JobState], object]]
"""Whether to show the progress of a job, or a function that is called with each state."""


def options(coordinator: str, credentials: Credentials | None) -> list[str]:
    """The options of the program for a coordinator."""
    found = [] if credentials is None else credentials.options()
    return ["--coordinator", coordinator, *found]


def environment(coordinator: str | None) -> dict[str, str] | None:
    """The environment of the program: without the address of a coordinator if the job runs here."""
    if coordinator is not None:
        return None
    return {name: value for name, value in os.environ.items() if name != "OSTEON_COORDINATOR"}
