"""Workers of a coordinator inside of Dask workers: a plugin of Dask's, which is on present and future ones."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.metadata
import uuid
from typing import Any

import distributed

from osteon._worker_process import (
    WorkerPlan,
    WorkerProcess,
    WorkerStatus,
    await_attached,
    differs,
)
from osteon.errors import ProgramError


class OsteonWorkers(distributed.WorkerPlugin):
    """Starts a worker when a Dask worker starts, and drains it when that is retired."""

    def __init__(self, plan: WorkerPlan, threads: int | None, name: str) -> None:
        self.plan = plan
        self.threads = threads
        self.name = name
        self.process: WorkerProcess | None = None

    def setup(self, worker: Any) -> None:
        """Dask calls it at the start of a worker."""
        threads = self.threads or worker.state.nthreads
        self.process = WorkerProcess(self.plan, threads, worker.address)

    async def teardown(self, worker: Any) -> None:
        """Dask calls it when a worker is retired, or the plugin is taken away."""
        process, self.process = self.process, None
        if process is not None:
            await asyncio.get_running_loop().run_in_executor(None, process.drain)


def status_on(name: str, dask_worker: Any = None) -> WorkerStatus | None:
    """What became of the worker there; runs on a Dask worker."""
    plugin = dask_worker.plugins.get(name)
    process = None if plugin is None else plugin.process
    return None if process is None else process.status()


class DaskWorkers:
    """The workers of a coordinator in a Dask cluster; :func:`osteon.workers.dask` makes it."""

    def __init__(
        self,
        client: Any,
        plan: WorkerPlan,
        threads: int | None,
        patience: float,
    ) -> None:
        check_versions(client, plan.version)
        self._client = client
        self._name = f"osteon-{uuid.uuid4().hex}"
        self._coordinator = plan.coordinator
        self._stopped = False
        try:
            client.register_plugin(OsteonWorkers(plan, threads, self._name), name=self._name)
            if patience > 0 and client.scheduler_info(n_workers=-1)["workers"]:
                await_attached(self.statuses, plan.coordinator, patience)
        except BaseException:
            # What went wrong first is what matters.
            with contextlib.suppress(Exception):
                self.stop()
            raise

    def statuses(self) -> list[WorkerStatus]:
        """What became of the worker in each Dask worker."""
        found = self._client.run(status_on, self._name, on_error="ignore")
        return [status for status in found.values() if isinstance(status, WorkerStatus)]

    def stop(self) -> None:
        """Drains all of them: they answer what they hold, and leave. A second call does nothing."""
        if self._stopped:
            return
        self._stopped = True
        self._client.unregister_worker_plugin(self._name)

    def __enter__(self) -> DaskWorkers:
        return self

    def __exit__(self, *exception: object) -> None:
        self.stop()

    def __repr__(self) -> str:
        return f"<Workers in {self._client} of the coordinator at {self._coordinator}>"


def check_versions(client: Any, expected: str) -> None:
    """Checks that each Dask worker has this version of the package."""
    # A function of the standard library, so that it can be called where there is no osteon.
    found = client.run(importlib.metadata.version, "osteon", on_error="return")
    for address, version in found.items():
        if isinstance(version, importlib.metadata.PackageNotFoundError):
            raise ProgramError(
                f"the Dask worker {address} has no package osteon: install osteon {expected} there"
            )
        if isinstance(version, BaseException):
            raise ProgramError(f"the Dask worker {address} failed: {version!r}") from version
        if version != expected:
            raise ProgramError(differs(f"the Dask worker {address}", version, expected))
