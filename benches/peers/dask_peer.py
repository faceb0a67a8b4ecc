"""Dask: a scheduler and two workers of one thread each, processes of this machine."""

import sys
import time

import distributed
from distributed import Client, LocalCluster
from tasks import WORKERS, measured, report


def main():
    with LocalCluster(
        n_workers=WORKERS, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
    ) as cluster, Client(cluster) as client:

        def run(durations):
            # Impure: equal durations are different tasks.
            client.gather(client.map(time.sleep, durations, pure=False))

        report(measured(run, int(sys.argv[1])), distributed.__version__)


if __name__ == "__main__":
    main()
