"""Builds the wheel of the package osteon, installs it in a virtual environment, and tests it there: the
tests, and the types of the package, of its stubs and of its tests. Uses the standard library only.

Other suites need packages of their own: `pools` runs workers in Dask and Ray, `notebooks` executes
examples/notebooks, and `bench` measures what Python adds."""

import argparse
import os
import pathlib
import shutil
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent
SUITES = {"package": "tests", "pools": "tests/pools", "notebooks": "tests/notebooks", "bench": "bench"}
"""Folders of the tests, or of the benchmark, each with the requirements of its environment."""

MODULES = os.pathsep.join(str(HERE / folder) for folder in ("tests", "tests/pools"))
"""Where mypy finds what several tests use."""

sys.path.insert(0, str(ROOT / "tests" / "python"))

from environment import check_version, make, run  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", required=True, type=pathlib.Path, help="where to build and install to")
    parser.add_argument("--profile", default="dev", help="profile of cargo (dev, release)")
    parser.add_argument("tests", nargs="*", help="names of tests; all, and the types, without any")
    parser.add_argument("--suite", choices=SUITES, default="package", help="what to test (package)")
    arguments = parser.parse_args()
    check_version()
    arguments.work = arguments.work.absolute()
    folder = HERE / SUITES[arguments.suite]
    python = make(arguments.work / "venv", HERE / "build.txt", folder / "requirements.txt")
    install(python, arguments.work / "wheels", arguments.profile)
    variables = dict(os.environ, PYTHONDONTWRITEBYTECODE="1", MYPYPATH=MODULES)
    variables.pop("OSTEON_COORDINATOR", None)
    if arguments.suite == "bench":
        run([python, HERE / "bench" / "compare.py", *arguments.tests], ROOT, variables)
        return
    tests = arguments.tests or [path.stem for path in sorted(folder.glob("test_*.py"))]
    if arguments.suite == "package" and not arguments.tests:
        types(python, variables, arguments.work)
    run([python, *warnings(arguments.suite), "-m", "unittest", "-v", *tests], folder, variables)


def warnings(suite):
    """Options of Python: what is left open is an error, but not in packages of others."""
    return ["-W", "error::ResourceWarning"] if suite == "package" else []


def install(python, wheels, profile):
    """Builds the wheel and installs it in place of any other."""
    shutil.rmtree(wheels, ignore_errors=True)
    build = [python, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    variables = dict(os.environ, OSTEON_BUILD_PROFILE=profile)
    # maturin and mypy-protobuf of the environment must be found.
    variables["PATH"] = f"{python.parent}{os.pathsep}{variables['PATH']}"
    run([*build, "--wheel-dir", wheels, HERE], ROOT, variables)
    [wheel] = wheels.glob("osteon-*.whl")
    replace = ["--quiet", "--no-deps", "--no-index", "--force-reinstall"]
    run([python, "-m", "pip", "install", *replace, wheel])


def types(python, variables, work):
    """Checks types: of the package as installed, of its stubs against the module, and of the tests."""
    mypy = [python, "-m", "mypy", "--config-file", HERE / "pyproject.toml"]
    mypy += ["--cache-dir", work / "mypy"]
    run([*mypy, "--package", "osteon"], work, variables)
    run([*mypy, *sorted((HERE / "tests").rglob("*.py"))], work, variables)
    stubs = [python, "-m", "mypy.stubtest", "osteon._native", "--mypy-config-file"]
    run([*stubs, HERE / "pyproject.toml"], work, variables)


if __name__ == "__main__":
    main()
