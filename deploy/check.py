"""Checks everything in deploy/ that needs no cluster, no container engine and no running systemd: makes a
virtual environment, and runs each deploy/**/*_test.py. Uses the standard library only."""

import argparse
import os
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(ROOT / "tests" / "python"))
from environment import check_version, make, run  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--osteon", required=True, type=pathlib.Path, help="the program to deploy")
    parser.add_argument("--work", required=True, type=pathlib.Path, help="where to install to")
    parser.add_argument("--cargo-deb", required=True, type=pathlib.Path, help="the program cargo-deb")
    parser.add_argument("tests", nargs="*", help="names of tests files, as worker_test.py; all without any")
    arguments = parser.parse_args()
    check_version()
    if not os.access(arguments.osteon, os.X_OK):
        sys.exit(f"{arguments.osteon} is no program; `cargo build` makes it")
    python = make(arguments.work / "venv", HERE / "requirements.txt")
    variables = dict(
        os.environ,
        OSTEON=str(arguments.osteon.resolve()),
        CARGO_DEB=str(arguments.cargo_deb.resolve()),
        PYTHONPATH=os.pathsep.join([str(HERE / "support"), str(HERE / "kubernetes" / "osteon" / "tests")]),
        PYTHONDONTWRITEBYTECODE="1",
    )
    for name in [name for name in variables if name.startswith("OSTEON_") or name == "RUST_LOG"]:
        del variables[name]
    tests = sorted(HERE.glob("**/*_test.py"))
    if arguments.tests:
        tests = [test for test in tests if test.name in arguments.tests]
    if not tests:
        sys.exit(f"there are no such tests in {HERE}")
    names = [str(test.relative_to(ROOT)) for test in tests]
    run([python, "-m", "unittest", "-v", *names], ROOT, variables)


if __name__ == "__main__":
    main()
