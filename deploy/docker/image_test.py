"""The image: what can be said of it without a container engine."""

import fnmatch
import pathlib
import re
import shutil
import subprocess
import tempfile
import tomllib
import unittest

from machine import CONTAINER_USER, ROOT, output

HERE = pathlib.Path(__file__).resolve().parent
# Files that every build with cargo needs, and some that no build should see.
NEEDED = ("Cargo.lock", "LICENSE-MIT", "src/main.rs", "proto/osteon/v1/jobs.proto", ".cargo/config.toml")
UNSEEN = ("README.md", "docs/cluster.md", "tests/tidy.rs", "deploy/docker/Dockerfile", ".ci/run")


def instructions():
    """The instructions of the Dockerfile, with continued lines joined and without comments."""
    lines = (HERE / "Dockerfile").read_text().splitlines()
    text = "\n".join(line for line in lines if not line.lstrip().startswith("#"))
    return [line.split(None, 1) for line in text.replace("\\\n", " ").splitlines() if line.strip()]


def stages():
    """The instructions of each stage, by its base."""
    found = []
    for name, rest in instructions():
        if name == "FROM":
            found.append((rest.split()[0], []))
        elif found:
            found[-1][1].append((name, rest))
    return found


def rules():
    lines = (ROOT / ".dockerignore").read_text().splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def is_sent(path):
    """Whether a file is part of the context: the last rule that fits it, or a directory above it, decides."""
    parts = pathlib.PurePosixPath(path).parts
    sent = True
    for rule in rules():
        pattern = rule.removeprefix("!")
        above = ("/".join(parts[: i + 1]) for i in range(len(parts)))
        if any(fnmatch.fnmatchcase(name, pattern) for name in above):
            sent = rule.startswith("!")
    return sent


def tracked():
    return output("git", "ls-files", cwd=ROOT).splitlines()


class Image(unittest.TestCase):
    def test_it_is_built_by_the_toolchain_of_the_repository(self):
        toolchain = tomllib.loads((ROOT / "rust-toolchain.toml").read_text())["toolchain"]["channel"]
        (base, steps), _ = stages()
        self.assertRegex(base, rf"^docker\.io/library/rust:{re.escape(toolchain)}-")
        self.assertIn(("ENV", f"RUSTUP_TOOLCHAIN={toolchain}"), steps)

    def test_it_holds_one_program_that_runs_as_nobody_in_particular(self):
        base, steps = stages()[-1]
        self.assertEqual(base, "scratch")
        self.assertIn(("USER", f"{CONTAINER_USER}:{CONTAINER_USER}"), steps)
        self.assertIn(("ENTRYPOINT", '["/usr/bin/osteon"]'), steps)
        self.assertNotIn("RUN", [name for name, _ in steps])
        for name, rest in steps:
            if name == "COPY":
                self.assertIn("--from=build", rest)

    def test_the_build_fails_unless_it_is_static_and_locked(self):
        _, steps = stages()[0]
        (run,) = [rest for name, rest in steps if name == "RUN"]
        for part in ("--locked", "-C target-feature=+crt-static", "grep --quiet INTERP", "exit 1"):
            self.assertIn(part, run)
        # Parts that fail end it: no `;` but inside of the conditional.
        self.assertEqual(run.split("if readelf")[0].count(";"), 0)
        subprocess.run(["sh", "-n", "-c", run], check=True)

    def test_every_name_of_a_stage_exists(self):
        names = {"build"}
        for name, rest in instructions():
            for stage in re.findall(r"--from=(\S+)", rest):
                self.assertIn(stage, names)


class Context(unittest.TestCase):
    def test_what_is_sent(self):
        for path in NEEDED:
            self.assertTrue((ROOT / path).exists(), path)
            self.assertTrue(is_sent(path), path)
        for path in UNSEEN:
            self.assertTrue((ROOT / path).exists(), path)
        for path in (*UNSEEN, "target/debug/osteon", ".git/config", "certs/ca-key.pem"):
            self.assertFalse(is_sent(path), path)

    def test_every_rule_names_something(self):
        for rule in rules():
            if rule.startswith("!"):
                self.assertTrue((ROOT / rule[1:]).exists(), rule)

    def test_cargo_finds_all_crates_in_it(self):
        with tempfile.TemporaryDirectory() as scratch:
            for path in filter(is_sent, tracked()):
                target = pathlib.Path(scratch) / path
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / path, target)
            # Reads every manifest, and looks for the sources of every target.
            output("cargo", "metadata", "--locked", "--offline", "--no-deps", "--format-version=1", cwd=scratch)
            build = (ROOT / "build.rs").read_text()
            sources = re.search(r"SOURCES: \[&str; \d+\] = \[(.*?)\];", build, re.DOTALL)[1]
            for source in re.findall(r'"([^"]+)"', sources):
                self.assertTrue((pathlib.Path(scratch) / source).exists(), source)
