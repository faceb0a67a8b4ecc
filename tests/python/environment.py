"""Virtual environments for the tests that are written in Python. Uses the standard library only."""

import hashlib
import shutil
import subprocess
import sys

OLDEST = (3, 10)


def check_version():
    """Ends the program if this Python is too old."""
    if sys.version_info < OLDEST:
        sys.exit(f"Python {sys.version.split()[0]} is too old; {'.'.join(map(str, OLDEST))} is needed")


def make(venv, *requirements):
    """A virtual environment with the requirements of these files; made again when they change. Its Python."""
    python = venv / "bin" / "python"
    contents = [path.read_bytes() for path in requirements]
    wanted = hashlib.sha256(b"".join(contents) + sys.version.encode()).hexdigest()
    stamp = venv / "complete"
    if stamp.is_file() and stamp.read_text() == wanted:
        return python
    try:
        import ensurepip  # noqa: F401
        import venv as _  # noqa: F401
    except ImportError as error:
        sys.exit(f"Python has no module {error.name}; on Debian: apt-get install python3-venv")
    shutil.rmtree(venv, ignore_errors=True)
    run([sys.executable, "-m", "venv", venv])
    install = [python, "-m", "pip", "install", "--quiet", "--only-binary", ":all:"]
    run([*install, *(word for path in requirements for word in ("-r", path))])
    stamp.write_text(wanted)
    return python


def run(command, directory=None, variables=None):
    """Runs a program to its end; its failure is ours."""
    code = subprocess.run(command, cwd=directory, env=variables, check=False).returncode
    if code != 0:
        sys.exit(f"failed: {' '.join(map(str, command))}")
