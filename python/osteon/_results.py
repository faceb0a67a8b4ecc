"""Results of jobs."""

from __future__ import annotations

import csv
import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from osteon._objects import known
from osteon._scratch import Scratch
from osteon.errors import InputError, UnreadableFileError
from osteon.results import GroupKeys, PartKeys, QuantityEstimate, QuantityPosterior, ResultKeys

if TYPE_CHECKING:
    import pandas
    import xarray

TABLES = ("history", "realizations", "groups", "comparison", "posterior")

COUNTS = frozenset({"evaluation", "index", "start", "draw", "failures", "velocities", "evaluations"})
"""Columns of whole numbers."""

TEXTS = frozenset({"group", "failure", "status", "reason", "first", "second"})
"""Columns of texts."""


@dataclass(frozen=True)
class Estimate:
    """A number that was identified, with its uncertainty.

    Attributes:
        value: its value.
        standard_error: its standard error; None where the data leave directions free.
        interval: its interval of 95 %; None likewise.
        is_determined: whether the data determine it.
    """

    value: float
    standard_error: float | None
    interval: tuple[float, float] | None

    @property
    def is_determined(self) -> bool:
        """Whether the data determine it."""
        return self.interval is not None


class Tables(NamedTuple):
    """The tables of a result as frames of pandas; None where the result has no such table."""

    history: pandas.DataFrame | None
    realizations: pandas.DataFrame | None
    groups: pandas.DataFrame | None
    comparison: pandas.DataFrame | None
    posterior: pandas.DataFrame | None


class Part(PartKeys):
    """What a job found from one set of data: the result, or one of its groups."""

    @property
    def status(self) -> str:
        """How the search ended: `converged`, `not_matched`, `max_evaluations`, `failed` …; that of a
        propagation is `done`."""
        return str(self._values.get("status", "done"))

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of the best point by name (SI units), without the dispersion. A single one means
        little where the data leave directions free: see :attr:`estimates`."""
        return dict(self._values.get("parameters") or {})

    @property
    def estimates(self) -> dict[str, Estimate]:
        """What the data say of √(c1111/ρ) (`bulk_velocity`, m/s), the dispersion, and each free
        parameter; from the posterior, if there is one."""
        found: dict[str, Estimate] = {}
        if (identified := self.identified) is not None:
            found["bulk_velocity"] = estimate(identified.bulk_velocity)
            found["dispersion"] = estimate(identified.dispersion)
            for name, entry in identified.parameters.items():
                unknown = Estimate(self.parameters.get(name, math.nan), None, None)
                found.setdefault(name, unknown if entry is None else estimate(entry))
        if (posterior := self.posterior) is not None:
            found["bulk_velocity"] = summary(posterior.bulk_velocity)
            found |= {name: summary(entry) for name, entry in posterior.parameters.items()}
        return found

    @property
    def free_directions(self) -> list[dict[str, float]]:
        """Directions in the space of the parameters that the data leave free: orthonormal, in units of
        the bounds."""
        return [] if self.identified is None else self.identified.free_directions

    def _repr_html_(self) -> str:
        from osteon._html import part

        return part(self)


class Group(Part, GroupKeys):
    """The result of one group."""


class Result(Part, ResultKeys):
    """The result of a job, with the keys of `result.json` as attributes.

    In a notebook it is a table. The directory of its files is removed with the object, unless `out` was
    given.
    """

    def __init__(
        self,
        values: Mapping[str, Any],
        directory: Path | None = None,
        scratch: Scratch | None = None,
    ) -> None:
        super().__init__(values)
        self._directory = directory
        self._scratch = scratch

    @classmethod
    def read(cls, directory: str | os.PathLike[str]) -> Result:
        """The result in a directory that a job was given with `out`, or `osteon … --out`."""
        path = Path(directory, "result.json")
        try:
            values = json.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise UnreadableFileError(f"cannot read {path}: {error}") from error
        except ValueError as error:
            raise InputError(f"{path} is no result: {error}") from error
        if not isinstance(values, dict) or "digest" not in values:
            raise InputError(f"{path} is no result of a job")
        return cls(values, Path(directory))

    @property
    def evaluations(self) -> int:
        """Number of evaluations of the search."""
        return int(self._values.get("evaluations", 1))

    @property
    def groups(self) -> dict[str, Group]:
        """Results of the groups by name; empty without groups."""
        return {entry["name"]: Group(entry) for entry in self._values.get("groups") or []}

    @property
    def directory(self) -> Path | None:
        """The directory of the result's files."""
        return self._directory

    @property
    def tables(self) -> list[str]:
        """Names of the tables that it has: of `history`, `realizations`, `groups`, `comparison` and
        `posterior`."""
        return [name for name in TABLES if self._path(name) is not None]

    def table(self, name: str) -> dict[str, NDArray[Any]]:
        """A table of the result by columns; docs/results.md explains them."""
        path = self._path(name)
        if name not in TABLES or path is None:
            has = ", ".join(self.tables) or "none"
            raise InputError(f"the result has no table {name!r}; it has: {has}")
        with path.open(encoding="utf-8", newline="") as file:
            rows = csv.reader(file)
            header = next(rows, [])
            columns: list[list[str]] = [[] for _ in header]
            for row in rows:
                for values, value in zip(columns, row):
                    values.append(value)
        return {key: converted(key, values) for key, values in zip(header, columns)}

    def _path(self, name: str) -> Path | None:
        if self._directory is None:
            return None
        path = self._directory / f"{name}.csv"
        return path if path.is_file() else None

    def to_pandas(self) -> Tables:
        """All tables as frames of pandas, to the bit."""
        import pandas

        def frame(name: str) -> pandas.DataFrame | None:
            return pandas.DataFrame(self.table(name)) if name in self.tables else None

        return Tables(*(frame(name) for name in TABLES))

    def to_arviz(self) -> xarray.DataTree:
        """The draws of the posterior as a tree for ArviZ (package `arviz-base`).

        Raises:
            InputError: the job had no posterior, or it has groups.
        """
        from arviz_base import from_dict

        if "posterior" not in self.tables:
            raise InputError("the result has no posterior; add a section `posterior` to the job")
        draws = self.table("posterior")
        if "group" in draws:
            raise InputError("the result has groups; take their draws from table('posterior')")
        names = [key for key in draws if key not in ("draw", "log_density")]
        groups: dict[str, dict[str, Any]] = {
            "posterior": {name: draws[name][np.newaxis] for name in names},
            "sample_stats": {"lp": draws["log_density"][np.newaxis]},
        }
        return from_dict(groups)

    def to_mat(self, path: str | os.PathLike[str]) -> None:
        """Writes the result as a file of MATLAB: the structure `result`, and one for each table."""
        from scipy.io import savemat

        found = {"result": for_matlab(self.json)}
        for name in self.tables:
            found[name] = {key: column_of(values) for key, values in self.table(name).items()}
        savemat(os.fspath(path), found, long_field_names=True, oned_as="column")

    def __repr__(self) -> str:
        return f"<Result: {self.kind}, {self.status}, digest {self.digest}>"


def estimate(found: QuantityEstimate) -> Estimate:
    """The estimate of a quantity, to first order around the best point."""
    return Estimate(known(found.value), found.standard_error, ends(found.interval))


def summary(found: QuantityPosterior) -> Estimate:
    """The estimate of a quantity by its posterior."""
    return Estimate(known(found.mean), found.standard_deviation, ends(found.interval_95))


def ends(interval: tuple[float | None, float | None] | None) -> tuple[float, float] | None:
    """Both ends of an interval, where they are known."""
    if interval is None or interval[0] is None or interval[1] is None:
        return None
    return interval[0], interval[1]


def converted(key: str, values: list[str]) -> NDArray[Any]:
    """A column of a table as an array; what is empty is NaN."""
    if key in TEXTS:
        return np.array(values, dtype=np.str_)
    if key in COUNTS and all(values):
        return np.array(values, dtype=np.int64)
    return np.array([float(value) if value else math.nan for value in values])


def for_matlab(value: Any) -> Any:
    """A value without null, which MATLAB does not know."""
    if value is None:
        return np.array([])
    if isinstance(value, Mapping):
        return {str(key)[:63]: for_matlab(entry) for key, entry in value.items()}
    if isinstance(value, list):
        plain = [for_matlab(entry) for entry in value]
        if all(isinstance(entry, (int, float)) for entry in plain):
            return np.array(plain, dtype=np.float64)
        cells = np.empty(len(plain), dtype=object)
        cells[:] = plain
        return cells
    return value


def column_of(values: NDArray[Any]) -> NDArray[Any]:
    """A column for MATLAB: texts are cells."""
    return values.astype(object) if values.dtype.kind == "U" else values
