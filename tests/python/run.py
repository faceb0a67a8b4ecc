"""Tests osteon from outside, as a Python client: makes a virtual environment with grpcio, makes
the client from the .proto files, and runs the tests. Uses the standard library only."""

import argparse
import os
import pathlib
import shutil
import sys

from environment import check_version, make, run

HERE = pathlib.Path(__file__).resolve().parent
PROTOS = HERE.parent.parent / "proto"
REQUIREMENTS = HERE / "requirements.txt"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--osteon", required=True, type=pathlib.Path, help="the program to test")
    parser.add_argument("--work", required=True, type=pathlib.Path, help="where to install to")
    parser.add_argument("tests", nargs="*", help="names of tests; all without any")
    arguments = parser.parse_args()
    check_version()
    if not os.access(arguments.osteon, os.X_OK):
        sys.exit(f"{arguments.osteon} is no program; `cargo build` makes it")
    python = make(arguments.work / "venv", REQUIREMENTS)
    generated = generate(python, arguments.work / "generated")
    variables = dict(
        os.environ,
        OSTEON=str(arguments.osteon.resolve()),
        PYTHONPATH=str(generated),
        PYTHONDONTWRITEBYTECODE="1",
        # The tests stay on this machine.
        no_grpc_proxy="127.0.0.1,localhost",
    )
    variables.pop("OSTEON_COORDINATOR", None)
    tests = arguments.tests or [path.stem for path in sorted(HERE.glob("test_*.py"))]
    if not tests:
        sys.exit(f"there are no tests in {HERE}")
    run([python, "-m", "unittest", "-v", *tests], HERE, variables)


def generate(python, directory):
    """Messages and stubs of the .proto files, into a directory for the path of Python."""
    shutil.rmtree(directory, ignore_errors=True)
    directory.mkdir(parents=True)
    protos = sorted((PROTOS / "osteon" / "v1").glob("*.proto"))
    options = [f"-I{PROTOS}", f"--python_out={directory}", f"--grpc_python_out={directory}"]
    run([python, "-m", "grpc_tools.protoc", *options, *protos])
    return directory


if __name__ == "__main__":
    main()
