"""Makes the messages and stubs of `osteon.v1` from the `.proto` files of the API for clients."""

import shutil
import subprocess
import sys

MESSAGES = ("jobs", "results", "specification")
"""Files whose messages a client sees; the API of workers is for the program itself."""

SERVICE = "jobs"
"""The file with the service."""


def write(protos, package):
    """Writes them into a directory, in place of those that are there."""
    plugin = shutil.which("protoc-gen-mypy_grpc")
    if plugin is None:
        raise RuntimeError("the package mypy-protobuf is missing, which pip installs for the build")
    for old in package.glob("osteon/v1/*_pb2*"):
        old.unlink()
    protoc = [sys.executable, "-m", "grpc_tools.protoc", f"-I{protos}"]
    messages = [f"--python_out={package}", f"--pyi_out={package}"]
    stubs = [f"--plugin=protoc-gen-mypy_grpc={plugin}", f"--grpc_python_out={package}"]
    stubs += [f"--mypy_grpc_out={package}"]
    paths = {name: protos / "osteon" / "v1" / f"{name}.proto" for name in MESSAGES}
    for command in ([*protoc, *messages, *paths.values()], [*protoc, *stubs, paths[SERVICE]]):
        made = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
        if made.returncode != 0:
            raise RuntimeError(f"protoc failed: {made.stderr}")
