"""Makes the messages and stubs of `osteon.v1` that the package ships, from the .proto files of its API for
clients; with --check, fails if those in the repository are not what it makes. `cargo xtask generate stubs` and
`cargo xtask test python` call it; the requirements of the tests pin the generators."""

import argparse
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
PROTOS = HERE.parent / "proto"
sys.path.insert(0, str(HERE.parent / "tests" / "python"))

from environment import make  # noqa: E402

SHIPPED = HERE / "osteon" / "v1"
MESSAGES = ("jobs", "results", "specification")
"""Files whose messages a client sees; the API of workers is for the program itself."""

SERVICE = "jobs"
"""The file with the service."""


def made_by(python, directory):
    """The files by their names."""
    plugin = python.with_name("protoc-gen-mypy_grpc")
    protoc = [python, "-m", "grpc_tools.protoc", f"-I{PROTOS}"]
    messages = [f"--python_out={directory}", f"--pyi_out={directory}"]
    stubs = [f"--plugin=protoc-gen-mypy_grpc={plugin}", f"--grpc_python_out={directory}"]
    stubs += [f"--mypy_grpc_out={directory}"]
    paths = {name: PROTOS / "osteon" / "v1" / f"{name}.proto" for name in MESSAGES}
    quiet = {"check": True, "stderr": subprocess.PIPE, "text": True}
    try:
        subprocess.run([*protoc, *messages, *paths.values()], **quiet)
        subprocess.run([*protoc, *stubs, paths[SERVICE]], **quiet)
    except subprocess.CalledProcessError as error:
        sys.exit(f"protoc failed: {error.stderr}")
    return {path.name: path.read_text() for path in sorted((directory / "osteon" / "v1").iterdir())}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; fail if they differ")
    parser.add_argument(
        "--environment", required=True, type=pathlib.Path, help="the virtual environment of the tests"
    )
    arguments = parser.parse_args()
    python = make(arguments.environment.absolute(), HERE / "tests" / "requirements.txt")
    with tempfile.TemporaryDirectory() as directory:
        made = made_by(python, pathlib.Path(directory))
    shipped = {path.name: path.read_text() for path in SHIPPED.glob("*_pb2*")}
    if shipped == made:
        return
    if arguments.check:
        changed = sorted(name for name in {*shipped, *made} if shipped.get(name) != made.get(name))
        sys.exit(f"not made from proto/: {', '.join(changed)}; run `cargo xtask generate stubs`")
    for name in shipped:
        (SHIPPED / name).unlink()
    for name, text in made.items():
        (SHIPPED / name).write_text(text)


if __name__ == "__main__":
    main()
