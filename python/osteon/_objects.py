"""Objects of `result.json`: what the classes that are made from its schema (:mod:`osteon.results`) share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


class Object:
    """An object of `result.json`."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = values

    @property
    def json(self) -> dict[str, Any]:
        """Everything that `result.json` says of it; docs/results.md explains each key."""
        return dict(self._values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self._values == other._values

    def __hash__(self) -> int:
        # Values may be lists; equal objects have equal keys.
        return hash(frozenset(self._values))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._values!r})"


class Moments(Object):
    """Mean and coefficient of variation of velocities, or what is stated of both.

    Numbers that are not known are NaN: both, where every realization failed.
    """

    @property
    def mean(self) -> float:
        """The number for the mean: a velocity is in m/s, a relative error has no unit."""
        return known(self._values.get("mean"))

    @property
    def coefficient_of_variation(self) -> float:
        """The number for the coefficient of variation, standard deviation over mean."""
        return known(self._values.get("coefficient_of_variation"))

    @property
    def mean_standard_error(self) -> float | None:
        """Standard error of the mean by sampling, m/s, of a model's velocities."""
        return self._error("mean")

    @property
    def coefficient_of_variation_standard_error(self) -> float | None:
        """Standard error of the coefficient of variation by sampling, of a model's velocities."""
        return self._error("coefficient_of_variation")

    def _error(self, key: str) -> float | None:
        error: Mapping[str, float | None] = self._values.get("standard_error") or {}
        return error.get(key)


def known(number: float | None) -> float:
    """A number, NaN if it is not known."""
    return math.nan if number is None else float(number)
