"""Makes all files of a release in one folder, and tries them: wheels, archives of the program with what belongs to it,
a Debian package, a bill of materials, sums. The program is built once for each processor, by `python/wheels.py`, for
every Linux with a glibc from 2.17 on. Uses the standard library only, and tools in a virtual environment; `cargo xtask
release` calls it."""

import argparse
import hashlib
import os
import pathlib
import platform
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path[:0] = [str(ROOT / "python"), str(ROOT / "tests" / "python")]

import archive  # noqa: E402
import trial  # noqa: E402
import wheels  # noqa: E402
from environment import check_version, make, run  # noqa: E402
from source import VERSION, commit_time, files, refuse_unless_clean  # noqa: E402

SHELLS = {"bash": "osteon.bash", "zsh": "_osteon", "fish": "osteon.fish"}
"""Shells with completions, and the names of their scripts."""


def main():
    arguments = parse()
    check_version()
    if not arguments.dirty:
        refuse_unless_clean()
    # Packers write this time instead of the clock's.
    os.environ["SOURCE_DATE_EPOCH"] = str(commit_time())
    work = arguments.work.absolute()
    out = prepare(arguments.out, work)
    python = make(work / "venv", HERE / "requirements.txt")
    compare(python)
    build = [sys.executable, ROOT / "python" / "wheels.py", "--work", arguments.wheels, "--profile", arguments.profile]
    run([*build, *arguments.processors], ROOT)
    programs = {name: wheels.program(arguments.wheels, name, arguments.profile) for name in arguments.processors}
    fill(out, work, programs, arguments, python)
    trial.check(out, work, programs, python)
    write_sums(out)
    print(f"{out}:")
    for path in sorted(out.iterdir()):
        print(f"  {path.stat().st_size / 1e6:6.1f} MB  {path.name}")


def parse():
    here = platform.machine()
    parser = argparse.ArgumentParser(prog="cargo xtask release", description=__doc__)
    for name in ("--work", "--wheels", "--cargo-deb"):
        parser.add_argument(name, required=True, type=pathlib.Path, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=pathlib.Path, help="a new folder for the files (target/release-work/files)")
    parser.add_argument("--profile", default="release", help="profile of cargo; dev is built soonest (release)")
    parser.add_argument("--dirty", action="store_true", help="take changes that are in no commit, to try things out")
    parser.add_argument("processors", nargs="*", help=f"of {', '.join(wheels.PROCESSORS)}; all without any")
    arguments = parser.parse_args()
    arguments.processors = arguments.processors or list(wheels.PROCESSORS)
    for processor in set(arguments.processors) - set(wheels.PROCESSORS):
        parser.error(f"{processor} is none of {', '.join(wheels.PROCESSORS)}")
    if here not in arguments.processors:
        parser.error(f"this machine has the processor {here}: its program writes the manual pages, so build it, too")
    return arguments


def prepare(out, work):
    """Makes the folder for the files; one that was named must not hold anything."""
    if out is None:
        out = work / "files"
        shutil.rmtree(out, ignore_errors=True)
    elif out.exists() and any(out.iterdir()):
        sys.exit(f"{out} is not empty")
    out.mkdir(parents=True, exist_ok=True)
    return out.absolute()


def compare(python):
    """Lets tools of others read files that are published for them: the schema of job files, the recipe for conda."""
    jobs = ["fuzz/corpus/jobs/every-key.toml", *(name for name in files("examples") if is_job(name))]
    schema = (ROOT / "docs" / "job.schema.json").as_uri()
    run([python.parent / "taplo", "check", "--no-auto-config", "--schema", schema, *jobs], ROOT)
    run([python, HERE / "recipe.py"], ROOT)


def is_job(name):
    """Whether a file of the repository is a job file."""
    return name.endswith(".toml") and "\n[parameters" in (ROOT / name).read_text()


def fill(out, work, programs, arguments, python):
    """Writes all files but the sums to `out`."""
    for processor in programs:
        for wheel in (arguments.wheels / "wheels" / processor).glob("*.whl"):
            shutil.copy(wheel, out)
    licences = work / "THIRD-PARTY.txt"
    crates = [python, HERE / "crates.py", "--bill", out / f"osteon-{VERSION}.cdx.json", "--licences", licences]
    run([*crates, *map(wheels.target_of, programs)], ROOT)
    # cargo-deb takes the program, and what is packed beside it, from the target directory of a release.
    target = work / "target"
    describe(programs[platform.machine()], target / "release")
    for processor, program in programs.items():
        archive.pack(processor, program, target / "release", licences, work, out)
    # The linker has stripped it. Packages for other processors would need Debian's libraries for them.
    deb = [arguments.cargo_deb, "--no-build", "--no-strip", "--locked", "--variant", "portable"]
    deb += ["--output", out]
    run(deb, ROOT, dict(os.environ, CARGO_TARGET_DIR=str(target)))


def describe(program, folder):
    """Copies the program of this machine to a folder, and lets it write its manual pages and completions there."""
    shutil.rmtree(folder, ignore_errors=True)
    scripts = folder / "completions"
    scripts.mkdir(parents=True)
    shutil.copy(program, folder)
    run([program, "man", folder / "man"])
    for shell, name in SHELLS.items():
        script = subprocess.run([program, "completions", shell], check=True, stdout=subprocess.PIPE).stdout
        (scripts / name).write_bytes(script)


def write_sums(out):
    """Writes the SHA-256 sums of all files, as sha256sum reads them."""
    paths = sorted(out.iterdir())
    sums = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in paths]
    (out / "SHA256SUMS").write_text("".join(sums))


if __name__ == "__main__":
    main()
