from osteon.v1 import specification_pb2 as _specification_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class JobStatus(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    JOB_STATUS_UNSPECIFIED: _ClassVar[JobStatus]
    JOB_STATUS_CONVERGED: _ClassVar[JobStatus]
    JOB_STATUS_MAX_EVALUATIONS: _ClassVar[JobStatus]
    JOB_STATUS_CANCELLED: _ClassVar[JobStatus]
    JOB_STATUS_FAILED: _ClassVar[JobStatus]
    JOB_STATUS_NOT_MATCHED: _ClassVar[JobStatus]

class JobFailureKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    JOB_FAILURE_KIND_UNSPECIFIED: _ClassVar[JobFailureKind]
    JOB_FAILURE_KIND_NO_FEASIBLE_POINT: _ClassVar[JobFailureKind]
    JOB_FAILURE_KIND_INTEGRITY_ERROR: _ClassVar[JobFailureKind]
    JOB_FAILURE_KIND_POISON_REALIZATION: _ClassVar[JobFailureKind]
    JOB_FAILURE_KIND_STORE: _ClassVar[JobFailureKind]

class FailureKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    FAILURE_KIND_UNSPECIFIED: _ClassVar[FailureKind]
    FAILURE_KIND_NO_ARRIVAL: _ClassVar[FailureKind]
    FAILURE_KIND_INCONSISTENT_ARRIVAL: _ClassVar[FailureKind]
    FAILURE_KIND_DIRECT_WAVE_FIRST: _ClassVar[FailureKind]
    FAILURE_KIND_NOT_FINITE: _ClassVar[FailureKind]
    FAILURE_KIND_NO_CONVERGENCE: _ClassVar[FailureKind]
JOB_STATUS_UNSPECIFIED: JobStatus
JOB_STATUS_CONVERGED: JobStatus
JOB_STATUS_MAX_EVALUATIONS: JobStatus
JOB_STATUS_CANCELLED: JobStatus
JOB_STATUS_FAILED: JobStatus
JOB_STATUS_NOT_MATCHED: JobStatus
JOB_FAILURE_KIND_UNSPECIFIED: JobFailureKind
JOB_FAILURE_KIND_NO_FEASIBLE_POINT: JobFailureKind
JOB_FAILURE_KIND_INTEGRITY_ERROR: JobFailureKind
JOB_FAILURE_KIND_POISON_REALIZATION: JobFailureKind
JOB_FAILURE_KIND_STORE: JobFailureKind
FAILURE_KIND_UNSPECIFIED: FailureKind
FAILURE_KIND_NO_ARRIVAL: FailureKind
FAILURE_KIND_INCONSISTENT_ARRIVAL: FailureKind
FAILURE_KIND_DIRECT_WAVE_FIRST: FailureKind
FAILURE_KIND_NOT_FINITE: FailureKind
FAILURE_KIND_NO_CONVERGENCE: FailureKind

class Moments(_message.Message):
    __slots__ = ("mean", "coefficient_of_variation")
    MEAN_FIELD_NUMBER: _ClassVar[int]
    COEFFICIENT_OF_VARIATION_FIELD_NUMBER: _ClassVar[int]
    mean: float
    coefficient_of_variation: float
    def __init__(self, mean: _Optional[float] = ..., coefficient_of_variation: _Optional[float] = ...) -> None: ...

class EstimatedError(_message.Message):
    __slots__ = ("median", "largest")
    MEDIAN_FIELD_NUMBER: _ClassVar[int]
    LARGEST_FIELD_NUMBER: _ClassVar[int]
    median: float
    largest: float
    def __init__(self, median: _Optional[float] = ..., largest: _Optional[float] = ...) -> None: ...

class FailureCount(_message.Message):
    __slots__ = ("kind", "count")
    KIND_FIELD_NUMBER: _ClassVar[int]
    COUNT_FIELD_NUMBER: _ClassVar[int]
    kind: FailureKind
    count: int
    def __init__(self, kind: _Optional[_Union[FailureKind, str]] = ..., count: _Optional[int] = ...) -> None: ...

class JobResult(_message.Message):
    __slots__ = ("status", "reason", "json")
    STATUS_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    JSON_FIELD_NUMBER: _ClassVar[int]
    status: JobStatus
    reason: str
    json: str
    def __init__(self, status: _Optional[_Union[JobStatus, str]] = ..., reason: _Optional[str] = ..., json: _Optional[str] = ...) -> None: ...

class GroupResult(_message.Message):
    __slots__ = ("group", "json")
    GROUP_FIELD_NUMBER: _ClassVar[int]
    JSON_FIELD_NUMBER: _ClassVar[int]
    group: int
    json: str
    def __init__(self, group: _Optional[int] = ..., json: _Optional[str] = ...) -> None: ...

class GroupEnding(_message.Message):
    __slots__ = ("status", "reason", "best")
    STATUS_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    BEST_FIELD_NUMBER: _ClassVar[int]
    status: JobStatus
    reason: str
    best: int
    def __init__(self, status: _Optional[_Union[JobStatus, str]] = ..., reason: _Optional[str] = ..., best: _Optional[int] = ...) -> None: ...

class EvaluationRow(_message.Message):
    __slots__ = ("number", "point", "moments", "cost", "failures", "estimated_error", "group", "start", "varied", "posterior", "decay")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    POINT_FIELD_NUMBER: _ClassVar[int]
    MOMENTS_FIELD_NUMBER: _ClassVar[int]
    COST_FIELD_NUMBER: _ClassVar[int]
    FAILURES_FIELD_NUMBER: _ClassVar[int]
    ESTIMATED_ERROR_FIELD_NUMBER: _ClassVar[int]
    GROUP_FIELD_NUMBER: _ClassVar[int]
    START_FIELD_NUMBER: _ClassVar[int]
    VARIED_FIELD_NUMBER: _ClassVar[int]
    POSTERIOR_FIELD_NUMBER: _ClassVar[int]
    DECAY_FIELD_NUMBER: _ClassVar[int]
    number: int
    point: _specification_pb2.ParameterValues
    moments: Moments
    cost: float
    failures: _containers.RepeatedCompositeFieldContainer[FailureCount]
    estimated_error: EstimatedError
    group: int
    start: int
    varied: _specification_pb2.Parameter
    posterior: bool
    decay: float
    def __init__(self, number: _Optional[int] = ..., point: _Optional[_Union[_specification_pb2.ParameterValues, _Mapping]] = ..., moments: _Optional[_Union[Moments, _Mapping]] = ..., cost: _Optional[float] = ..., failures: _Optional[_Iterable[_Union[FailureCount, _Mapping]]] = ..., estimated_error: _Optional[_Union[EstimatedError, _Mapping]] = ..., group: _Optional[int] = ..., start: _Optional[int] = ..., varied: _Optional[_Union[_specification_pb2.Parameter, str]] = ..., posterior: bool = ..., decay: _Optional[float] = ...) -> None: ...

class HistoryBlock(_message.Message):
    __slots__ = ("rows", "groups")
    ROWS_FIELD_NUMBER: _ClassVar[int]
    GROUPS_FIELD_NUMBER: _ClassVar[int]
    rows: _containers.RepeatedCompositeFieldContainer[EvaluationRow]
    groups: _containers.RepeatedCompositeFieldContainer[GroupEnding]
    def __init__(self, rows: _Optional[_Iterable[_Union[EvaluationRow, _Mapping]]] = ..., groups: _Optional[_Iterable[_Union[GroupEnding, _Mapping]]] = ...) -> None: ...

class RealizationBlock(_message.Message):
    __slots__ = ("group", "first", "codes", "velocities")
    GROUP_FIELD_NUMBER: _ClassVar[int]
    FIRST_FIELD_NUMBER: _ClassVar[int]
    CODES_FIELD_NUMBER: _ClassVar[int]
    VELOCITIES_FIELD_NUMBER: _ClassVar[int]
    group: int
    first: int
    codes: bytes
    velocities: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, group: _Optional[int] = ..., first: _Optional[int] = ..., codes: _Optional[bytes] = ..., velocities: _Optional[_Iterable[float]] = ...) -> None: ...

class PosteriorDraw(_message.Message):
    __slots__ = ("point", "log_density", "mean", "coefficient_of_variation")
    POINT_FIELD_NUMBER: _ClassVar[int]
    LOG_DENSITY_FIELD_NUMBER: _ClassVar[int]
    MEAN_FIELD_NUMBER: _ClassVar[int]
    COEFFICIENT_OF_VARIATION_FIELD_NUMBER: _ClassVar[int]
    point: _specification_pb2.ParameterValues
    log_density: float
    mean: float
    coefficient_of_variation: float
    def __init__(self, point: _Optional[_Union[_specification_pb2.ParameterValues, _Mapping]] = ..., log_density: _Optional[float] = ..., mean: _Optional[float] = ..., coefficient_of_variation: _Optional[float] = ...) -> None: ...

class DrawBlock(_message.Message):
    __slots__ = ("group", "first", "draws")
    GROUP_FIELD_NUMBER: _ClassVar[int]
    FIRST_FIELD_NUMBER: _ClassVar[int]
    DRAWS_FIELD_NUMBER: _ClassVar[int]
    group: int
    first: int
    draws: _containers.RepeatedCompositeFieldContainer[PosteriorDraw]
    def __init__(self, group: _Optional[int] = ..., first: _Optional[int] = ..., draws: _Optional[_Iterable[_Union[PosteriorDraw, _Mapping]]] = ...) -> None: ...
