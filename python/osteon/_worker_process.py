"""A worker of a coordinator as a child of this process, inside of another cluster's worker."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from osteon import _native, _program
from osteon._states import Credentials, options
from osteon.errors import CoordinatorError, ProgramError, refuse

DRAIN_S = 20.0
"""Longest time that a worker may take to answer what it holds; one leaves after 10 s by itself."""

POLL_S = 0.2
"""Time between two looks at workers that have not attached yet."""

LEASH = Path(__file__).with_name("_leash.py")


@dataclass(frozen=True)
class WorkerStatus:
    """What became of a worker.

    Attributes:
        place: where it runs: the address of the Dask worker, or the name of the Ray node's host.
        pid: its process there.
        version: version of the package osteon there.
        has_attached: whether it has been attached to the coordinator.
        exit_code: how its process ended; None while it runs.
        message: what it said last.
    """

    place: str
    pid: int
    version: str
    has_attached: bool
    exit_code: int | None
    message: str


@dataclass(frozen=True)
class WorkerPlan:
    """How to start workers; it is sent to where they run."""

    coordinator: str
    credentials: Credentials | None
    version: str

    @classmethod
    def here(cls, coordinator: str, credentials: Credentials | None) -> WorkerPlan:
        """The plan for workers of this version."""
        if not coordinator.startswith(("https://", "http://", "unix:")):
            allowed = "it must be https://HOST:PORT, http://HOST:PORT or unix:PATH"
            refuse("coordinator", f"is {coordinator!r}; {allowed}")
        return cls(coordinator, credentials, _native.version()[0])

    def command(self, threads: int) -> list[str]:
        """The arguments of the program."""
        found = ["worker", "--threads", str(threads), "--log-format", "json"]
        return found + options(self.coordinator, self.credentials)


class WorkerProcess:
    """A worker. It ends with this process, in order if it can: what it holds is answered, or computed by
    others."""

    def __init__(self, plan: WorkerPlan, threads: int, place: str | None = None) -> None:
        self._place = place or socket.gethostname()
        self._attached = False
        self._message = ""
        self._exit_code: int | None = None
        self._failed: Exception | None = None
        self._process: subprocess.Popen[str] | None = None
        self._started = threading.Event()
        found = _native.version()[0]
        if found != plan.version:
            raise ProgramError(differs(self._place, found, plan.version))
        command = [sys.executable, "-I", "-S", str(LEASH), str(os.getpid()), str(_program.find())]
        # A thread of its own, which lives as long as the worker: the leash is on the thread that starts it.
        self._thread = threading.Thread(
            target=self._follow, args=([*command, *plan.command(threads)],), daemon=True
        )
        self._thread.start()
        self._started.wait()
        if self._failed is not None:
            raise ProgramError(f"{self._place}: cannot run a worker: {self._failed}") from self._failed

    def _follow(self, command: Sequence[str]) -> None:
        """Starts the worker and reads its log until it has ended."""
        # The filter of this process's log would hide what is looked for.
        environment = {name: value for name, value in os.environ.items() if name != "RUST_LOG"}
        try:
            process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                env=environment,
                start_new_session=True,
                encoding="utf-8",
                errors="replace",
            )
        except Exception as error:
            # Whatever it is, the thread that waits must hear of it.
            self._failed = error
            self._started.set()
            return
        self._process = process
        self._started.set()
        assert process.stderr is not None
        with process:
            for line in process.stderr:
                self._take(line)
        self._exit_code = process.returncode

    def _take(self, line: str) -> None:
        """Remembers what a line of the log says."""
        try:
            event = json.loads(line)
            text = str(event["message"])
        except (ValueError, KeyError, TypeError):
            self._message = line.strip()
            return
        if text == "attached":
            self._attached = True
        self._message = str(event.get("reason") or event.get("error") or text)

    def status(self) -> WorkerStatus:
        """What became of it."""
        assert self._process is not None
        return WorkerStatus(
            self._place,
            self._process.pid,
            _native.version()[0],
            self._attached,
            self._exit_code,
            self._message,
        )

    def drain(self) -> None:
        """Has it answer what it holds and leave; kills it if it does not within 20 s."""
        assert self._process is not None
        for number, patience in ((signal.SIGTERM, DRAIN_S), (signal.SIGKILL, 5.0)):
            if not self._thread.is_alive():
                return
            self._process.send_signal(number)
            self._thread.join(patience)


def differs(place: str, found: str, expected: str) -> str:
    """The message about another version."""
    return (
        f"{place} has osteon {found}, and this process {expected}; workers, coordinator and clients "
        f"need the same: install osteon {expected} there"
    )


def await_attached(
    statuses: Callable[[], Iterable[WorkerStatus]], coordinator: str, patience: float
) -> None:
    """Waits until all workers have attached.

    Raises:
        CoordinatorError: one was refused, or the coordinator cannot be reached.
    """
    deadline = time.monotonic() + patience
    while True:
        found = list(statuses())
        for status in found:
            if status.exit_code is not None:
                text = f"a worker at {status.place} ended: {status.message or 'it said nothing'}"
                raise CoordinatorError(text, status.exit_code)
        waiting = [status for status in found if not status.has_attached]
        if found and not waiting:
            return
        if time.monotonic() > deadline:
            count = f"{len(waiting)} of {len(found)}" if found else "the"
            # The last ones are those that have no place to run.
            messages = [status.message for status in reversed(waiting) if status.message]
            said = f"; one said: {messages[0]}" if messages else ""
            raise CoordinatorError(
                f"{count} workers have not attached to the coordinator at {coordinator} within "
                f"{patience:g} s{said}. Is it running, and can the cluster reach this address?"
            )
        time.sleep(POLL_S)
