"""The units: what systemd says of them, and what the program does where they rely on it."""

import configparser
import os
import pathlib
import shlex
import shutil
import signal
import subprocess
import tempfile
import unittest

from machine import OSTEON, need, output
from services import Service, url_of, wait_for

HERE = pathlib.Path(__file__).resolve().parent
UNITS = ("osteon-coordinator", "osteon-worker")
# Tenths; `systemd-analyze security` gives 10 to a service without any protection. Theirs is 1.2.
EXPOSURE_MAX = 13
# DRAIN_S_MAX of worker/src/state.rs, s.
DRAIN_S_MAX = 10


class Sections(dict):
    """Joins the lines of a key that occurs more than once, which parsers of other formats refuse."""

    def __setitem__(self, key, value):
        if key in self and isinstance(value, list):
            self[key].extend(value)
        else:
            super().__setitem__(key, value)


def unit(name):
    """The sections of a unit."""
    parser = configparser.RawConfigParser(dict_type=Sections, strict=False)
    parser.optionxform = str
    parser.read(HERE / f"{name}.service")
    return parser


def environment(name, **settings):
    """The variables of a unit's file of settings as it is installed, and what an administrator adds."""
    lines = (HERE / f"{name}.env").read_text().splitlines()
    given = [line.split("=", 1) for line in lines if line and not line.startswith("#")]
    return {**{key: value.strip('"') for key, value in given}, **settings}


def command(name, variables):
    """What systemd would start: a variable becomes its words, or nothing."""
    words = []
    for word in unit(name)["Service"]["ExecStart"].split():
        words += variables.get(word[1:], "").split() if word.startswith("$") else [word]
    assert words[0] == "/usr/bin/osteon"
    return [OSTEON, *words[1:]]


class Checked(unittest.TestCase):
    """What systemd can say of a unit that it does not run."""

    def setUp(self):
        need("systemd-analyze")
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.root = pathlib.Path(scratch.name)

    def install(self):
        """A root with the units, the programs that they start, and the units that they need."""
        units = self.root / "usr/lib/systemd/system"
        units.mkdir(parents=True)
        for target in pathlib.Path("/usr/lib/systemd/system").glob("*.target"):
            shutil.copy(target, units)
        for name in UNITS:
            shutil.copy(HERE / f"{name}.service", units)
        for program in ("usr/bin/osteon", "bin/sh"):
            path = self.root / program
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("")
            path.chmod(0o755)

    def test_systemd_finds_no_fault(self):
        self.install()
        verify = ["systemd-analyze", "verify", "--man=no", "--recursive-errors=yes", f"--root={self.root}"]
        done = subprocess.run([*verify, *(f"{name}.service" for name in UNITS)], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_systemd_finds_little_exposed(self):
        for name in UNITS:
            path = str(HERE / f"{name}.service")
            output("systemd-analyze", "security", "--offline=true", f"--threshold={EXPOSURE_MAX}", path)

    def test_users_and_directories_are_made(self):
        need("systemd-sysusers", "systemd-tmpfiles")
        if os.geteuid() != 0:
            self.skipTest("only root can make directories of other users")
        (self.root / "etc").mkdir()
        output("systemd-sysusers", f"--root={self.root}", HERE / "sysusers.d" / "osteon.conf")
        files = sorted((HERE / "tmpfiles.d").glob("*.conf"))
        output("systemd-tmpfiles", f"--root={self.root}", "--create", *files)
        lines = (self.root / "etc/passwd").read_text().splitlines()
        users = {line.split(":")[0]: line.split(":") for line in lines}
        for name in UNITS:
            # The unit's user exists, has no shell, and alone may enter its directory.
            service = unit(name)["Service"]
            self.assertEqual(service["User"], name)
            self.assertEqual(service["Group"], name)
            self.assertEqual(users[name][6], "/usr/sbin/nologin")
            directory = (self.root / "etc/osteon" / name.removeprefix("osteon-")).stat()
            self.assertEqual((directory.st_uid, directory.st_gid), (0, int(users[name][3])))
            self.assertEqual(directory.st_mode & 0o777, 0o750)


class Relied(unittest.TestCase):
    """What the units rely on the program for."""

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.directory = pathlib.Path(scratch.name)
        self.store = self.directory / "store"

    def start(self, name, words, variables):
        words = [word.replace("/var/lib/osteon", str(self.store)) for word in words]
        service = Service(words, self.directory, variables)
        self.addCleanup(service.__exit__)
        return service

    def start_coordinator(self, options="--listen 127.0.0.1:0"):
        variables = environment("coordinator", OSTEON_COORDINATOR_OPTIONS=options)
        coordinator = self.start("osteon-coordinator", command("osteon-coordinator", variables), variables)
        return coordinator, url_of(coordinator, self.store)

    def start_worker(self, url):
        options = "--threads 1"
        variables = environment("worker", OSTEON_COORDINATOR=url, OSTEON_WORKER_OPTIONS=options)
        worker = self.start("osteon-worker", command("osteon-worker", variables), variables)
        wait_for("attachment", lambda: '"state": "ok"' in output(OSTEON, "worker", "list", "--json", "--coordinator", url))
        return worker

    def test_the_installed_settings_are_those_of_one_machine(self):
        listen = environment("coordinator")["OSTEON_COORDINATOR_OPTIONS"]
        self.assertEqual(listen, "--listen 127.0.0.1:7000")
        self.assertEqual(environment("worker"), {"OSTEON_COORDINATOR": "http://127.0.0.1:7000"})
        words = command("osteon-worker", environment("worker"))
        self.assertEqual(words, [OSTEON, "worker"])

    def test_a_worker_that_is_drained_ends_with_0_and_is_not_started_again(self):
        self.assertEqual(unit("osteon-worker")["Service"]["Restart"], "on-failure")
        _, url = self.start_coordinator()
        worker = self.start_worker(url)
        output(OSTEON, "worker", "drain", "1", "--coordinator", url)
        self.assertEqual(worker.process.wait(timeout=60), 0, worker.text())

    def test_both_end_with_0_when_they_are_stopped_in_time(self):
        coordinator, url = self.start_coordinator()
        worker = self.start_worker(url)
        for name, service in [("osteon-worker", worker), ("osteon-coordinator", coordinator)]:
            limit = int(unit(name)["Service"]["TimeoutStopSec"])
            self.assertGreater(limit, DRAIN_S_MAX)
            self.assertEqual(service.end(signal.SIGTERM, limit), 0, service.text())

    def test_a_coordinator_without_tls_ends_at_sighup_and_is_started_again(self):
        self.assertEqual(unit("osteon-coordinator")["Service"]["RestartForceExitStatus"], "SIGHUP")
        coordinator, _ = self.start_coordinator()
        self.assertEqual(coordinator.end(signal.SIGHUP), -signal.SIGHUP)

    def test_a_coordinator_with_tokens_reads_them_again_at_sighup(self):
        tokens, token = self.directory / "tokens", self.directory / "ann"
        for holder in ("ann", "ben"):
            role = ["token", holder, "--role", "read", "--tokens", str(tokens)]
            output(OSTEON, *role, "--out", str(self.directory / holder))
        coordinator, url = self.start_coordinator(f"--listen 127.0.0.1:0 --tokens {tokens}")
        output(OSTEON, "job", "list", "--coordinator", url, "--token-file", str(token))
        lines = tokens.read_text().splitlines(keepends=True)
        tokens.write_text("".join(line for line in lines if not line.startswith("ann ")))
        coordinator.send(signal.SIGHUP)

        def refused():
            jobs = [OSTEON, "job", "list", "--coordinator", url, "--token-file", str(token)]
            return subprocess.run(jobs, capture_output=True, timeout=60, check=False).returncode == 1

        wait_for("refusal of a token that was deleted", refused)
        coordinator.require()

    def test_wrong_options_end_with_the_code_that_prevents_a_restart(self):
        for name, options in [
            ("osteon-coordinator", "--listen 0.0.0.0:0"),
            ("osteon-coordinator", "--listen 127.0.0.1:0 --tokens /missing"),
            ("osteon-coordinator", "--liste 127.0.0.1:0"),
            ("osteon-worker", "--threads none"),
        ]:
            prevented = unit(name)["Service"]["RestartPreventExitStatus"].split()
            variables = {f"{name.upper().replace('-', '_')}_OPTIONS": options}
            service = self.start(name, command(name, variables), variables)
            self.assertIn(str(service.process.wait(timeout=60)), prevented, service.text())

    def test_the_examples_of_tls_name_files_of_the_units_directory(self):
        for name in ("coordinator", "worker"):
            lines = (HERE / f"{name}.env").read_text().splitlines()
            words = [word for line in lines if line.startswith("#OSTEON") for word in shlex.split(line[1:].replace("=", " "))]
            paths = [word for text in words for word in text.split() if word.startswith("/")]
            self.assertGreaterEqual(len(paths), 3)
            for path in paths:
                self.assertTrue(path.startswith(f"/etc/osteon/{name}/"), path)

    def test_open_files_are_enough_for_all_connections(self):
        for name in UNITS:
            self.assertEqual(unit(name)["Service"]["LimitNOFILE"], "12320")
