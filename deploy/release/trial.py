"""Tries the files of a release as those who get them will: where nothing but a plain system is at hand."""

import platform
import shutil
import subprocess
import sys
import tarfile

import wheels
from archive import name_of
from environment import run
from source import commit, is_clean

PLAIN = {"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8"}
"""The environment of what is tried. Wheels were tried when they were built."""


def check(out, work, programs, python):
    """Tries all files in `out`."""
    for processor, program in programs.items():
        wheels.examine(program, program.read_bytes(), processor)
    scratch = work / "trial"
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir()
    try_archive(out / f"{name_of(platform.machine())}.tar.gz", scratch)
    [package] = out.glob("*.deb")
    run(["dpkg-deb", "--extract", package, scratch / "package"])
    says(scratch / "package" / "usr" / "bin" / "osteon")
    run([python, "-m", "twine", "check", "--strict", *sorted(out.glob("*.whl"))])


def try_archive(path, scratch):
    """Unpacks an archive, and lets its program examine the machine and identify what it brings along."""
    with tarfile.open(path) as archive:
        archive.extractall(scratch)
    folder = scratch / path.name.removesuffix(".tar.gz")
    program = folder / "bin" / "osteon"
    says(program)
    run([program, "doctor"], scratch, PLAIN)
    run([program, "check", folder / "examples" / "quick.toml"], scratch, PLAIN)
    wheels.demonstrate(program, scratch)


def says(program):
    """Fails unless the program starts, and says from which commit it was built; one of changed files says that."""
    text = subprocess.run([program, "--version"], env=PLAIN, check=True, stdout=subprocess.PIPE, text=True).stdout
    if is_clean() and f"(commit {commit()}," not in text:
        sys.exit(f"{program} is not of the commit {commit()}: {text}")
    print(f"{program}: {text}", end="")
