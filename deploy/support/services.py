"""Runs coordinators and workers with the commands that a manifest or a unit gives them."""

import contextlib
import os
import pathlib
import signal
import subprocess
import time

# Longest wait for a state, s. Polled, so that a test takes as long as it must.
WAIT_S = 60
POLL_S = 0.05

# Under `nohup`, this process and its children ignore SIGHUP, but a test ends a service by it.
signal.signal(signal.SIGHUP, signal.SIG_DFL)


def wait_for(what, condition):
    """Polls until a condition holds, and returns its value; fails after WAIT_S."""
    end = time.monotonic() + WAIT_S
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(POLL_S)
    raise AssertionError(f"{what} did not happen within {WAIT_S} s")


class Service:
    """A process that is stopped with its block."""

    def __init__(self, command, directory, environment=None, user=None):
        self.log = pathlib.Path(directory) / f"log-{time.monotonic_ns()}"
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env={"PATH": os.environ["PATH"], **(environment or {})},
                **as_user(user),
            )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with contextlib.suppress(ProcessLookupError):
            self.process.kill()
        self.process.wait()

    def send(self, number):
        self.process.send_signal(number)

    def is_alive(self):
        return self.process.poll() is None

    def end(self, number=signal.SIGTERM, seconds=WAIT_S):
        """Sends a signal; the exit code, which must come in time."""
        self.send(number)
        try:
            return self.process.wait(timeout=seconds)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"still running {seconds} s after signal {number}: {self.text()}") from None

    def text(self):
        return self.log.read_text(errors="replace")

    def require(self):
        """Fails, with the log, if the process has ended."""
        if not self.is_alive():
            raise AssertionError(f"ended with {self.process.returncode}: {self.text()}")
        return self


def as_user(number):
    """Arguments of Popen for a process of another user, where this one may start it."""
    if number is None or os.geteuid() != 0:
        return {}
    return {"user": number, "group": number, "extra_groups": []}


def url_of(service, store):
    """The URL of a coordinator, once it has written it to its store."""
    address = pathlib.Path(store) / "address"

    def written():
        service.require()
        return address.is_file() and address.read_text().strip()

    return wait_for("the coordinator's start", written)

