"""Builds wheels for Linux with a glibc from 2.17 on (manylinux2014), for x86_64 and aarch64, by maturin and the
linker of Zig, which brings the headers and symbols of old glibcs for every processor. Uses the standard library
only; `cargo xtask package wheels` calls it.

maturin builds the module; cargo-zigbuild builds the program, which is placed among maturin's scripts, as
`backend/osteon_build.py` does for this machine."""

import argparse
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import time
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(ROOT / "tests" / "python"))

from environment import check_version, make, run  # noqa: E402

GLIBC = "2.17"
MACHINES = {"x86_64": 62, "aarch64": 183}
"""The processors, and their numbers in ELF files."""

PROCESSORS = tuple(MACHINES)
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
    python = make(work / "venv", HERE / "build.txt", HERE / "wheels.txt")
    # cargo-zigbuild and maturin find the package ziglang by the Python of this environment.
    variables = dict(os.environ, PATH=f"{python.parent}{os.pathsep}{os.environ['PATH']}")
    run([python, "-c", "from osteon_build import modules; modules.write()"], HERE / "backend", variables)
    for processor in arguments.processors or PROCESSORS:
        build(python, work, processor, arguments.profile, variables)


def target_of(processor):
    """What rustc calls Linux on a processor."""
    return f"{processor}-unknown-linux-gnu"


def has_library(target):
    """Whether Rust's library for a target is there, as that of this machine is without rustup, too."""
    where = subprocess.run(["rustc", "--print", "sysroot"], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    return (pathlib.Path(where.stdout.strip()) / "lib" / "rustlib" / target).is_dir()


def program(work, processor, profile):
    """Where the program for a processor is built."""
    folder = "debug" if profile == "dev" else profile
    return work / "target" / target_of(processor) / folder / "osteon"


def build(python, work, processor, profile, variables):
    """Builds one wheel, and says what it is."""
    target = target_of(processor)
    if not has_library(target):
        run(["rustup", "target", "add", target], ROOT)
    # Without what only a debugger needs.
    lean = {f"CARGO_PROFILE_{profile.upper()}_{key}": value for key, value in (("DEBUG", "false"), ("STRIP", "symbols"))}
    variables = variables | lean | {"CARGO_TARGET_DIR": str(work / "target")}
    zigbuild = ["cargo-zigbuild", "zigbuild", "--locked", "--package", "osteon", "--bin", "osteon"]
    run([*zigbuild, "--profile", profile, "--target", f"{target}.{GLIBC}"], ROOT, variables)
    shutil.rmtree(SCRIPTS, ignore_errors=True)
    SCRIPTS.mkdir(parents=True)
    shutil.copy2(program(work, processor, profile), SCRIPTS / "osteon")
    wheels = work / "wheels"
    shutil.rmtree(wheels / processor, ignore_errors=True)
    wheel = [python, "-m", "maturin", "build", "--zig", "--locked", "--profile", profile]
    wheel += ["--target", target, "--compatibility", "manylinux2014", "--out", wheels / processor]
    run(wheel, HERE, variables)
    [built] = (wheels / processor).glob("*.whl")
    check(built, processor, work / "trial")
    print(f"{built}: {built.stat().st_size / 1e6:.1f} MB")


def check(wheel, processor, trial):
    """Fails unless the wheel says that it is for the processor, and holds a program and a module that are; installs
    and uses it if this machine has that processor."""
    if f"manylinux2014_{processor}" not in wheel.stem.split("-")[-1].split("."):
        sys.exit(f"the name of {wheel.name} must end in a tag manylinux2014_{processor}")
    with zipfile.ZipFile(wheel) as files:
        for end in (".data/scripts/osteon", "osteon/_native.abi3.so"):
            [name] = [name for name in files.namelist() if name.endswith(end)]
            examine(f"{name} of {wheel.name}", files.read(name), processor)
    if platform.machine() != processor:
        print(f"{wheel.name} is for another processor: it was compiled and looked at, but not tried")
        return
    shutil.rmtree(trial, ignore_errors=True)
    run([sys.executable, "-m", "venv", trial])
    run([trial / "bin" / "python", "-m", "pip", "install", "--quiet", wheel])
    demonstrate(trial / "bin" / "osteon", trial)
    use = "import osteon, sys; print(osteon.simulate(sys.argv[1]).velocity, 'm/s')"
    run([trial / "bin" / "python", "-c", use, ROOT / "examples" / "cases" / "A.toml"])


def demonstrate(osteon, folder):
    """Runs the program's demonstration, which must end with a report."""
    start = time.monotonic()
    run([osteon, "demo", "demo"], folder)
    if not list((folder / "demo").rglob("*.html")):
        sys.exit(f"{osteon} demo wrote no report")
    print(f"{osteon} demo: {time.monotonic() - start:.1f} s")


def examine(name, content, processor):
    """Fails unless an ELF file is for the processor and for the glibc; maturin examines the module only."""
    # The header begins with a magic; the processor is at byte 18.
    if content[:4] != b"\x7fELF" or int.from_bytes(content[18:20], "little") != MACHINES[processor]:
        sys.exit(f"{name} is no program for {processor}, but {len(content)} bytes of something else")
    # Versions of symbols, of which the newest counts.
    versions = re.findall(rb"\0GLIBC_([\d.]+)(?=\0)", content)
    needed = max((tuple(map(int, version.split(b"."))) for version in versions), default=(0,))
    newest = ".".join(map(str, needed))
    if needed > tuple(map(int, GLIBC.split("."))):
        sys.exit(f"{name} needs glibc {newest}; it must run with {GLIBC}")
    print(f"{name}: {processor}, glibc {newest}")


if __name__ == "__main__":
    main()
