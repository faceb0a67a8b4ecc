"""Opens reports in headless Chromium with the network off: rules of axe, script errors, widths.

    report.py --osteon PROGRAM --work DIRECTORY --chromium PROGRAM

makes reports of a simulation, of groups and of a comparison, and looks at each at three widths, light and dark.
"""

import shutil
import subprocess
import sys

import looking
from looking import ROOT


def make_reports(osteon, work):
    """Returns the pages of the reports, which are made once per directory."""
    case, groups = work / "case", work / "groups"
    subprocess.run([osteon, "simulate", ROOT / "examples/cases/A.toml", "--out", case, "--report"],
                   check=True, timeout=120, stdout=subprocess.DEVNULL)
    subprocess.run([osteon, "identify", ROOT / "examples/groups.toml", "--out", groups, "--report"],
                   check=True, timeout=600, stdout=subprocess.DEVNULL)
    # Runs of one name would be sections of one name.
    again, both = shutil.copytree(groups, work / "again", dirs_exist_ok=True), work / "both"
    subprocess.run([osteon, "report", groups, again, "--out", both], check=True, timeout=120)
    return [folder / "index.html" for folder in (case / "report", groups / "report", both)]


def problems_of(browser, page_file, width, scheme, axe):
    context = browser.new_context(
        viewport={"width": width, "height": 900}, color_scheme=scheme, offline=True)
    page, found = context.new_page(), []
    page.on("console", lambda message: found.append(f"console: {message.text}"))
    page.on("pageerror", lambda error: found.append(f"script: {error}"))
    page.on("request", lambda request: request.url.startswith("file:")
            or found.append(f"request: {request.url}"))
    page.goto(page_file.as_uri())
    page.mouse.move(width / 2, 400)
    found += looking.findings(page, axe)
    page.screenshot(path=page_file.with_name(f"{page_file.parent.name}-{width}-{scheme}.png"),
                    full_page=True)
    context.close()
    return found


def check(arguments):
    from playwright.sync_api import sync_playwright

    axe = looking.axe_script()
    failed = False
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=arguments.chromium, args=["--no-sandbox"])
        for page_file in make_reports(arguments.osteon, arguments.work):
            for width in looking.WIDTHS:
                for scheme in looking.SCHEMES:
                    found = problems_of(browser, page_file, width, scheme, axe)
                    print(page_file, width, scheme, "; ".join(found) or "ok")
                    failed = failed or bool(found)
        browser.close()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(looking.main(check, __doc__))
