"""xargs: two processes at a time, one for each task."""

import subprocess
import sys

from tasks import WORKERS, measured, report


def run(durations):
    lines = "".join(f"{seconds:.3f}\n" for seconds in durations)
    command = ["xargs", "-P", str(WORKERS), "-n", "1", "sleep"]
    subprocess.run(command, input=lines, text=True, check=True)


def main():
    shown = subprocess.run(["xargs", "--version"], capture_output=True, text=True, check=True)
    report(measured(run, int(sys.argv[1])), shown.stdout.splitlines()[0].split()[-1])


if __name__ == "__main__":
    main()
