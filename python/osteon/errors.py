"""The exceptions of osteon. Every one of them is an :class:`OsteonError`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, NoReturn

__all__ = [
    "CancelledError",
    "CoordinatorError",
    "DirectWaveFirstError",
    "InconsistentArrivalError",
    "InputError",
    "InternalError",
    "JobFailedError",
    "NoArrivalError",
    "NoConvergenceError",
    "NotFiniteError",
    "OsteonError",
    "OsteonWarning",
    "ProgramError",
    "SimulationError",
    "UnreadableFileError",
    "Violation",
]


class Violation(NamedTuple):
    """A rule that an input violates.

    Attributes:
        field: the field as in a job file, e.g. ``parameters.density.start``; empty for the whole input.
        message: what is wrong, what is allowed, and often what is meant.
        line: line of the file, if the input is a file in TOML.
    """

    field: str
    message: str
    line: int | None = None


class OsteonWarning(UserWarning):
    """A value that is allowed but unusual."""


class OsteonError(Exception):
    """Base class of all exceptions of osteon."""


class InputError(OsteonError, ValueError):
    """An input is refused; nothing was computed.

    Attributes:
        violations: everything that is wrong, each with its field.
    """

    def __init__(
        self, message: str, violations: Iterable[tuple[str, str, int | None]] = ()
    ) -> None:
        self.violations: tuple[Violation, ...] = tuple(Violation(*found) for found in violations)
        super().__init__(message, self.violations)

    def __str__(self) -> str:
        return str(self.args[0])

    @property
    def field(self) -> str:
        """The field of the first violation, or an empty string."""
        return self.violations[0].field if self.violations else ""


class UnreadableFileError(OsteonError, OSError):
    """A file cannot be read."""


class SimulationError(OsteonError, ArithmeticError):
    """A case has no velocity.

    Attributes:
        kind: the kind of failure, e.g. ``no_arrival``; docs/glossary.md explains each.
        detail: what happened, in a sentence.
    """

    kind: str = ""

    def __init__(self, detail: str) -> None:
        self.detail = detail
        super().__init__(detail)

    def __str__(self) -> str:
        return f"{self.kind}: {self.detail}"


class NoArrivalError(SimulationError):
    """No first arrival was found at some receiver."""

    kind = "no_arrival"


class InconsistentArrivalError(SimulationError):
    """The picked times do not lie on one wave."""

    kind = "inconsistent_arrival"


class DirectWaveFirstError(SimulationError):
    """The wave through the coupling fluid arrives before any wave through the bone."""

    kind = "direct_wave_first"


class NotFiniteError(SimulationError):
    """A number of the computation is NaN or infinite."""

    kind = "not_finite"


class NoConvergenceError(SimulationError):
    """The solver did not reach its accuracy within its limits."""

    kind = "no_convergence"


class ProgramError(OsteonError):
    """The program ``osteon`` failed, or is not there.

    Attributes:
        exit_code: its exit code; None if it did not run.
        messages: what it printed for people.
    """

    def __init__(self, message: str, exit_code: int | None = None, messages: str = "") -> None:
        self.exit_code = exit_code
        self.messages = messages
        super().__init__(message, exit_code, messages)

    def __str__(self) -> str:
        return str(self.args[0])


class CoordinatorError(ProgramError):
    """A coordinator cannot be reached, refuses the credentials, or refuses the request."""


class JobFailedError(ProgramError):
    """A job ended without a result."""


class CancelledError(OsteonError):
    """A job was cancelled before it had a result."""


class InternalError(OsteonError):
    """A bug of osteon; please report the message with the input."""


KINDS: dict[str, type[SimulationError]] = {
    error.kind: error
    for error in (
        NoArrivalError,
        InconsistentArrivalError,
        DirectWaveFirstError,
        NotFiniteError,
        NoConvergenceError,
    )
}


def simulation_error(kind: str, detail: str) -> SimulationError:
    """The exception for a kind of failure."""
    return KINDS[kind](detail)


def refuse(field: str, message: str) -> NoReturn:
    """Raises an :class:`InputError` about one field."""
    raise InputError(f"{field}: {message}" if field else message, [(field, message, None)])
