"""Ray: two processors, so two workers at a time."""

import os
import sys
import time

os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")

import ray
from tasks import WORKERS, measured, report


@ray.remote
def part(seconds):
    time.sleep(seconds)


def run(durations):
    ray.get([part.remote(seconds) for seconds in durations])


def main():
    ray.init(
        num_cpus=WORKERS,
        include_dashboard=False,
        _node_ip_address="127.0.0.1",
        object_store_memory=100 << 20,
        logging_level="error",
    )
    report(measured(run, int(sys.argv[1])), ray.__version__)
    ray.shutdown()


if __name__ == "__main__":
    main()
