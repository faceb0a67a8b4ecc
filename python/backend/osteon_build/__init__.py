"""Builds the wheel of osteon (PEP 517): modules that are made from other files, the program, then the native
module by maturin, all in it.

maturin alone packs either a module or a program. So the program is built first and placed where
maturin looks for scripts; pip then installs it as the command `osteon`.

The variable OSTEON_BUILD_PROFILE names a profile of cargo other than `release`."""

import json
import os
import shutil
import subprocess

import maturin
from maturin import get_requires_for_build_editable, get_requires_for_build_wheel  # noqa: F401

from . import modules
from .modules import PYTHON, ROOT

SCRIPTS = PYTHON / "osteon.data" / "scripts"
PROFILE = os.environ.get("OSTEON_BUILD_PROFILE", "release")


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    modules.write()
    place_program()
    settings = settings_with_profile(config_settings)
    return maturin.build_wheel(wheel_directory, settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    modules.write()
    place_program()
    settings = settings_with_profile(config_settings)
    return maturin.build_editable(wheel_directory, settings, metadata_directory)


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.prepare_metadata_for_build_wheel(metadata_directory, config_settings)


prepare_metadata_for_build_editable = prepare_metadata_for_build_wheel


def build_sdist(sdist_directory, config_settings=None):
    raise RuntimeError(
        "osteon has no source distribution, because the package needs the whole repository: "
        "build a wheel in a checkout (pip wheel ./python)"
    )


def settings_with_profile(config_settings):
    """The settings for maturin, which builds the module with the profile of the program."""
    settings = dict(config_settings or {})
    given = settings.get("build-args", "")
    given = " ".join(given) if isinstance(given, list) else given
    settings["build-args"] = f"--profile {PROFILE} {given}".strip()
    return settings


def place_program():
    """Builds the program and copies it, without what only a debugger needs, to where maturin packs it."""
    build = [
        "cargo", "build", "--locked", "--package", "osteon", "--bin", "osteon",
        "--profile", PROFILE, "--message-format", "json-render-diagnostics",
    ]  # fmt: skip
    try:
        built = subprocess.run(build, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    except FileNotFoundError:
        raise RuntimeError("cargo is missing: install Rust (https://rustup.rs), then repeat") from None
    messages = (json.loads(line) for line in built.stdout.splitlines() if line.startswith("{"))
    programs = [message["executable"] for message in messages if message.get("executable")]
    if len(programs) != 1:
        raise RuntimeError(f"cargo built {len(programs)} programs instead of one: {programs}")
    shutil.rmtree(SCRIPTS, ignore_errors=True)
    SCRIPTS.mkdir(parents=True)
    program = SCRIPTS / "osteon"
    shutil.copy2(programs[0], program)
    if shutil.which("strip"):
        subprocess.run(["strip", "--strip-debug", program], check=True)
