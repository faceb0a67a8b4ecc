"""A client of a coordinator."""

from __future__ import annotations

import json
import os
import queue
import threading
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any, Literal, NoReturn

from osteon import _program
from osteon._jobs import Job
from osteon._results import Result
from osteon._scratch import Scratch
from osteon._states import Credentials, JobState
from osteon.errors import CancelledError, CoordinatorError, InputError, JobFailedError, refuse


class Client:
    """A client of a coordinator: submits jobs, follows them, fetches their results.

    It speaks to the coordinator by the program `osteon` of the package: the same connections, retries and
    credentials as on the command line. Every method names the coordinator in its errors.

    Args:
        coordinator: URL, `https://HOST:PORT`, `http://HOST:PORT` or `unix:PATH`; by default the variable
            `OSTEON_COORDINATOR`.
        credentials: certificates and token; by default those of the variables `OSTEON_TLS_CA` etc., if the
            URL is from the environment, too.
    """

    def __init__(
        self, coordinator: str | None = None, *, credentials: Credentials | None = None
    ) -> None:
        if coordinator is None and not os.environ.get("OSTEON_COORDINATOR"):
            refuse("coordinator", "is missing: give its URL, or set OSTEON_COORDINATOR")
        self._options = [] if coordinator is None else ["--coordinator", coordinator]
        self._options += [] if credentials is None else credentials.options()
        self._coordinator = coordinator or os.environ["OSTEON_COORDINATOR"]

    def submit(
        self,
        job: Job,
        *,
        kind: Literal["identification", "propagation"] | None = None,
        name: str | None = None,
        priority: int = 0,
        request_id: str | None = None,
    ) -> str:
        """Submits a job and returns its id.

        Args:
            job: the job.
            kind: by default an identification if the job has data.
            name: its name in lists and logs.
            priority: among your own jobs, 0 to 9: jobs of higher priority run first.
            request_id: the same text for the same job makes no second job, however often it is submitted.
        """
        kind = kind or job.kind
        scratch = Scratch()
        try:
            file = scratch.path / "job.toml"
            file.write_text(job.to_toml(kind), encoding="utf-8")
            arguments = ["job", "submit", str(file), "--json", "--priority", str(priority)]
            arguments += ["--propagate"] if kind == "propagation" else []
            arguments += [] if name is None else ["--name", name]
            arguments += [] if request_id is None else ["--request-id", request_id]
            return str(self._json(arguments)["job"])
        finally:
            scratch.remove()

    def jobs(self) -> list[JobState]:
        """The jobs that the coordinator knows, oldest first."""
        return [JobState.from_json(entry) for entry in self._json(["job", "list", "--json"])]

    def state(self, job: str) -> JobState:
        """The present state of a job."""
        for state in self.watch(job):
            return state
        self._unknown(job)

    def watch(self, job: str) -> Iterator[JobState]:
        """The states of a job, at most one a second, until it has ended.

        An iterator that is closed leaves the job running.
        """
        states: queue.SimpleQueue[JobState | BaseException | None] = queue.SimpleQueue()
        closed = threading.Event()

        def take(line: str) -> None:
            if closed.is_set():
                # Ends the program: nobody reads what it prints.
                raise StopIteration
            states.put(JobState.from_json(json.loads(line)))

        def follow() -> None:
            try:
                self._run(["job", "watch", job, "--json"], take)
            except StopIteration:
                pass
            except BaseException as error:
                states.put(error)
            states.put(None)

        threading.Thread(target=follow, daemon=True).start()
        try:
            while True:
                try:
                    state = states.get(timeout=_program.POLL_S)
                except queue.Empty:
                    continue
                if state is None:
                    return
                if isinstance(state, BaseException):
                    raise state
                yield state
        finally:
            closed.set()

    async def watch_async(self, job: str) -> AsyncIterator[JobState]:
        """The same as :meth:`watch`, for `async for`."""
        # Imported here, because it would double the time of `import osteon`.
        import asyncio

        states = self.watch(job)
        loop = asyncio.get_running_loop()
        try:
            while True:
                state = await loop.run_in_executor(None, next, states, None)
                if state is None:
                    return
                yield state
        finally:
            await loop.run_in_executor(None, close, states)

    def wait(self, job: str) -> JobState:
        """Waits for the end of a job and returns its last state."""
        last = None
        for state in self.watch(job):
            last = state
        if last is None:
            self._unknown(job)
        return last

    def cancel(self, job: str) -> None:
        """Cancels a job; one that has ended stays as it is."""
        self._run(["job", "cancel", job])

    def fetch(self, job: str, *, out: str | os.PathLike[str] | None = None) -> Result:
        """The result of a job that has ended.

        Args:
            job: its id.
            out: directory for the files of the result.

        Raises:
            JobFailedError: the job failed.
            CancelledError: it was cancelled.
            CoordinatorError: it has not ended.
        """
        scratch = None
        if out is None:
            scratch = Scratch()
            out = scratch.path / "results"
        self._run(["job", "fetch", job, "--out", os.fspath(out)])
        found = Result.read(out)
        result = Result(found.json, Path(out), scratch)
        if result.status == "cancelled":
            raise CancelledError(f"job {job} was cancelled")
        if result.status == "failed":
            raise JobFailedError(result.reason or f"job {job} failed", 1)
        return result

    def _unknown(self, job: str) -> NoReturn:
        raise InputError(f"the coordinator at {self._coordinator} says nothing of the job {job}")

    def _json(self, arguments: list[str]) -> Any:
        return json.loads(self._run(arguments))

    def _run(self, arguments: list[str], on_output: Any = None) -> str:
        """Runs a command and returns its output."""
        ended = _program.run([*arguments, *self._options], on_output=on_output)
        # A job that is watched and has failed is the answer, and no failure of the request.
        if ended.exit_code != 0 and arguments[:2] != ["job", "watch"]:
            messages = "\n".join(ended.messages)
            raise CoordinatorError(ended.complaint, ended.exit_code, messages)
        if ended.exit_code != 0 and ended.messages:
            raise CoordinatorError(ended.complaint, ended.exit_code, "\n".join(ended.messages))
        return ended.output

    def __repr__(self) -> str:
        return f"<Client of {self._coordinator}>"


def close(states: Iterator[JobState]) -> None:
    """Closes an iterator."""
    states.close()  # type: ignore[attr-defined]
