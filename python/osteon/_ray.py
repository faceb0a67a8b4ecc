"""Workers of a coordinator inside of a Ray cluster: an actor each, for which Ray reserves the processors."""

from __future__ import annotations

import contextlib
from typing import Any

import ray

from osteon._worker_process import (
    DRAIN_S,
    WorkerPlan,
    WorkerProcess,
    WorkerStatus,
    await_attached,
    differs,
)
from osteon.errors import ProgramError, refuse



class OsteonWorker:
    """The actor."""

    def __init__(self, plan: WorkerPlan, threads: int) -> None:
        self._process = WorkerProcess(plan, threads, ray.util.get_node_ip_address())

    def status(self) -> WorkerStatus:
        """What became of the worker."""
        return self._process.status()

    def drain(self) -> None:
        """Has the worker answer what it holds and leave."""
        self._process.drain()


class RayWorkers:
    """The workers of a coordinator in a Ray cluster; :func:`osteon.workers.ray` makes it."""

    def __init__(self, plan: WorkerPlan, workers: int | None, threads: int, patience: float) -> None:
        if not ray.is_initialized():
            refuse("ray", "this process is in no Ray cluster; call ray.init first")
        if workers is None:
            workers = int(ray.cluster_resources().get("CPU", 0) // threads)
        self._plan = plan
        self._threads = threads
        # An actor whose node dies is started on another.
        self._make = ray.remote(num_cpus=threads, max_restarts=-1)(OsteonWorker)
        self._actors: list[Any] = []
        # Questions that an actor has not answered: it is asked again only after that.
        self._asked: dict[Any, Any] = {}
        try:
            self.scale(workers)
            if patience > 0 and workers > 0:
                await_attached(self._all, plan.coordinator, patience)
        except BaseException:
            # What went wrong first is what matters.
            with contextlib.suppress(Exception):
                self.stop()
            raise

    def _all(self) -> list[WorkerStatus]:
        """The statuses of all workers, also of those that Ray has not placed yet."""
        found = self.statuses()
        absent = WorkerStatus(
            "Ray", 0, self._plan.version, False, None, "Ray has not placed it: too few processors are free"
        )
        return found + [absent] * (len(self._actors) - len(found))

    def statuses(self) -> list[WorkerStatus]:
        """What became of the workers that Ray has placed."""
        asked = {actor: self._asked.get(actor) or actor.status.remote() for actor in self._actors}
        answers = list(asked.values())
        ready, _ = ray.wait(answers, num_returns=len(answers), timeout=1.0) if answers else ([], [])
        self._asked = {actor: answer for actor, answer in asked.items() if answer not in ready}
        found: list[WorkerStatus] = []
        for answer in ready:
            try:
                found.append(ray.get(answer))
            except ray.exceptions.ActorUnavailableError:
                # Its node is gone, or it starts again.
                continue
            except ray.exceptions.RayError as error:
                raise ProgramError(f"an actor of Ray with a worker failed: {error}") from error
        for status in found:
            if status.version != self._plan.version:
                raise ProgramError(differs(status.place, status.version, self._plan.version))
        return found

    def scale(self, workers: int) -> None:
        """Starts workers, or drains some, until there are as many as this.

        More than the cluster has processors for wait until Ray has added nodes.
        """
        if workers < 0:
            refuse("workers", f"is {workers}; it must be 0 or more")
        while len(self._actors) < workers:
            self._actors.append(self._make.remote(self._plan, self._threads))
        leaving, self._actors = self._actors[workers:], self._actors[:workers]
        answers = [actor.drain.remote() for actor in leaving]
        if answers:
            ray.wait(answers, num_returns=len(answers), timeout=DRAIN_S + 10.0)
        for actor in leaving:
            ray.kill(actor)

    def stop(self) -> None:
        """Drains all of them: they answer what they hold, and leave."""
        self.scale(0)

    def __enter__(self) -> RayWorkers:
        return self

    def __exit__(self, *exception: object) -> None:
        self.stop()

    def __repr__(self) -> str:
        return f"<{len(self._actors)} workers in Ray of the coordinator at {self._plan.coordinator}>"
