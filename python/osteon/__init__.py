"""Elasticity of cortical bone from the velocities of first arriving signals.

    >>> import osteon
    >>> round(osteon.simulate("examples/cases/A.toml").velocity, 1)
    3908.8

:func:`simulate` and :func:`velocities` solve cases, :func:`pick` takes velocities from signals, :func:`ensemble` draws random bones, :class:`Job`
identifies, on this machine or on a cluster, and :class:`Client` speaks to a coordinator. :mod:`osteon.workers`
starts workers inside of Dask and Ray, :mod:`osteon.rpc` helps programs that speak gRPC themselves.
"""

from osteon import workers
from osteon._client import Client
from osteon._jobs import Job
from osteon._native import Case
from osteon._native import version as _version
from osteon._objects import Moments
from osteon._pick import Picks, pick
from osteon._results import Estimate, Group, Result, Tables
from osteon._simulate import Ensemble, Simulation, ensemble, simulate, velocities
from osteon._states import Credentials, JobState
from osteon.errors import (
    CancelledError,
    CoordinatorError,
    InputError,
    JobFailedError,
    OsteonError,
    OsteonWarning,
    ProgramError,
    SimulationError,
    Violation,
)

__version__, NUMERICS_REVISION = _version()

__all__ = [
    "CancelledError",
    "Case",
    "Client",
    "CoordinatorError",
    "Credentials",
    "Ensemble",
    "Estimate",
    "Group",
    "InputError",
    "Job",
    "JobFailedError",
    "JobState",
    "Moments",
    "NUMERICS_REVISION",
    "OsteonError",
    "OsteonWarning",
    "Picks",
    "ProgramError",
    "Result",
    "Simulation",
    "SimulationError",
    "Tables",
    "Violation",
    "__version__",
    "ensemble",
    "pick",
    "simulate",
    "velocities",
    "workers",
]
