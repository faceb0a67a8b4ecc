"""Runs the program ``osteon`` that is in the same wheel.

Jobs run in a process of their own. It has everything that a job needs: the coordinator, the durable
store, workers which are processes, the one client with its retries. A crash of it is an exception here,
Ctrl-C reaches it and not the threads of Python, and its results are those of the command line.
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import queue
import signal
import subprocess
import sysconfig
import threading
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from osteon import _native
from osteon.errors import InputError, OsteonWarning, ProgramError

INTERRUPT_S = 15.0
"""Longest time that an interrupted program may take to end in order."""

VERSION_S = 30.0
"""Longest time that the program may take to say its version."""

POLL_S = 0.1
"""Time between two looks at signals."""

MESSAGES_MAX = 1000
"""Messages of a program that are kept."""

WARNING = "warning: "


@dataclass(frozen=True)
class Ended:
    """A program that ran to its end."""

    exit_code: int
    output: str
    messages: tuple[str, ...]

    @property
    def complaint(self) -> str:
        """What it said last, without the warnings."""
        told = [line for line in self.messages if not line.startswith(WARNING)]
        text = "\n".join(told).strip()
        for prefix in ("osteon: ", "error: "):
            text = text.removeprefix(prefix)
        return text or f"the program ended with code {self.exit_code} and said nothing"


def find() -> Path:
    """The program: of this package, or of the directory for scripts.

    Raises:
        ProgramError: it is not there, or has another version than the native module.
    """
    # Imported here, because it takes a quarter of the time of `import osteon`.
    import importlib.metadata

    candidates = []
    with contextlib.suppress(importlib.metadata.PackageNotFoundError):
        for file in importlib.metadata.files("osteon") or ():
            if file.name == "osteon" and file.parent.name in {"bin", "scripts"}:
                candidates.append(Path(str(file.locate())))
    schemes = [sysconfig.get_default_scheme(), sysconfig.get_preferred_scheme("user")]
    candidates += [Path(sysconfig.get_path("scripts", scheme)) / "osteon" for scheme in schemes]
    for candidate in candidates:
        if os.access(candidate, os.X_OK):
            check_version(candidate)
            return candidate
    places = ", ".join(str(candidate) for candidate in candidates)
    raise ProgramError(f"the program osteon is not there ({places}); install the package again")


@functools.lru_cache(maxsize=8)
def check_version(program: Path) -> None:
    """Checks, once for each program, that it computes what the native module does.

    Raises:
        ProgramError: it has another version or another revision of the numerics.
    """
    try:
        said = subprocess.run(
            [program, "--version"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=VERSION_S,
            check=False,
            encoding="utf-8",
            errors="replace",
        ).stdout
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ProgramError(f"cannot run {program}: {error}; install the package again") from error
    version, numerics = _native.version()
    if not said.startswith(f"osteon {version} ") or f"numerics {numerics}," not in said:
        raise ProgramError(
            f"the program {program} has another version ({said.strip() or 'it says none'}) than the package "
            f"({version}, numerics {numerics}), and may give other numbers; install the package again"
        )


def run(
    arguments: Sequence[str | os.PathLike[str]],
    *,
    environment: Mapping[str, str] | None = None,
    on_progress: Callable[[dict[str, Any]], None] | None = None,
    on_output: Callable[[str], None] | None = None,
) -> Ended:
    """Runs the program to its end. What it warns of is a :class:`OsteonWarning`.

    Args:
        arguments: its arguments.
        environment: its environment, instead of that of this process.
        on_progress: called with each object of the progress.
        on_output: called with each line of the output, which is then not kept.

    Raises:
        InputError: it refuses its input.
        ProgramError: it cannot be run.
        KeyboardInterrupt: it was interrupted, and has ended.
    """
    command = [os.fspath(find()), *(os.fspath(argument) for argument in arguments)]
    lines: queue.SimpleQueue[tuple[str, str | None]] = queue.SimpleQueue()
    try:
        # In a session of its own, so that Ctrl-C does not reach it twice.
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=None if environment is None else dict(environment),
            start_new_session=True,
            encoding="utf-8",
            errors="replace",
        )
    except OSError as error:
        raise ProgramError(f"cannot run {command[0]}: {error}") from error
    output: list[str] = []
    messages: list[str] = []
    with process:
        for name, stream in (("output", process.stdout), ("message", process.stderr)):
            assert stream is not None
            threading.Thread(target=forward, args=(name, stream, lines), daemon=True).start()
        try:
            open_streams = 2
            while open_streams > 0:
                # Without a time limit, the lock of the queue would hold back Ctrl-C on some systems.
                try:
                    name, line = lines.get(timeout=POLL_S)
                except queue.Empty:
                    continue
                if line is None:
                    open_streams -= 1
                elif name == "output":
                    (on_output or output.append)(line)
                else:
                    take_message(line, messages, on_progress)
            process.wait()
        except BaseException:
            end(process)
            raise
    ended = Ended(process.returncode, "".join(output), tuple(messages))
    if ended.exit_code == 2:
        raise InputError(ended.complaint)
    if ended.exit_code in (130, 143):
        raise KeyboardInterrupt(ended.complaint)
    if ended.exit_code < 0:
        name = signal.Signals(-ended.exit_code).name
        raise ProgramError(f"the program was ended by {name}", ended.exit_code, "\n".join(messages))
    return ended


def forward(
    name: str, stream: IO[str], lines: queue.SimpleQueue[tuple[str, str | None]]
) -> None:
    """Passes the lines of a stream on, and None at its end."""
    try:
        for line in stream:
            lines.put((name, line))
    except ValueError:
        # The stream was closed because the program is interrupted.
        pass
    finally:
        lines.put((name, None))


def take_message(
    line: str, messages: list[str], on_progress: Callable[[dict[str, Any]], None] | None
) -> None:
    """Reports progress, warns, or keeps a message."""
    if line.startswith('{"progress":'):
        if on_progress is not None:
            on_progress(json.loads(line)["progress"])
        return
    text = line.rstrip("\n")
    if text.startswith(WARNING):
        warnings.warn(text.removeprefix(WARNING), OsteonWarning, stacklevel=6)
    if len(messages) < MESSAGES_MAX:
        messages.append(text)


def end(process: subprocess.Popen[str]) -> None:
    """Interrupts a program, and kills it if it does not end."""
    with contextlib.suppress(ProcessLookupError):
        process.send_signal(signal.SIGINT)
    try:
        process.wait(INTERRUPT_S)
    except BaseException:
        process.kill()
        raise
