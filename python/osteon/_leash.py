"""Runs a program that does not outlive the process which started it: ``_leash.py PID PROGRAM …``.

The system sends it SIGTERM, upon which a worker answers what it holds and leaves, as soon as the process PID
is gone, however that ends. Runs in place of the program, so that nothing waits beside it. Uses the standard
library only, because it is started for each worker."""

import ctypes
import os
import signal
import sys

PR_SET_PDEATHSIG = 1


def main() -> None:
    parent, command = int(sys.argv[1]), sys.argv[2:]
    library = ctypes.CDLL(None, use_errno=True)
    if library.prctl(PR_SET_PDEATHSIG, int(signal.SIGTERM), 0, 0, 0) != 0:
        sys.exit(f"prctl: {os.strerror(ctypes.get_errno())}")
    # It may have ended before the line above.
    if os.getppid() != parent:
        sys.exit("the process that started this one has ended")
    os.execv(command[0], command)


if __name__ == "__main__":
    main()
