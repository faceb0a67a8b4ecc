"""HyperQueue: a server and two workers of one core each; a task is a process, as it is meant to be.

Its package for Python has no program: server and workers are threads of this process. A client asks once
a second whether a job has ended; so that this is not measured, a last task, which depends on all others,
tells it through a pipe.
"""

import os
import sys
import tempfile
from importlib.metadata import version

from hyperqueue import Job, LocalCluster
from hyperqueue.cluster import WorkerConfig
from tasks import WORKERS, measured, report


def main():
    with tempfile.TemporaryDirectory() as directory:
        os.chdir(directory)
        with LocalCluster(directory) as cluster:
            for _ in range(WORKERS):
                cluster.start_worker(WorkerConfig(cores=1))
            client = cluster.client()

            def run(durations):
                job = Job()
                # Without files of output, which no other peer writes.
                tasks = [
                    job.program(["sleep", f"{seconds:.3f}"], stdout=None, stderr=None)
                    for seconds in durations
                ]
                os.mkfifo("ended")
                job.program(
                    ["sh", "-c", f"echo > {directory}/ended"], stdout=None, stderr=None, deps=tasks
                )
                client.submit(job)
                with open("ended") as ended:
                    ended.read()
                os.remove("ended")

            report(measured(run, int(sys.argv[1])), version("hyperqueue"))


if __name__ == "__main__":
    main()
