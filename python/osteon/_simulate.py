"""The solver and the random bones as functions."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osteon import _native
from osteon._inputs import CaseLike, case_of
from osteon._progress import Counter, CountProgress
from osteon.errors import KINDS, refuse

if TYPE_CHECKING:
    import xarray

Floats = NDArray[np.float64]


class Simulation:
    """The solution of one case.

    The pressures are computed when they are first asked for; they do not change the velocity.
    """

    def __init__(self, case: _native.Case, duration: float, time_step: float) -> None:
        found = _native.arrival(case)
        self._case = case
        self._velocity, self._directions, self._arrival_times, self._amplitudes = found[:4]
        self._estimated_error = found[4]
        self._span = (duration, time_step)
        self._traces: tuple[Floats, Floats] | None = None

    @property
    def case(self) -> _native.Case:
        """The case that was solved."""
        return self._case

    @property
    def velocity(self) -> float:
        """Velocity of the first arriving signal, m/s; of a bidirectional probe the harmonic mean of
        both directions."""
        return self._velocity

    @property
    def directions(self) -> tuple[float, float] | None:
        """Velocities from the first source and from the second, m/s, of a bidirectional probe."""
        return None if self._directions is None else (self._directions[0], self._directions[1])

    @property
    def estimated_error(self) -> float:
        """Estimate of the velocity's relative error by discretisation."""
        return self._estimated_error

    @property
    def receivers(self) -> Floats:
        """Positions x1 of the receivers along the bone, m."""
        return self._case.receivers

    @property
    def arrival_times(self) -> Floats:
        """Time of the picked extremum at each receiver, s."""
        return self._arrival_times

    @property
    def amplitudes(self) -> Floats:
        """Modulus of the pressure of the picked extremum at each receiver; only ratios mean something."""
        return self._amplitudes

    @property
    def times(self) -> Floats:
        """Times of the pressures, s."""
        return self._pressures()[0]

    @property
    def pressures(self) -> Floats:
        """Pressures at the receivers, Pa, as an array (receiver, time); the direct wave is included."""
        return self._pressures()[1]

    def _pressures(self) -> tuple[Floats, Floats]:
        if self._traces is None:
            self._traces = _native.traces(self._case, *self._span)
        return self._traces

    def to_xarray(self) -> xarray.Dataset:
        """Pressures and picked times as an :class:`xarray.Dataset`, with coordinates and units."""
        import xarray

        units = {"receiver": "m", "time": "s"}
        found = xarray.Dataset(
            {
                "pressure": (("receiver", "time"), self.pressures, {"units": "Pa"}),
                "arrival_time": (("receiver",), self.arrival_times, {"units": "s"}),
            },
            coords={"receiver": self.receivers, "time": self.times},
            attrs={"velocity": self.velocity, "velocity_units": "m/s"},
        )
        for name, unit in units.items():
            found[name].attrs["units"] = unit
        return found

    def __repr__(self) -> str:
        return f"<Simulation: {self.velocity:.2f} m/s at {len(self.receivers)} receivers>"


def simulate(
    case: CaseLike, *, duration: float = 16e-6, time_step: float = 1e-8
) -> Simulation:
    """Solves one case: the velocity of the first arriving signal, and the pressures at the receivers.

    Args:
        case: path of a case file, a dictionary with the same keys, or a :class:`Case`.
        duration: duration of the pressures, s.
        time_step: time between two pressures, s.

    Raises:
        InputError: the case is not valid; the error names every field.
        SimulationError: the case has no velocity; the class of the error is the kind of failure.

    >>> import osteon
    >>> found = osteon.simulate("examples/cases/A.toml")
    >>> round(found.velocity, 1)
    3908.8
    >>> found.pressures.shape
    (14, 1601)
    """
    return Simulation(case_of(case), duration, time_step)


@overload
def velocities(
    cases: Iterable[CaseLike] | ArrayLike,
    *,
    density: ArrayLike | None = None,
    setup: CaseLike | None = None,
    threads: int | None = None,
    progress: CountProgress = False,
    return_failures: Literal[False] = False,
) -> Floats: ...


@overload
def velocities(
    cases: Iterable[CaseLike] | ArrayLike,
    *,
    density: ArrayLike | None = None,
    setup: CaseLike | None = None,
    threads: int | None = None,
    progress: CountProgress = False,
    return_failures: Literal[True],
) -> tuple[Floats, NDArray[np.str_]]: ...


def velocities(
    cases: Iterable[CaseLike] | ArrayLike,
    *,
    density: ArrayLike | None = None,
    setup: CaseLike | None = None,
    threads: int | None = None,
    progress: CountProgress = False,
    return_failures: bool = False,
) -> Floats | tuple[Floats, NDArray[np.str_]]:
    """Velocities of many cases, on all cores; NaN where a case has none.

    The interpreter is free meanwhile: other threads of Python run, and Ctrl-C ends the computation.

    Args:
        cases: cases, as :func:`simulate` takes them, or an array (n, 6, 6) of elasticity tensors (Pa,
            Kelvin-Mandel, order 11 22 33 23 31 12).
        density: with tensors: density of the bone, kg/m³, one number or one for each tensor; by
            default that of `setup`.
        setup: with tensors: a case with layers, probe, picking and solver, of which only the bone is
            replaced; by default the paper's, and then `density` is needed.
        threads: number of threads; by default that of the cores.
        progress: `True` or `"auto"` shows it, a function is called with the number done and that of all.
        return_failures: whether to return the kind of failure of each case, too: an empty text where
            there is a velocity.

    >>> import osteon
    >>> tensors = osteon.ensemble("examples/cases/A.toml", dispersion=0.1, seed=1).draw(3)
    >>> osteon.velocities(tensors, density=1598.8).shape
    (3,)
    """
    workers = threads_of(threads)
    if is_tensors(cases):
        tensors = numbers(cases, "tensors")
        if tensors.ndim == 2:
            tensors = tensors[np.newaxis]
        if tensors.ndim != 3:
            refuse("tensors", f"has {tensors.ndim} axes; it must have the shape (n, 6, 6)")
        base, densities = setup_of(setup, density)
        total = len(tensors)
        counter = Counter(total, progress)
        try:
            show = counter.show if counter.is_needed else None
            found, codes = _native.velocities_of_tensors(tensors, densities, base, workers, show)
        finally:
            counter.close()
    else:
        if density is not None or setup is not None:
            refuse("density" if setup is None else "setup", "is for tensors; cases have their own")
        checked = [case_of(case) for case in cast("Iterable[CaseLike]", cases)]
        counter = Counter(len(checked), progress)
        try:
            show = counter.show if counter.is_needed else None
            found, codes = _native.velocities_of_cases(checked, workers, show)
        finally:
            counter.close()
    if not return_failures:
        return found
    return found, np.array(["", *KINDS])[codes]


def is_tensors(cases: Any) -> bool:
    """Whether these are tensors, and not cases."""
    if isinstance(cases, np.ndarray):
        return True
    if isinstance(cases, (str, os.PathLike, Mapping, _native.Case)):
        refuse("cases", "is one case; give a list of cases, or use osteon.simulate")
    if isinstance(cases, Sequence) and len(cases) > 0:
        return isinstance(cases[0], (np.ndarray, list, tuple))
    return not isinstance(cases, Iterable)


def numbers(values: Any, field: str) -> Floats:
    """Values as a contiguous array of doubles."""
    try:
        return np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        refuse(field, f"are no numbers: {error}")


PLAIN_BONE = {
    "density": 1.0,
    "mandel": np.diag([3.0, 3.0, 3.0, 1.0, 1.0, 1.0]).tolist(),
}
"""A bone for a setup whose bone is not used."""


def setup_of(setup: CaseLike | None, density: ArrayLike | None) -> tuple[_native.Case, Floats]:
    """The case that tensors are put into, and the densities of their bones."""
    if setup is None:
        if density is None:
            refuse("density", "is missing (kg/m³): with tensors it is needed, unless a setup is given")
        setup = {"bone": PLAIN_BONE}
    base = case_of(setup)
    densities = numbers(base.density if density is None else density, "density")
    if densities.ndim > 1:
        refuse("density", f"has {densities.ndim} axes; it must be a number, or one for each tensor")
    return base, np.atleast_1d(densities)


def threads_of(threads: int | None) -> int:
    """The number of threads asked for, or that of the cores which this process may use."""
    if threads is None:
        try:
            return len(os.sched_getaffinity(0))
        except AttributeError:
            return os.cpu_count() or 1
    if not 1 <= threads <= 4096:
        refuse("threads", f"is {threads}; it must be 1 to 4096")
    return threads


class Ensemble:
    """Random bones around a mean; each is a function of seed and index, the same on every machine."""

    def __init__(self, native: _native.Ensemble) -> None:
        self._native = native

    def draw(self, n: int, *, first: int = 0, threads: int | None = None) -> Floats:
        """Elasticity tensors of the realizations from `first` on, Pa, as an array (n, 6, 6).

        The tensor at an index does not depend on `n` or `first`.

        >>> import numpy, osteon
        >>> bones = osteon.ensemble("examples/cases/A.toml", dispersion=0.1, seed=1)
        >>> numpy.array_equal(bones.draw(5)[3:], bones.draw(2, first=3))
        True
        """
        if n < 0 or first < 0:
            refuse("n" if n < 0 else "first", "is negative; it must be 0 or more")
        return self._native.draw(n, first, threads_of(threads))


def ensemble(mean: CaseLike | ArrayLike, dispersion: float, seed: int) -> Ensemble:
    """The random bones of a job with this mean, dispersion and seed (`sampling = "monte_carlo"`).

    Args:
        mean: the mean model: a case, of which the bone is taken, or an elasticity tensor (6, 6) in Pa.
        dispersion: δ, above 0 and below √(7/11) = 0.797…
        seed: seed of the random numbers, 0 to 2⁶³ - 1.

    >>> import osteon
    >>> osteon.ensemble("examples/cases/A.toml", dispersion=0.1029, seed=20081).draw(2).shape
    (2, 6, 6)
    """
    if isinstance(mean, (str, os.PathLike, Mapping, _native.Case)):
        tensor = case_of(mean).tensor
    else:
        tensor = numbers(mean, "mean")
    if tensor.shape != (6, 6):
        refuse("mean", f"has the shape {tensor.shape}; it must be (6, 6)")
    if isinstance(seed, bool) or not 0 <= int(seed) < 2**63:
        refuse("seed", f"is {seed}; it must be 0 to {2**63 - 1}")
    return Ensemble(_native.Ensemble(tensor, float(dispersion), int(seed)))
