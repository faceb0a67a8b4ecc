"""Velocities from a probe's signals."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import NDArray

from osteon import _program
from osteon._inputs import document
from osteon._scratch import Scratch
from osteon.errors import InputError, refuse

if TYPE_CHECKING:
    import pandas

Floats = NDArray[np.float64]
ProbeLike = Union[str, "os.PathLike[str]", Mapping[str, Any]]
"""A probe: the path of a probe file, or a dictionary with the same keys."""

RUN_FAILED = 1
"""The code with which the program ends if no series has a velocity."""


class Picks:
    """What :func:`pick` found in each series."""

    def __init__(self, series: Sequence[Mapping[str, Any]], table: str) -> None:
        self._series = series
        self._table = table

    def __len__(self) -> int:
        return len(self._series)

    @property
    def velocities(self) -> Floats:
        """Velocity of each series, m/s; NaN where there is none."""
        return self._numbers("velocity")

    @property
    def standard_errors(self) -> Floats:
        """Standard error of each velocity, m/s; NaN where there is none."""
        return self._numbers("standard_error")

    @property
    def qualities(self) -> Floats:
        """Quality of each series, 0 to 1."""
        return self._numbers("quality")

    @property
    def failures(self) -> NDArray[np.str_]:
        """Kind of the failure of each series; an empty text where there is a velocity."""
        return np.array([one["failure"] or "" for one in self._series], dtype=np.str_)

    @property
    def other_velocities(self) -> Floats:
        """Velocity of the extremum that is not picked, m/s; NaN where there is none."""
        return self._measured("other_velocity", "value")

    @property
    def decays(self) -> Floats:
        """Decay of the picked extremum along the array, dB/cm; NaN where there is none."""
        return self._measured("decay", "value")

    @property
    def center_frequencies(self) -> Floats:
        """Frequency of the first signal, Hz; NaN where there is none."""
        return self._measured("center_frequency", "value")

    @property
    def times(self) -> Floats:
        """Times of the picked extremum, s, as an array (series, receiver), from the first source; NaN where a
        receiver has none, and beyond the receivers of a series that has fewer than others."""
        most = max((len(one["receivers"]) for one in self._series), default=0)
        times = np.full((len(self), most), np.nan)
        for row, one in zip(times, self._series):
            found = [receiver["time"] for receiver in one["receivers"]]
            row[: len(found)] = np.array(found, dtype=np.float64)
        return times

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes the velocities as data of a job (``error_column = "standard_error"``, ``missing = [""]``), with
        the criterion by which they were picked.

        Raises:
            FileExistsError: the file exists.
        """
        with open(path, "x", encoding="utf-8") as file:
            file.write(self._table)

    def to_pandas(self) -> pandas.DataFrame:
        """A row for each series: velocity and standard error (m/s), quality, failure, and other velocity (m/s),
        decay (dB/cm) and centre frequency (Hz) with their standard errors."""
        import pandas

        columns = {
            "velocity": self.velocities,
            "standard_error": self.standard_errors,
            "quality": self.qualities,
            "failure": self.failures,
            "other_velocity": self.other_velocities,
            "other_standard_error": self._measured("other_velocity", "standard_error"),
            "decay": self.decays,
            "decay_standard_error": self._measured("decay", "standard_error"),
            "center_frequency": self.center_frequencies,
            "center_frequency_standard_error": self._measured("center_frequency", "standard_error"),
        }
        return pandas.DataFrame(columns)

    def _numbers(self, key: str) -> Floats:
        return np.array([one[key] for one in self._series], dtype=np.float64)

    def _measured(self, key: str, part: str) -> Floats:
        found = [None if one[key] is None else one[key][part] for one in self._series]
        return np.array(found, dtype=np.float64)

    def __repr__(self) -> str:
        found = int(np.isfinite(self.velocities).sum())
        return f"<Picks: {found} velocities of {len(self)} series>"


def pick(
    signals: str | os.PathLike[str] | NDArray[Any], probe: ProbeLike | None = None
) -> Picks:
    """Finds the velocity of the first arriving signal in what a probe recorded, as ``osteon pick`` does.

    Args:
        signals: an array of real numbers, or the path of a file. The axes of an array are (time, receiver),
            (series, receiver, time) or (series, transmitter, receiver, time), or as ``axes`` says.
        probe: path of a probe file, or a dictionary with the sections of one: ``probe``, ``layers`` and
            ``picking`` as in a case, and ``signals``. An array needs it, with its ``sampling_interval``.

    Raises:
        InputError: the signals or the probe are not valid; the error names every field.

    >>> import osteon
    >>> found = osteon.simulate("examples/cases/A.toml")
    >>> probe = {"signals": {"axes": ["receiver", "time"], "sampling_interval": 1e-8}}
    >>> osteon.pick(found.pressures, probe)
    <Picks: 1 velocities of 1 series>
    """
    scratch = Scratch()
    path = file_of(signals, scratch.path)
    table = scratch.path / "velocities.csv"
    words: list[str | os.PathLike[str]] = ["pick", path, "--json", "--out", table]
    if probe is not None:
        words += ["--describe", probe_file_of(probe, scratch.path)]
    ended = _program.run(words)
    if ended.exit_code not in (0, RUN_FAILED) or not ended.output:
        raise InputError(ended.complaint)
    return Picks(json.loads(ended.output)["series"], table.read_text(encoding="utf-8"))


def file_of(signals: str | os.PathLike[str] | NDArray[Any], directory: Path) -> Path:
    """The file of signals; an array is written to one."""
    if isinstance(signals, (str, os.PathLike)):
        return Path(signals)
    array = np.asarray(signals)
    if array.dtype.kind not in "fiu":
        refuse("signals", f"is an array of {array.dtype}; it must have real numbers")
    path = directory / "signals.npy"
    np.save(path, np.ascontiguousarray(array), allow_pickle=False)
    return path


def probe_file_of(probe: ProbeLike, directory: Path) -> Path:
    """The probe file; a dictionary is written to one."""
    if isinstance(probe, (str, os.PathLike)):
        return Path(probe)
    # Callers without a type checker may pass anything.
    given: object = probe
    if not isinstance(given, Mapping):
        refuse("probe", f"is a {type(given).__name__}; give a path or a dictionary")
    path = directory / "probe.json"
    path.write_text(document(given), encoding="utf-8")
    return path
