"""Workers of a coordinator inside of a Dask or Ray cluster that is there already.

Each is a process of its own (`osteon worker`), a child of the Dask worker or Ray actor. They take batches from
the coordinator, not from Dask or Ray, so that results are the same to the bit as everywhere, and a worker that
dies loses nothing. When the cluster shrinks, they answer what they hold and leave.

The package `osteon` of the same version must be installed where they run, and the coordinator's address must be
reachable from there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from osteon._states import Credentials
from osteon.errors import refuse

if TYPE_CHECKING:
    from osteon._dask import DaskWorkers
    from osteon._ray import RayWorkers

__all__ = ["dask", "ray"]

PATIENCE_S = 30.0
"""Time that workers have to attach."""


def dask(
    client: Any,
    coordinator: str,
    *,
    credentials: Credentials | None = None,
    threads: int | None = None,
    patience: float = PATIENCE_S,
) -> DaskWorkers:
    """Starts a worker in each Dask worker of the client's cluster, also in those that join later.

    Args:
        client: a `distributed.Client`.
        coordinator: URL of the coordinator, as the Dask workers reach it.
        credentials: certificates of the workers (`tls_ca`, `tls_cert`, `tls_key`), as paths where they run.
        threads: number of threads of each; by default that of the Dask worker. Dask does not know of them:
            its own tasks compute on the same cores.
        patience: time within which the present ones must have attached, s; 0 does not wait.

    Returns:
        The workers: `stop()`, or the end of a `with` block, drains them; `statuses()` says what became of each.

    Raises:
        CoordinatorError: the coordinator cannot be reached, or refuses them.
        ProgramError: a Dask worker lacks the package, or has another version.
    """
    from osteon._dask import DaskWorkers
    from osteon._worker_process import WorkerPlan

    check(threads, patience)
    return DaskWorkers(client, WorkerPlan.here(coordinator, credentials), threads, patience)


def ray(
    coordinator: str,
    *,
    workers: int | None = None,
    threads: int = 1,
    credentials: Credentials | None = None,
    patience: float = PATIENCE_S,
) -> RayWorkers:
    """Starts workers in the Ray cluster of this process, for each of which Ray reserves as many processors
    as it has threads.

    Args:
        coordinator: URL of the coordinator, as the nodes reach it.
        workers: how many; by default as many as the cluster has processors for. `scale()` changes it.
        threads: number of threads of each.
        credentials: certificates of the workers (`tls_ca`, `tls_cert`, `tls_key`), as paths where they run.
        patience: time within which they must have attached, s; 0 does not wait.

    Returns:
        The workers: `stop()`, or the end of a `with` block, drains them; `statuses()` says what became of each.

    Raises:
        CoordinatorError: the coordinator cannot be reached, or refuses them.
        ProgramError: a node lacks the package, or has another version.
    """
    from osteon._ray import RayWorkers
    from osteon._worker_process import WorkerPlan

    check(threads, patience)
    return RayWorkers(WorkerPlan.here(coordinator, credentials), workers, threads, patience)


def check(threads: int | None, patience: float) -> None:
    """Checks what both take."""
    if threads is not None and not 1 <= threads <= 4096:
        refuse("threads", f"is {threads}; it must be 1 to 4096")
    if not patience >= 0:
        refuse("patience", f"is {patience}; it must be 0 or more (s)")
