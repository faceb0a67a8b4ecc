"""Builds the wheel of the package osteon, installs it in a virtual environment, and tests it there: the
tests, the types of the package, of its stubs and of its tests. Uses the standard library only."""

import argparse
import os
import pathlib
import shutil
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(ROOT / "tests" / "python"))

from environment import check_version, make, run  # noqa: E402


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", required=True, type=pathlib.Path, help="where to build and install to")
    parser.add_argument("--profile", default="dev", help="profile of cargo (dev, release)")
    parser.add_argument("tests", nargs="*", help="names of tests; all, and the types, without any")
    arguments = parser.parse_args()
    check_version()
    arguments.work = arguments.work.absolute()
    python = make(arguments.work / "venv", HERE / "tests" / "requirements.txt")
    install(python, arguments.work / "wheels", arguments.profile)
    variables = dict(os.environ, PYTHONDONTWRITEBYTECODE="1", MYPYPATH=str(HERE / "tests"))
    variables.pop("OSTEON_COORDINATOR", None)
    tests = arguments.tests or [path.stem for path in sorted((HERE / "tests").glob("test_*.py"))]
    if not arguments.tests:
        types(python, variables, arguments.work)
    run([python, "-W", "error::ResourceWarning", "-m", "unittest", "-v", *tests], HERE / "tests", variables)


def install(python, wheels, profile):
    """Builds the wheel and installs it in place of any other."""
    shutil.rmtree(wheels, ignore_errors=True)
    build = [python, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    variables = dict(os.environ, OSTEON_BUILD_PROFILE=profile)
    # maturin of the environment must be found.
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
    run([*mypy, *sorted((HERE / "tests").glob("*.py"))], work, variables)
    stubs = [python, "-m", "mypy.stubtest", "osteon._native", "--mypy-config-file"]
    run([*stubs, HERE / "pyproject.toml"], work, variables)


if __name__ == "__main__":
    main()
