"""What the machine has, and the program: for tests that need more than Python."""

import functools
import os
import pathlib
import shutil
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
OSTEON = os.environ["OSTEON"]
# The user of the image: numbers, because the image has no names.
CONTAINER_USER = 65532


def need(*programs):
    """Skips the test if a program is missing; in CI, where .ci/run installs them, that is a failure."""
    missing = [program for program in programs if shutil.which(program) is None]
    if missing and os.environ.get("CI") == "true":
        raise AssertionError(f"CI must have {', '.join(missing)}: see .ci/run")
    if missing:
        raise unittest.SkipTest(f"this machine has no {', '.join(missing)}")


def output(*command, **options):
    """What a program prints; it must succeed."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, **options)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))} ended with {done.returncode}: {done.stderr}")
    return done.stdout


@functools.cache
def options_of(*command):
    """The options that a command of the program knows; it may have several words."""
    words = output(OSTEON, *command, "--help").split()
    return {word.strip("[],.()") for word in words if word.startswith("--")}


def commands_of_page(path):
    """The commands in the `console` blocks of a page, with continued lines joined."""
    blocks = path.read_text().split("```console\n")[1:]
    lines = "\n".join(block.split("```")[0] for block in blocks).replace("\\\n", " ").splitlines()
    return [line for line in lines if line and not line.startswith("#")]
