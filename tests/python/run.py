"""Tests osteon from outside, as a Python client: makes a virtual environment with grpcio, makes
the client from the .proto files, and runs the tests. Uses the standard library only."""

import argparse
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
PROTOS = HERE.parent.parent / "proto"
REQUIREMENTS = HERE / "requirements.txt"
OLDEST = (3, 10)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--osteon", required=True, type=pathlib.Path, help="the program to test")
    parser.add_argument("--work", required=True, type=pathlib.Path, help="where to install to")
    parser.add_argument("tests", nargs="*", help="names of tests; all without any")
    arguments = parser.parse_args()
    if sys.version_info < OLDEST:
        sys.exit(f"Python {sys.version.split()[0]} is too old; {'.'.join(map(str, OLDEST))} is needed")
    if not os.access(arguments.osteon, os.X_OK):
        sys.exit(f"{arguments.osteon} is no program; `cargo build` makes it")
    python = environment(arguments.work / "venv")
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


def environment(venv):
    """A virtual environment with the requirements; made again when they change. Its Python."""
    python = venv / "bin" / "python"
    wanted = hashlib.sha256(REQUIREMENTS.read_bytes() + sys.version.encode()).hexdigest()
    stamp = venv / "complete"
    if stamp.is_file() and stamp.read_text() == wanted:
        return python
    try:
        import ensurepip  # noqa: F401
        import venv as _  # noqa: F401
    except ImportError as error:
        sys.exit(f"Python has no module {error.name}; on Debian: apt-get install python3-venv")
    shutil.rmtree(venv, ignore_errors=True)
    run([sys.executable, "-m", "venv", venv])
    run([python, "-m", "pip", "install", "--quiet", "--only-binary", ":all:", "-r", REQUIREMENTS])
    stamp.write_text(wanted)
    return python


def generate(python, directory):
    """Messages and stubs of the .proto files, into a directory for the path of Python."""
    shutil.rmtree(directory, ignore_errors=True)
    directory.mkdir(parents=True)
    protos = sorted((PROTOS / "osteon" / "v1").glob("*.proto"))
    options = [f"-I{PROTOS}", f"--python_out={directory}", f"--grpc_python_out={directory}"]
    run([python, "-m", "grpc_tools.protoc", *options, *protos])
    return directory


def run(command, directory=None, variables=None):
    """Runs a program to its end; its failure is ours."""
    code = subprocess.run(command, cwd=directory, env=variables, check=False).returncode
    if code != 0:
        sys.exit(f"failed: {' '.join(map(str, command))}")


if __name__ == "__main__":
    main()
