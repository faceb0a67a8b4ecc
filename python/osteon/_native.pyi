"""The native module. Its functions take checked arguments; use those of :mod:`osteon`."""

import os
from collections.abc import Callable, Sequence
from typing import Literal, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Case",
    "CheckedJob",
    "Ensemble",
    "arrival",
    "traces",
    "velocities_of_cases",
    "velocities_of_tensors",
    "version",
]

_Floats = NDArray[np.float64]
_Path = str | os.PathLike[str]
_Format = Literal["toml", "json"]
_Kind = Literal["identification", "propagation"]

@final
class Case:
    """Layers, probe, picking, solver and bone: everything that a velocity depends on."""

    @staticmethod
    def read(path: _Path) -> Case: ...
    @staticmethod
    def parse(text: str, format: _Format) -> Case: ...
    def to_toml(self) -> str: ...
    @property
    def density(self) -> float: ...
    @property
    def tensor(self) -> _Floats: ...
    @property
    def receivers(self) -> _Floats: ...
    @property
    def warnings(self) -> list[str]: ...
    def with_bone(self, tensor: Sequence[Sequence[float]] | _Floats, density: float) -> Case: ...
    def __reduce__(self) -> tuple[Callable[[str, _Format], Case], tuple[str, _Format]]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

def arrival(
    case: Case,
) -> tuple[float, list[float] | None, _Floats, _Floats, float]: ...
def traces(case: Case, duration: float, time_step: float) -> tuple[_Floats, _Floats]: ...

@final
class Ensemble:
    """Random bones around a mean, each a function of seed and index."""

    def __new__(
        cls, mean: Sequence[Sequence[float]] | _Floats, dispersion: float, seed: int
    ) -> Ensemble: ...
    def draw(self, count: int, first: int, threads: int) -> _Floats: ...

@final
class CheckedJob:
    """A checked job of one kind."""

    @staticmethod
    def read(path: _Path, kind: _Kind) -> CheckedJob: ...
    @staticmethod
    def parse(text: str, format: _Format, directory: _Path, kind: _Kind) -> CheckedJob: ...
    def to_toml(self) -> str: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def realizations(self) -> int: ...
    @property
    def free(self) -> list[str]: ...
    def ensemble(self) -> Ensemble: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

def version() -> tuple[str, int]: ...
def velocities_of_tensors(
    tensors: _Floats,
    densities: _Floats,
    case: Case,
    threads: int,
    progress: Callable[[int], object] | None,
) -> tuple[_Floats, NDArray[np.uint8]]: ...
def velocities_of_cases(
    cases: Sequence[Case], threads: int, progress: Callable[[int], object] | None
) -> tuple[_Floats, NDArray[np.uint8]]: ...
