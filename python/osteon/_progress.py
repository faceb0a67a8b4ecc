"""Progress on a terminal and in a notebook."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any, Literal, Protocol, TypeVar, Union

Shown = TypeVar("Shown", contravariant=True)

CountProgress = Union[bool, Literal["auto"], Callable[[int, int], object]]
"""Whether to show how many of all are done: `auto` does on a terminal and in a notebook; or a function
that is called with both numbers."""

REDRAWN_S = 0.1


class Line(Protocol):
    """A line that is written again and again."""

    def write(self, text: str) -> None: ...
    def close(self) -> None: ...


class TerminalLine:
    """The last line of a terminal."""

    def __init__(self) -> None:
        self._width = 0

    def write(self, text: str) -> None:
        """Replaces the line."""
        sys.stderr.write("\r" + text.ljust(self._width))
        sys.stderr.flush()
        self._width = len(text)

    def close(self) -> None:
        """Removes the line."""
        sys.stderr.write("\r" + " " * self._width + "\r")
        sys.stderr.flush()


class NotebookLine:
    """A line of a notebook's output."""

    def __init__(self, display: Any) -> None:
        self._handle = display({"text/plain": ""}, raw=True, display_id=True)

    def write(self, text: str) -> None:
        """Replaces the line."""
        self._handle.update({"text/plain": text}, raw=True)

    def close(self) -> None:
        """Empties the line."""
        self.write("")


class NoLine:
    """Nothing is shown."""

    def write(self, text: str) -> None:
        """Does nothing."""

    def close(self) -> None:
        """Does nothing."""


def line(wanted: bool | Literal["auto"]) -> Line:
    """The line to show progress on: in a notebook, on a terminal, or none."""
    if wanted is False:
        return NoLine()
    # Not imported here: where there is no notebook, nothing has imported it.
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    if shell is not None and hasattr(shell, "kernel"):
        display = sys.modules["IPython"].display
        return NotebookLine(display.display)
    if wanted is True or sys.stderr.isatty():
        return TerminalLine()
    return NoLine()


class Counter:
    """Shows how many of a known number are done, at most ten times a second."""

    def __init__(self, total: int, progress: CountProgress) -> None:
        self._total = total
        self._call = progress if callable(progress) else None
        self._line: Line = NoLine() if callable(progress) else line(progress)
        self._begun = time.monotonic()
        self._drawn = self._begun

    @property
    def is_needed(self) -> bool:
        """Whether anybody sees it."""
        return self._call is not None or not isinstance(self._line, NoLine)

    def show(self, done: int) -> None:
        """Shows that this many are done."""
        if self._call is not None:
            self._call(done, self._total)
            return
        now = time.monotonic()
        if now - self._drawn < REDRAWN_S:
            return
        self._drawn = now
        rate = done / (now - self._begun)
        self._line.write(f"{done} of {self._total} ({rate:.0f}/s)")

    def close(self) -> None:
        """Removes the line."""
        self._line.close()
