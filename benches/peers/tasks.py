"""The tasks that every peer runs: sleeps, so that only what a system adds takes processor time."""

import json
import time

WORKERS = 2
TASKS = 2747
"""Number of parts of 1 ms; a task consists of one or more of them."""
PART_S = 1e-3


def durations(per_task):
    """Returns the duration of each task in seconds."""
    full, rest = divmod(TASKS, per_task)
    parts = [per_task] * full + ([rest] if rest else [])
    return [part * PART_S for part in parts]


def measured(run, per_task):
    """Runs a few tasks to warm up, then all; returns the time of these in seconds."""
    run([PART_S] * 20)
    begun = time.perf_counter()
    run(durations(per_task))
    return time.perf_counter() - begun


def report(seconds, version):
    """Prints what run.py reads."""
    print(json.dumps({"seconds": seconds, "version": version}), flush=True)
