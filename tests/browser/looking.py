"""What the checks in a browser have in common: an environment with Playwright and axe, and what is looked at."""

import argparse
import importlib.resources
import pathlib
import shutil
import subprocess
import sys
import venv

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
WIDTHS = (1280, 800, 390)
SCHEMES = ("light", "dark")


def axe_script():
    return importlib.resources.files("axe_playwright_python").joinpath("axe.min.js").read_text()


def findings(page, axe):
    """Returns what is wrong with a page as it is: rules of axe, and whether it is wider than its window."""
    found = []
    if page.evaluate("document.documentElement.scrollWidth > window.innerWidth"):
        found.append("the page is wider than its window")
    page.evaluate(axe)
    rules = page.evaluate(
        "async () => (await axe.run()).violations.map((rule) => [rule.id, rule.nodes[0].html])")
    return found + [f"axe {rule}: {html[:200]}" for rule, html in rules]


def main(check, description):
    """Calls `check` with the arguments, in an environment that has what requirements.txt names."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--osteon", type=pathlib.Path, required=True)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--chromium", required=True)
    arguments = parser.parse_args()
    # Playwright wants whole paths.
    arguments.chromium = shutil.which(arguments.chromium) or arguments.chromium
    arguments.osteon, arguments.work = arguments.osteon.resolve(), arguments.work.resolve()
    arguments.work.mkdir(parents=True, exist_ok=True)
    environment = arguments.work / "venv"
    if pathlib.Path(sys.prefix) == environment.resolve():
        return check(arguments)
    if not environment.exists():
        venv.create(environment, with_pip=True)
    python = environment / "bin/python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", "-r", HERE / "requirements.txt"],
                   check=True, timeout=600)
    return subprocess.run([python, *sys.argv]).returncode
