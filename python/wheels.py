"""Builds wheels for Linux with a glibc from 2.17 on (manylinux2014), for x86_64 and aarch64, by maturin and the
linker of Zig, which brings the headers and symbols of old glibcs for every processor. Uses the standard library
only; `cargo xtask wheels` calls it.

maturin builds the module; cargo-zigbuild builds the program, which is placed among maturin's scripts, as
`backend/osteon_build.py` does for this machine."""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(ROOT / "tests" / "python"))

from environment import check_version, make, run  # noqa: E402

GLIBC = "2.17"
PROCESSORS = ("x86_64", "aarch64")
SCRIPTS = HERE / "osteon.data" / "scripts"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", required=True, type=pathlib.Path, help="where to build and install to")
    parser.add_argument("--profile", default="release", help="profile of cargo (release)")
    parser.add_argument("processors", nargs="*", help=f"of {', '.join(PROCESSORS)}; all without any")
    arguments = parser.parse_args()
    for processor in set(arguments.processors) - set(PROCESSORS):
        parser.error(f"{processor} is none of {', '.join(PROCESSORS)}")
    check_version()
    work = arguments.work.absolute()
    python = make(work / "venv", HERE / "wheels.txt")
    for processor in arguments.processors or PROCESSORS:
        build(python, work, processor, arguments.profile)


def build(python, work, processor, profile):
    """Builds one wheel, and says what it is."""
    target = f"{processor}-unknown-linux-gnu"
    run(["rustup", "target", "add", target], ROOT)
    variables = dict(os.environ)
    # cargo-zigbuild and maturin find the package ziglang by the Python of this environment.
    variables["PATH"] = f"{python.parent}{os.pathsep}{variables['PATH']}"
    variables["CARGO_TARGET_DIR"] = str(work / "target")
    zigbuild = ["cargo-zigbuild", "zigbuild", "--locked", "--package", "osteon", "--bin", "osteon"]
    run([*zigbuild, "--profile", profile, "--target", f"{target}.{GLIBC}"], ROOT, variables)
    folder = "debug" if profile == "dev" else profile
    shutil.rmtree(SCRIPTS, ignore_errors=True)
    SCRIPTS.mkdir(parents=True)
    # maturin strips the module, and this the program, of what only a debugger needs.
    shutil.copy2(work / "target" / target / folder / "osteon", SCRIPTS / "osteon")
    strip = [python, "-m", "ziglang", "objcopy", "--strip-all", SCRIPTS / "osteon"]
    subprocess.run([*strip, SCRIPTS / "osteon"], check=False, capture_output=True)
    wheel = [python, "-m", "maturin", "build", "--zig", "--locked", "--profile", profile]
    wheel += ["--target", target, "--compatibility", "manylinux2014", "--out", work / "wheels"]
    run(wheel, HERE, variables)


if __name__ == "__main__":
    main()
