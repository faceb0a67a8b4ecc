"""The Debian package: builds it from the program at hand, and looks into it."""

import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

from machine import OSTEON, ROOT, need, output

SETTINGS = ["/etc/osteon/coordinator.env", "/etc/osteon/worker.env"]
UNITS = ["osteon-coordinator.service", "osteon-worker.service"]


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        need("dpkg-deb", "dpkg-shlibdeps")
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.directory = pathlib.Path(scratch.name)
        # cargo-deb takes the program from the target directory of a release.
        program = cls.directory / "target" / "release" / "osteon"
        program.parent.mkdir(parents=True)
        shutil.copy(OSTEON, program)
        # What `cargo xtask package man` writes.
        output(OSTEON, "man", program.parent / "man")
        completions = program.parent / "completions"
        completions.mkdir()
        for shell, name in [("bash", "osteon.bash"), ("zsh", "_osteon"), ("fish", "osteon.fish")]:
            (completions / name).write_text(output(OSTEON, "completions", shell))
        cls.package = cls.directory / "osteon.deb"
        command = [os.environ["CARGO_DEB"], "--no-build", "--fast", "--strip", "--output", str(cls.package)]
        variables = dict(os.environ, CARGO_TARGET_DIR=str(cls.directory / "target"))
        done = subprocess.run(command, cwd=ROOT, env=variables, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, done.stderr
        cls.warnings = [line for line in done.stderr.splitlines() if "warning" in line]
        cls.root = cls.directory / "root"
        cls.control = cls.directory / "control"
        output("dpkg-deb", "--extract", cls.package, cls.root)
        output("dpkg-deb", "--control", cls.package, cls.control)

    def test_cargo_deb_has_no_objections(self):
        self.assertEqual(self.warnings, [])

    def test_every_document_and_example_is_in_it(self):
        document = self.root / "usr/share/doc/osteon"
        for path in [*(ROOT / "docs").iterdir(), ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "LICENSE-APACHE"]:
            self.assertEqual((document / path.name).read_bytes(), path.read_bytes())
        for path in (ROOT / "examples").rglob("*"):
            if path.suffix in (".toml", ".csv", ".npy"):
                inside = document / "examples" / path.relative_to(ROOT / "examples")
                self.assertEqual(inside.read_bytes(), path.read_bytes())
        self.assertIn("MIT", (document / "copyright").read_text())

    def test_its_program_runs(self):
        program = self.root / "usr/bin/osteon"
        self.assertEqual(program.stat().st_mode & 0o7777, 0o755)
        self.assertEqual(output(program, "--version"), output(OSTEON, "--version"))

    def test_its_settings_are_kept_at_an_upgrade(self):
        self.assertEqual((self.control / "conffiles").read_text().split(), SETTINGS)
        for path in SETTINGS:
            self.assertTrue((self.root / path[1:]).is_file())

    def test_its_scripts_name_files_that_are_in_it(self):
        script = (self.control / "postinst").read_text()
        for tool, folder, expected in [
            (r"systemd-sysusers .* (\S+)\n", "usr/lib/sysusers.d", ["osteon.conf"]),
            (r"systemd-tmpfiles --create (\S+) ", "usr/lib/tmpfiles.d", ["osteon-coordinator.conf", "osteon-worker.conf"]),
        ]:
            names = re.findall(tool, script)
            self.assertEqual(names, expected)
            for name in names:
                self.assertTrue((self.root / folder / name).is_file(), name)
        # Users come before what belongs to them.
        self.assertLess(script.index("systemd-sysusers"), script.index("systemd-tmpfiles"))

    def test_installing_it_starts_and_enables_nothing(self):
        script = (self.control / "postinst").read_text()
        for unit in UNITS:
            self.assertTrue((self.root / "usr/lib/systemd/system" / unit).is_file())
            self.assertIn(f"try-restart {unit}", script)
        self.assertNotIn("deb-systemd-invoke start", script)
        # A unit is enabled again only if it was before.
        for line in re.findall(r"\n(.*)\n.*\n.*deb-systemd-helper enable", script):
            self.assertIn("was-enabled", line)

    def test_its_scripts_are_shell(self):
        for name in ("postinst", "prerm", "postrm"):
            output("sh", "-n", self.control / name)

    def test_it_depends_on_libraries_and_on_the_maker_of_users(self):
        fields = output("dpkg-deb", "--field", self.package, "Depends")
        self.assertRegex(fields, r"libc6 \(>= 2\.\d+\)")
        self.assertIn("systemd | systemd-standalone-sysusers", fields)

    def test_every_command_has_a_manual_page_of_this_version(self):
        lines = output(OSTEON, "--help").split("Commands:\n")[1].split("\n\n")[0].splitlines()
        commands = {line.split()[0] for line in lines if re.match(r"  \S", line)} - {"help"}
        self.assertGreater(len(commands), 15)
        # cargo-deb compresses only pages of the source; man reads both.
        pages = {path.name: path for path in (self.root / "usr/share/man/man1").iterdir()}
        for name in ["osteon", *(f"osteon-{command}" for command in sorted(commands))]:
            self.assertIn(f"{name}.1", pages)
        version = output(OSTEON, "--version").split()[1]
        text = pages["osteon.1"].read_text()
        self.assertIn(f"osteon {version}", text)
        self.assertIn("EXIT STATUS", text)

    def test_shells_find_their_completions(self):
        for path in ["bash-completion/completions/osteon", "zsh/vendor-completions/_osteon",
                     "fish/vendor_completions.d/osteon.fish"]:
            self.assertIn("identify", (self.root / "usr/share" / path).read_text())
        output("bash", "-n", self.root / "usr/share/bash-completion/completions/osteon")
