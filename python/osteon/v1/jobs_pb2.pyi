from google.protobuf import timestamp_pb2 as _timestamp_pb2
from osteon.v1 import results_pb2 as _results_pb2
from osteon.v1 import specification_pb2 as _specification_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class PaceReason(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    PACE_REASON_UNSPECIFIED: _ClassVar[PaceReason]
    PACE_REASON_ENDED: _ClassVar[PaceReason]
    PACE_REASON_STORE_REFUSES: _ClassVar[PaceReason]
    PACE_REASON_STOPPING: _ClassVar[PaceReason]
    PACE_REASON_WAITING_FOR_TURN: _ClassVar[PaceReason]
    PACE_REASON_READING_STORE: _ClassVar[PaceReason]
    PACE_REASON_STORE_SLOW: _ClassVar[PaceReason]
    PACE_REASON_NO_WORKERS: _ClassVar[PaceReason]
    PACE_REASON_WORKERS_UNAVAILABLE: _ClassVar[PaceReason]
    PACE_REASON_UNRELIABLE_WORKERS: _ClassVar[PaceReason]
    PACE_REASON_DISPUTE: _ClassVar[PaceReason]
    PACE_REASON_LAST_REALIZATIONS: _ClassVar[PaceReason]
    PACE_REASON_OTHER_JOBS: _ClassVar[PaceReason]
    PACE_REASON_FEW_REALIZATIONS: _ClassVar[PaceReason]
    PACE_REASON_COMPUTING: _ClassVar[PaceReason]

class JobState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    JOB_STATE_UNSPECIFIED: _ClassVar[JobState]
    JOB_STATE_WAITING: _ClassVar[JobState]
    JOB_STATE_RUNNING: _ClassVar[JobState]
    JOB_STATE_ENDED: _ClassVar[JobState]

class WorkerState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    WORKER_STATE_UNSPECIFIED: _ClassVar[WorkerState]
    WORKER_STATE_OK: _ClassVar[WorkerState]
    WORKER_STATE_DRAINING: _ClassVar[WorkerState]
    WORKER_STATE_DISTRUSTED: _ClassVar[WorkerState]
    WORKER_STATE_PROBATION: _ClassVar[WorkerState]
PACE_REASON_UNSPECIFIED: PaceReason
PACE_REASON_ENDED: PaceReason
PACE_REASON_STORE_REFUSES: PaceReason
PACE_REASON_STOPPING: PaceReason
PACE_REASON_WAITING_FOR_TURN: PaceReason
PACE_REASON_READING_STORE: PaceReason
PACE_REASON_STORE_SLOW: PaceReason
PACE_REASON_NO_WORKERS: PaceReason
PACE_REASON_WORKERS_UNAVAILABLE: PaceReason
PACE_REASON_UNRELIABLE_WORKERS: PaceReason
PACE_REASON_DISPUTE: PaceReason
PACE_REASON_LAST_REALIZATIONS: PaceReason
PACE_REASON_OTHER_JOBS: PaceReason
PACE_REASON_FEW_REALIZATIONS: PaceReason
PACE_REASON_COMPUTING: PaceReason
JOB_STATE_UNSPECIFIED: JobState
JOB_STATE_WAITING: JobState
JOB_STATE_RUNNING: JobState
JOB_STATE_ENDED: JobState
WORKER_STATE_UNSPECIFIED: WorkerState
WORKER_STATE_OK: WorkerState
WORKER_STATE_DRAINING: WorkerState
WORKER_STATE_DISTRUSTED: WorkerState
WORKER_STATE_PROBATION: WorkerState

class SubmitRequest(_message.Message):
    __slots__ = ("specification", "request_id", "client", "priority", "name")
    SPECIFICATION_FIELD_NUMBER: _ClassVar[int]
    REQUEST_ID_FIELD_NUMBER: _ClassVar[int]
    CLIENT_FIELD_NUMBER: _ClassVar[int]
    PRIORITY_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    specification: _specification_pb2.JobSpecification
    request_id: str
    client: str
    priority: int
    name: str
    def __init__(self, specification: _Optional[_Union[_specification_pb2.JobSpecification, _Mapping]] = ..., request_id: _Optional[str] = ..., client: _Optional[str] = ..., priority: _Optional[int] = ..., name: _Optional[str] = ...) -> None: ...

class SubmitResponse(_message.Message):
    __slots__ = ("job",)
    JOB_FIELD_NUMBER: _ClassVar[int]
    job: str
    def __init__(self, job: _Optional[str] = ...) -> None: ...

class GetRequest(_message.Message):
    __slots__ = ("job",)
    JOB_FIELD_NUMBER: _ClassVar[int]
    job: str
    def __init__(self, job: _Optional[str] = ...) -> None: ...

class GetResponse(_message.Message):
    __slots__ = ("snapshot",)
    SNAPSHOT_FIELD_NUMBER: _ClassVar[int]
    snapshot: JobSnapshot
    def __init__(self, snapshot: _Optional[_Union[JobSnapshot, _Mapping]] = ...) -> None: ...

class ExplainRequest(_message.Message):
    __slots__ = ("job",)
    JOB_FIELD_NUMBER: _ClassVar[int]
    job: str
    def __init__(self, job: _Optional[str] = ...) -> None: ...

class ExplainResponse(_message.Message):
    __slots__ = ("job", "reason", "text", "slots", "slots_used", "realizations", "realizations_left", "realizations_per_second", "expected_s", "waiting_s", "worker")
    JOB_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    SLOTS_FIELD_NUMBER: _ClassVar[int]
    SLOTS_USED_FIELD_NUMBER: _ClassVar[int]
    REALIZATIONS_FIELD_NUMBER: _ClassVar[int]
    REALIZATIONS_LEFT_FIELD_NUMBER: _ClassVar[int]
    REALIZATIONS_PER_SECOND_FIELD_NUMBER: _ClassVar[int]
    EXPECTED_S_FIELD_NUMBER: _ClassVar[int]
    WAITING_S_FIELD_NUMBER: _ClassVar[int]
    WORKER_FIELD_NUMBER: _ClassVar[int]
    job: str
    reason: PaceReason
    text: str
    slots: int
    slots_used: float
    realizations: int
    realizations_left: int
    realizations_per_second: float
    expected_s: float
    waiting_s: float
    worker: int
    def __init__(self, job: _Optional[str] = ..., reason: _Optional[_Union[PaceReason, str]] = ..., text: _Optional[str] = ..., slots: _Optional[int] = ..., slots_used: _Optional[float] = ..., realizations: _Optional[int] = ..., realizations_left: _Optional[int] = ..., realizations_per_second: _Optional[float] = ..., expected_s: _Optional[float] = ..., waiting_s: _Optional[float] = ..., worker: _Optional[int] = ...) -> None: ...

class ListRequest(_message.Message):
    __slots__ = ("page_size", "page_token")
    PAGE_SIZE_FIELD_NUMBER: _ClassVar[int]
    PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    page_size: int
    page_token: str
    def __init__(self, page_size: _Optional[int] = ..., page_token: _Optional[str] = ...) -> None: ...

class ListResponse(_message.Message):
    __slots__ = ("jobs", "next_page_token", "concerns")
    JOBS_FIELD_NUMBER: _ClassVar[int]
    NEXT_PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    CONCERNS_FIELD_NUMBER: _ClassVar[int]
    jobs: _containers.RepeatedCompositeFieldContainer[JobSnapshot]
    next_page_token: str
    concerns: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, jobs: _Optional[_Iterable[_Union[JobSnapshot, _Mapping]]] = ..., next_page_token: _Optional[str] = ..., concerns: _Optional[_Iterable[str]] = ...) -> None: ...

class WatchRequest(_message.Message):
    __slots__ = ("job", "after")
    JOB_FIELD_NUMBER: _ClassVar[int]
    AFTER_FIELD_NUMBER: _ClassVar[int]
    job: str
    after: int
    def __init__(self, job: _Optional[str] = ..., after: _Optional[int] = ...) -> None: ...

class WatchResponse(_message.Message):
    __slots__ = ("snapshot",)
    SNAPSHOT_FIELD_NUMBER: _ClassVar[int]
    snapshot: JobSnapshot
    def __init__(self, snapshot: _Optional[_Union[JobSnapshot, _Mapping]] = ...) -> None: ...

class CancelRequest(_message.Message):
    __slots__ = ("job",)
    JOB_FIELD_NUMBER: _ClassVar[int]
    job: str
    def __init__(self, job: _Optional[str] = ...) -> None: ...

class CancelResponse(_message.Message):
    __slots__ = ("snapshot",)
    SNAPSHOT_FIELD_NUMBER: _ClassVar[int]
    snapshot: JobSnapshot
    def __init__(self, snapshot: _Optional[_Union[JobSnapshot, _Mapping]] = ...) -> None: ...

class FetchRequest(_message.Message):
    __slots__ = ("job",)
    JOB_FIELD_NUMBER: _ClassVar[int]
    job: str
    def __init__(self, job: _Optional[str] = ...) -> None: ...

class FetchResponse(_message.Message):
    __slots__ = ("specification", "result", "history", "group", "realizations", "draws")
    SPECIFICATION_FIELD_NUMBER: _ClassVar[int]
    RESULT_FIELD_NUMBER: _ClassVar[int]
    HISTORY_FIELD_NUMBER: _ClassVar[int]
    GROUP_FIELD_NUMBER: _ClassVar[int]
    REALIZATIONS_FIELD_NUMBER: _ClassVar[int]
    DRAWS_FIELD_NUMBER: _ClassVar[int]
    specification: _specification_pb2.JobSpecification
    result: _results_pb2.JobResult
    history: _results_pb2.HistoryBlock
    group: _results_pb2.GroupResult
    realizations: _results_pb2.RealizationBlock
    draws: _results_pb2.DrawBlock
    def __init__(self, specification: _Optional[_Union[_specification_pb2.JobSpecification, _Mapping]] = ..., result: _Optional[_Union[_results_pb2.JobResult, _Mapping]] = ..., history: _Optional[_Union[_results_pb2.HistoryBlock, _Mapping]] = ..., group: _Optional[_Union[_results_pb2.GroupResult, _Mapping]] = ..., realizations: _Optional[_Union[_results_pb2.RealizationBlock, _Mapping]] = ..., draws: _Optional[_Union[_results_pb2.DrawBlock, _Mapping]] = ...) -> None: ...

class PruneRequest(_message.Message):
    __slots__ = ("keep_for_s", "keep_last")
    KEEP_FOR_S_FIELD_NUMBER: _ClassVar[int]
    KEEP_LAST_FIELD_NUMBER: _ClassVar[int]
    keep_for_s: float
    keep_last: int
    def __init__(self, keep_for_s: _Optional[float] = ..., keep_last: _Optional[int] = ...) -> None: ...

class PruneResponse(_message.Message):
    __slots__ = ("jobs",)
    JOBS_FIELD_NUMBER: _ClassVar[int]
    jobs: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, jobs: _Optional[_Iterable[str]] = ...) -> None: ...

class ListBansRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class ListBansResponse(_message.Message):
    __slots__ = ("workers",)
    WORKERS_FIELD_NUMBER: _ClassVar[int]
    workers: _containers.RepeatedCompositeFieldContainer[BannedWorker]
    def __init__(self, workers: _Optional[_Iterable[_Union[BannedWorker, _Mapping]]] = ...) -> None: ...

class BannedWorker(_message.Message):
    __slots__ = ("host", "process", "job", "reason", "elapsed_s")
    HOST_FIELD_NUMBER: _ClassVar[int]
    PROCESS_FIELD_NUMBER: _ClassVar[int]
    JOB_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    ELAPSED_S_FIELD_NUMBER: _ClassVar[int]
    host: str
    process: int
    job: str
    reason: str
    elapsed_s: float
    def __init__(self, host: _Optional[str] = ..., process: _Optional[int] = ..., job: _Optional[str] = ..., reason: _Optional[str] = ..., elapsed_s: _Optional[float] = ...) -> None: ...

class LiftBanRequest(_message.Message):
    __slots__ = ("host",)
    HOST_FIELD_NUMBER: _ClassVar[int]
    host: str
    def __init__(self, host: _Optional[str] = ...) -> None: ...

class LiftBanResponse(_message.Message):
    __slots__ = ("worker",)
    WORKER_FIELD_NUMBER: _ClassVar[int]
    worker: BannedWorker
    def __init__(self, worker: _Optional[_Union[BannedWorker, _Mapping]] = ...) -> None: ...

class RecheckRequest(_message.Message):
    __slots__ = ("job",)
    JOB_FIELD_NUMBER: _ClassVar[int]
    job: str
    def __init__(self, job: _Optional[str] = ...) -> None: ...

class RecheckResponse(_message.Message):
    __slots__ = ("snapshot",)
    SNAPSHOT_FIELD_NUMBER: _ClassVar[int]
    snapshot: JobSnapshot
    def __init__(self, snapshot: _Optional[_Union[JobSnapshot, _Mapping]] = ...) -> None: ...

class JobSnapshot(_message.Message):
    __slots__ = ("job", "kind", "state", "status", "reason", "evaluations", "max_evaluations", "realizations_done", "realizations", "best_cost", "best_mean", "best_coefficient_of_variation", "realizations_per_second", "workers", "elapsed_s", "waiting_for", "sequence", "failure", "client", "name", "priority", "submit_time", "end_time", "integrity")
    JOB_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    STATUS_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    EVALUATIONS_FIELD_NUMBER: _ClassVar[int]
    MAX_EVALUATIONS_FIELD_NUMBER: _ClassVar[int]
    REALIZATIONS_DONE_FIELD_NUMBER: _ClassVar[int]
    REALIZATIONS_FIELD_NUMBER: _ClassVar[int]
    BEST_COST_FIELD_NUMBER: _ClassVar[int]
    BEST_MEAN_FIELD_NUMBER: _ClassVar[int]
    BEST_COEFFICIENT_OF_VARIATION_FIELD_NUMBER: _ClassVar[int]
    REALIZATIONS_PER_SECOND_FIELD_NUMBER: _ClassVar[int]
    WORKERS_FIELD_NUMBER: _ClassVar[int]
    ELAPSED_S_FIELD_NUMBER: _ClassVar[int]
    WAITING_FOR_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    FAILURE_FIELD_NUMBER: _ClassVar[int]
    CLIENT_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    PRIORITY_FIELD_NUMBER: _ClassVar[int]
    SUBMIT_TIME_FIELD_NUMBER: _ClassVar[int]
    END_TIME_FIELD_NUMBER: _ClassVar[int]
    INTEGRITY_FIELD_NUMBER: _ClassVar[int]
    job: str
    kind: _specification_pb2.JobKind
    state: JobState
    status: _results_pb2.JobStatus
    reason: str
    evaluations: int
    max_evaluations: int
    realizations_done: int
    realizations: int
    best_cost: float
    best_mean: float
    best_coefficient_of_variation: float
    realizations_per_second: float
    workers: int
    elapsed_s: float
    waiting_for: str
    sequence: int
    failure: _results_pb2.JobFailureKind
    client: str
    name: str
    priority: int
    submit_time: _timestamp_pb2.Timestamp
    end_time: _timestamp_pb2.Timestamp
    integrity: str
    def __init__(self, job: _Optional[str] = ..., kind: _Optional[_Union[_specification_pb2.JobKind, str]] = ..., state: _Optional[_Union[JobState, str]] = ..., status: _Optional[_Union[_results_pb2.JobStatus, str]] = ..., reason: _Optional[str] = ..., evaluations: _Optional[int] = ..., max_evaluations: _Optional[int] = ..., realizations_done: _Optional[int] = ..., realizations: _Optional[int] = ..., best_cost: _Optional[float] = ..., best_mean: _Optional[float] = ..., best_coefficient_of_variation: _Optional[float] = ..., realizations_per_second: _Optional[float] = ..., workers: _Optional[int] = ..., elapsed_s: _Optional[float] = ..., waiting_for: _Optional[str] = ..., sequence: _Optional[int] = ..., failure: _Optional[_Union[_results_pb2.JobFailureKind, str]] = ..., client: _Optional[str] = ..., name: _Optional[str] = ..., priority: _Optional[int] = ..., submit_time: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., end_time: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., integrity: _Optional[str] = ...) -> None: ...

class ListWorkersRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class ListWorkersResponse(_message.Message):
    __slots__ = ("workers", "departed")
    WORKERS_FIELD_NUMBER: _ClassVar[int]
    DEPARTED_FIELD_NUMBER: _ClassVar[int]
    workers: _containers.RepeatedCompositeFieldContainer[WorkerSnapshot]
    departed: _containers.RepeatedCompositeFieldContainer[DepartedWorker]
    def __init__(self, workers: _Optional[_Iterable[_Union[WorkerSnapshot, _Mapping]]] = ..., departed: _Optional[_Iterable[_Union[DepartedWorker, _Mapping]]] = ...) -> None: ...

class DrainWorkerRequest(_message.Message):
    __slots__ = ("worker",)
    WORKER_FIELD_NUMBER: _ClassVar[int]
    worker: int
    def __init__(self, worker: _Optional[int] = ...) -> None: ...

class DrainWorkerResponse(_message.Message):
    __slots__ = ("worker",)
    WORKER_FIELD_NUMBER: _ClassVar[int]
    worker: WorkerSnapshot
    def __init__(self, worker: _Optional[_Union[WorkerSnapshot, _Mapping]] = ...) -> None: ...

class WorkerSnapshot(_message.Message):
    __slots__ = ("worker", "host", "process", "slots", "version", "attach_time", "silent_s", "realizations_per_second", "batches", "oldest_batch_s", "state")
    WORKER_FIELD_NUMBER: _ClassVar[int]
    HOST_FIELD_NUMBER: _ClassVar[int]
    PROCESS_FIELD_NUMBER: _ClassVar[int]
    SLOTS_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    ATTACH_TIME_FIELD_NUMBER: _ClassVar[int]
    SILENT_S_FIELD_NUMBER: _ClassVar[int]
    REALIZATIONS_PER_SECOND_FIELD_NUMBER: _ClassVar[int]
    BATCHES_FIELD_NUMBER: _ClassVar[int]
    OLDEST_BATCH_S_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    worker: int
    host: str
    process: int
    slots: int
    version: str
    attach_time: _timestamp_pb2.Timestamp
    silent_s: float
    realizations_per_second: float
    batches: int
    oldest_batch_s: float
    state: WorkerState
    def __init__(self, worker: _Optional[int] = ..., host: _Optional[str] = ..., process: _Optional[int] = ..., slots: _Optional[int] = ..., version: _Optional[str] = ..., attach_time: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., silent_s: _Optional[float] = ..., realizations_per_second: _Optional[float] = ..., batches: _Optional[int] = ..., oldest_batch_s: _Optional[float] = ..., state: _Optional[_Union[WorkerState, str]] = ...) -> None: ...

class DepartedWorker(_message.Message):
    __slots__ = ("worker", "host", "process", "depart_time", "reason", "batches")
    WORKER_FIELD_NUMBER: _ClassVar[int]
    HOST_FIELD_NUMBER: _ClassVar[int]
    PROCESS_FIELD_NUMBER: _ClassVar[int]
    DEPART_TIME_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    BATCHES_FIELD_NUMBER: _ClassVar[int]
    worker: int
    host: str
    process: int
    depart_time: _timestamp_pb2.Timestamp
    reason: str
    batches: int
    def __init__(self, worker: _Optional[int] = ..., host: _Optional[str] = ..., process: _Optional[int] = ..., depart_time: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., reason: _Optional[str] = ..., batches: _Optional[int] = ...) -> None: ...

class BackupRequest(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class BackupResponse(_message.Message):
    __slots__ = ("data", "end")
    DATA_FIELD_NUMBER: _ClassVar[int]
    END_FIELD_NUMBER: _ClassVar[int]
    data: bytes
    end: BackupEnd
    def __init__(self, data: _Optional[bytes] = ..., end: _Optional[_Union[BackupEnd, _Mapping]] = ...) -> None: ...

class BackupEnd(_message.Message):
    __slots__ = ("length", "digest")
    LENGTH_FIELD_NUMBER: _ClassVar[int]
    DIGEST_FIELD_NUMBER: _ClassVar[int]
    length: int
    digest: str
    def __init__(self, length: _Optional[int] = ..., digest: _Optional[str] = ...) -> None: ...
