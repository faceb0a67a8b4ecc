"""Jobs: identifications and propagations."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from osteon import _native, _program
from osteon._data import DataLike, section
from osteon._inputs import plain
from osteon._progress import line
from osteon._results import Result
from osteon._scratch import Scratch
from osteon._simulate import Ensemble
from osteon._states import Credentials, JobProgress, JobState, environment, options
from osteon.errors import (
    CancelledError,
    CoordinatorError,
    InputError,
    JobFailedError,
    OsteonWarning,
    ProgramError,
    refuse,
)

if TYPE_CHECKING:
    from osteon import sections

Kind = Literal["identification", "propagation"]

CANCEL_S = 30.0
"""Longest time that the cancellation of a job may take."""


class Job:
    """A job: what to identify, from which velocities, and how.

    The keyword arguments are the sections of a job file, with its keys (:mod:`osteon.sections` has all of
    them with ranges and defaults); only `parameters` is always needed, and `data` for :meth:`identify`.

    Args:
        parameters: for each parameter `{"fixed": value}`, or `{"start": value, "bounds": [low, high]}`.
        data: measured velocities, m/s: an array, a frame of pandas or polars with a column `velocity`, or
            a dictionary like the section `[data]`, e.g. `{"velocities": frame, "group": "patient"}`.
        layers: thickness, density and speed of sound of the layers.
        probe: source, receivers, pulse.
        picking: criterion of the first arriving signal.
        solver: settings of the wave solver.
        bone: pores or sublayers of the bone: with a porosity, `parameters` are those of the bone between the
            pores.
        random: scatter of quantities of the setup.
        systematic: what is the same for all data and not known exactly.
        groups: whether the results of the groups of the data are pooled.
        monte_carlo: number of realizations, seed, sampling.
        objective: the function to be minimised.
        search: method and its settings.
        posterior: settings of the posterior, if one is wanted.

    Raises:
        InputError: a value is refused; `violations` has each field with what is allowed.

    >>> import osteon
    >>> job = osteon.Job.read("examples/fast.toml")
    >>> job.free[0], job.realizations
    ('density', 1024)
    """

    def __init__(
        self,
        *,
        parameters: sections.Parameters | Mapping[str, Any],
        data: DataLike | None = None,
        layers: sections.Layers | Mapping[str, Any] | None = None,
        probe: sections.Probe | Mapping[str, Any] | None = None,
        picking: sections.Picking | Mapping[str, Any] | None = None,
        solver: sections.Solver | Mapping[str, Any] | None = None,
        bone: sections.Bone | Mapping[str, Any] | None = None,
        random: sections.Random | Mapping[str, Any] | None = None,
        systematic: sections.Systematic | Mapping[str, Any] | None = None,
        groups: sections.Groups | Mapping[str, Any] | None = None,
        monte_carlo: sections.MonteCarlo | Mapping[str, Any] | None = None,
        objective: sections.Objective | Mapping[str, Any] | None = None,
        search: sections.Search | Mapping[str, Any] | None = None,
        posterior: sections.Posterior | Mapping[str, Any] | None = None,
    ) -> None:
        given = {
            "layers": layers,
            "probe": probe,
            "picking": picking,
            "solver": solver,
            "bone": bone,
            "parameters": parameters,
            "random": random,
            "systematic": systematic,
            "groups": groups,
            "monte_carlo": monte_carlo,
            "objective": objective,
            "search": search,
            "posterior": posterior,
        }
        table = {
            name: plain(values, name) for name, values in given.items() if values is not None
        }
        if data is not None:
            table["data"] = section(data)
        self._source: str | Path = json.dumps(table, allow_nan=False)
        self._checked: dict[Kind, _native.CheckedJob] = {}
        self._has_data = data is not None
        self._warn(self._check(self.kind))

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Job:
        """The job of a file in TOML or JSON, with the velocities in the file that it names.

        A job without data, or whose data are refused, can be propagated; :meth:`identify` then says why
        it cannot be identified.
        """
        job = cls.__new__(cls)
        job._source = Path(path)
        job._checked = {}
        propagation = job._check("propagation")
        try:
            job._warn(job._check("identification"))
            job._has_data = True
        except InputError:
            job._warn(propagation)
            job._has_data = False
        return job

    def __getstate__(self) -> dict[str, Any]:
        # Files that the job names need not be there where it is copied to: all of it goes along.
        for kind in ("identification", "propagation"):
            try:
                self._check(kind)
            except InputError:
                continue
        return dict(self.__dict__)

    def _warn(self, checked: _native.CheckedJob) -> None:
        for warning in checked.warnings:
            warnings.warn(warning, OsteonWarning, stacklevel=3)

    def _check(self, kind: Kind) -> _native.CheckedJob:
        """The job as one of this kind; checked once."""
        if kind not in self._checked:
            if isinstance(self._source, Path):
                self._checked[kind] = _native.CheckedJob.read(self._source, kind)
            else:
                parse = _native.CheckedJob.parse
                self._checked[kind] = parse(self._source, "json", "", kind)
        return self._checked[kind]

    @property
    def free(self) -> list[str]:
        """Names of the parameters that are searched."""
        return self._check("propagation").free

    @property
    def realizations(self) -> int:
        """Number of realizations of each evaluation."""
        return self._check("propagation").realizations

    def to_toml(self, kind: Kind | None = None) -> str:
        """The complete job file, with every default and all data, as :meth:`identify` (or, without
        data, :meth:`propagate`) runs it."""
        return self._check(kind or self.kind).to_toml()

    def to_message(self, kind: Kind | None = None) -> bytes:
        """The same as an encoded message `osteon.v1.JobSpecification`; :func:`osteon.rpc.specification`
        decodes it."""
        return self._check(kind or self.kind).to_message()

    @property
    def kind(self) -> Kind:
        """`identification` if it has data, otherwise `propagation`."""
        return "identification" if self._has_data else "propagation"

    def ensemble(self) -> Ensemble:
        """The random bones at the fixed values and starts, to the bit those of `osteon draw`; with a porosity
        they are those with pores.

        Raises:
            InputError: the bone changes through the thickness.

        >>> import osteon
        >>> osteon.Job.read("examples/fast.toml").ensemble().draw(4).shape
        (4, 6, 6)
        """
        return Ensemble(self._check("propagation").ensemble())

    def identify(
        self,
        *,
        coordinator: str | None = None,
        credentials: Credentials | None = None,
        out: str | os.PathLike[str] | None = None,
        workers: int | None = None,
        threads: int | None = None,
        name: str | None = None,
        progress: JobProgress = "auto",
    ) -> Result:
        """Searches the parameters that reproduce the measured velocities.

        Without `coordinator` the job runs on the cores of this machine. The result is the same to the
        bit wherever it runs. Ctrl-C cancels it; with `out` the same call resumes it.

        Args:
            coordinator: URL of a coordinator: `https://HOST:PORT`, `http://HOST:PORT` or `unix:PATH`.
            credentials: certificates and token for the coordinator.
            out: directory for the results. The same call with the same directory continues an
                interrupted job, and returns the result of one that has ended.
            workers: number of worker processes on this machine (2).
            threads: number of threads of each worker (cores / workers).
            name: name of the job in lists and logs.
            progress: `"auto"` shows it on a terminal and in a notebook, `True` always, `False` never; a
                function is called with each :class:`JobState`.

        Raises:
            InputError: the job, the directory or a credential is refused.
            JobFailedError: the job ended without a result.
            CoordinatorError: the coordinator cannot be reached, or refuses the job.
        """
        place = Place(coordinator, credentials, out, workers, threads, name)
        return self._run("identification", place, progress)

    def propagate(
        self,
        *,
        coordinator: str | None = None,
        credentials: Credentials | None = None,
        out: str | os.PathLike[str] | None = None,
        workers: int | None = None,
        threads: int | None = None,
        name: str | None = None,
        progress: JobProgress = "auto",
    ) -> Result:
        """Computes the velocities at the fixed values and starts, without a search; the arguments are
        those of :meth:`identify`.

        >>> import osteon
        >>> job = osteon.Job.read("examples/fast.toml")
        >>> 3500 < job.propagate(progress=False).velocity.mean < 4500
        True
        """
        place = Place(coordinator, credentials, out, workers, threads, name)
        return self._run("propagation", place, progress)

    def _run(self, kind: Kind, place: Place, progress: JobProgress) -> Result:
        text = self._check(kind).to_toml()
        scratch = Scratch()
        file = scratch.path / "job.toml"
        file.write_text(text, encoding="utf-8")
        out = scratch.path / "results" if place.out is None else Path(place.out)
        command = "identify" if kind == "identification" else "propagate"
        arguments = [command, str(file), "--json", "--progress", "json", "--out", str(out)]
        arguments += place.options()
        follower = Follower(progress)
        try:
            ended = _program.run(
                arguments,
                environment=environment(place.coordinator),
                on_progress=follower.take,
            )
        except KeyboardInterrupt:
            if place.coordinator is not None and place.out is None and follower.job is not None:
                cancel(follower.job, place)
            raise
        finally:
            follower.close()
        return finished(ended, out, scratch, place)

    def __repr__(self) -> str:
        free = ", ".join(self.free) or "none"
        return f"<Job: {self.kind} of {self.realizations} realizations; free: {free}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Job):
            return NotImplemented
        return self.kind == other.kind and self._check(self.kind) == other._check(self.kind)

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True)
class Place:
    """Where a job runs, and where its results go."""

    coordinator: str | None
    credentials: Credentials | None
    out: str | os.PathLike[str] | None
    workers: int | None
    threads: int | None
    name: str | None

    def options(self) -> list[str]:
        """The options of the program."""
        found = [] if self.name is None else ["--name", self.name]
        if self.coordinator is not None:
            if self.workers is not None or self.threads is not None:
                key = "threads" if self.workers is None else "workers"
                refuse(key, "is for jobs on this machine, not for a coordinator")
            return found + options(self.coordinator, self.credentials)
        if self.credentials is not None:
            refuse("credentials", "are for a coordinator; give its URL as coordinator")
        # Given always, so that the variable OSTEON_COORDINATOR does not send the job elsewhere.
        found += ["--workers", str(2 if self.workers is None else self.workers)]
        return found if self.threads is None else [*found, "--threads", str(self.threads)]


class Follower:
    """Shows the progress of a job, and remembers its id."""

    def __init__(self, progress: JobProgress) -> None:
        self.job: str | None = None
        self._call = progress if callable(progress) else None
        self._line = line(False if callable(progress) else progress)

    def take(self, snapshot: dict[str, Any]) -> None:
        """Shows a state of the job."""
        state = JobState.from_json(snapshot)
        self.job = state.job
        if self._call is not None:
            self._call(state)
        else:
            self._line.write(state.summary)

    def close(self) -> None:
        """Ends the line."""
        self._line.close()


def cancel(job: str, place: Place) -> None:
    """Cancels a job whose result nobody can fetch; what the coordinator answers changes nothing."""
    assert place.coordinator is not None
    command = [str(_program.find()), "job", "cancel", job, *options(place.coordinator, place.credentials)]
    # A second Ctrl-C must not leave the job running.
    before = signal.getsignal(signal.SIGINT) if is_main_thread() else None
    if before is not None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        subprocess.run(
            command,
            env=environment(place.coordinator),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=CANCEL_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        warnings.warn(f"job {job} may still run: cancel it with osteon.Client", OsteonWarning, 4)
    finally:
        if before is not None:
            signal.signal(signal.SIGINT, before)


def is_main_thread() -> bool:
    """Whether this thread may set handlers of signals."""
    import threading

    return threading.current_thread() is threading.main_thread()


def finished(
    ended: _program.Ended,
    out: Path,
    scratch: Scratch | None,
    place: Place,
) -> Result:
    """The result of a run, or the exception that says why there is none."""
    if not ended.output:
        error = JobFailedError if place.coordinator is None else CoordinatorError
        raise error(ended.complaint, ended.exit_code, "\n".join(ended.messages))
    try:
        result = Result(json.loads(ended.output), out, scratch)
    except ValueError as error:
        raise ProgramError(f"the output of the program is no result: {error}") from error
    if result.status == "cancelled":
        raise CancelledError(result.reason or "the job was cancelled")
    if ended.exit_code != 0:
        raise JobFailedError(result.reason or ended.complaint, ended.exit_code)
    return result
