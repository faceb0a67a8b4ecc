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

class PointMeaning(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    POINT_MEANING_UNSPECIFIED: _ClassVar[PointMeaning]
    POINT_MEANING_LEAST_COST: _ClassVar[PointMeaning]
    POINT_MEANING_SIMPLEX_END: _ClassVar[PointMeaning]
    POINT_MEANING_NEAREST_TO_START: _ClassVar[PointMeaning]
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
POINT_MEANING_UNSPECIFIED: PointMeaning
POINT_MEANING_LEAST_COST: PointMeaning
POINT_MEANING_SIMPLEX_END: PointMeaning
POINT_MEANING_NEAREST_TO_START: PointMeaning

class Moments(_message.Message):
    __slots__ = ("mean", "coefficient_of_variation")
    MEAN_FIELD_NUMBER: _ClassVar[int]
    COEFFICIENT_OF_VARIATION_FIELD_NUMBER: _ClassVar[int]
    mean: float
    coefficient_of_variation: float
    def __init__(self, mean: _Optional[float] = ..., coefficient_of_variation: _Optional[float] = ...) -> None: ...

class Estimate(_message.Message):
    __slots__ = ("moments", "standard_error", "controlled")
    MOMENTS_FIELD_NUMBER: _ClassVar[int]
    STANDARD_ERROR_FIELD_NUMBER: _ClassVar[int]
    CONTROLLED_FIELD_NUMBER: _ClassVar[int]
    moments: Moments
    standard_error: Moments
    controlled: bool
    def __init__(self, moments: _Optional[_Union[Moments, _Mapping]] = ..., standard_error: _Optional[_Union[Moments, _Mapping]] = ..., controlled: bool = ...) -> None: ...

class DecayEstimate(_message.Message):
    __slots__ = ("mean", "standard_deviation", "standard_error")
    MEAN_FIELD_NUMBER: _ClassVar[int]
    STANDARD_DEVIATION_FIELD_NUMBER: _ClassVar[int]
    STANDARD_ERROR_FIELD_NUMBER: _ClassVar[int]
    mean: float
    standard_deviation: float
    standard_error: float
    def __init__(self, mean: _Optional[float] = ..., standard_deviation: _Optional[float] = ..., standard_error: _Optional[float] = ...) -> None: ...

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

class Interval(_message.Message):
    __slots__ = ("lower", "upper")
    LOWER_FIELD_NUMBER: _ClassVar[int]
    UPPER_FIELD_NUMBER: _ClassVar[int]
    lower: float
    upper: float
    def __init__(self, lower: _Optional[float] = ..., upper: _Optional[float] = ...) -> None: ...

class BestPoint(_message.Message):
    __slots__ = ("point", "meaning", "cost", "cost_error", "penalty", "below_noise_from", "velocity", "failure_bias", "kolmogorov", "failures", "estimated_error", "decay")
    POINT_FIELD_NUMBER: _ClassVar[int]
    MEANING_FIELD_NUMBER: _ClassVar[int]
    COST_FIELD_NUMBER: _ClassVar[int]
    COST_ERROR_FIELD_NUMBER: _ClassVar[int]
    PENALTY_FIELD_NUMBER: _ClassVar[int]
    BELOW_NOISE_FROM_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_FIELD_NUMBER: _ClassVar[int]
    FAILURE_BIAS_FIELD_NUMBER: _ClassVar[int]
    KOLMOGOROV_FIELD_NUMBER: _ClassVar[int]
    FAILURES_FIELD_NUMBER: _ClassVar[int]
    ESTIMATED_ERROR_FIELD_NUMBER: _ClassVar[int]
    DECAY_FIELD_NUMBER: _ClassVar[int]
    point: _specification_pb2.ParameterValues
    meaning: PointMeaning
    cost: float
    cost_error: float
    penalty: float
    below_noise_from: int
    velocity: Estimate
    failure_bias: Moments
    kolmogorov: KolmogorovTest
    failures: _containers.RepeatedCompositeFieldContainer[FailureCount]
    estimated_error: EstimatedError
    decay: DecayEstimate
    def __init__(self, point: _Optional[_Union[_specification_pb2.ParameterValues, _Mapping]] = ..., meaning: _Optional[_Union[PointMeaning, str]] = ..., cost: _Optional[float] = ..., cost_error: _Optional[float] = ..., penalty: _Optional[float] = ..., below_noise_from: _Optional[int] = ..., velocity: _Optional[_Union[Estimate, _Mapping]] = ..., failure_bias: _Optional[_Union[Moments, _Mapping]] = ..., kolmogorov: _Optional[_Union[KolmogorovTest, _Mapping]] = ..., failures: _Optional[_Iterable[_Union[FailureCount, _Mapping]]] = ..., estimated_error: _Optional[_Union[EstimatedError, _Mapping]] = ..., decay: _Optional[_Union[DecayEstimate, _Mapping]] = ...) -> None: ...

class KolmogorovTest(_message.Message):
    __slots__ = ("distance", "p_value")
    DISTANCE_FIELD_NUMBER: _ClassVar[int]
    P_VALUE_FIELD_NUMBER: _ClassVar[int]
    distance: float
    p_value: float
    def __init__(self, distance: _Optional[float] = ..., p_value: _Optional[float] = ...) -> None: ...

class DataSummary(_message.Message):
    __slots__ = ("moments", "count", "intervals", "outliers", "outlier_count", "rounding", "decay")
    MOMENTS_FIELD_NUMBER: _ClassVar[int]
    COUNT_FIELD_NUMBER: _ClassVar[int]
    INTERVALS_FIELD_NUMBER: _ClassVar[int]
    OUTLIERS_FIELD_NUMBER: _ClassVar[int]
    OUTLIER_COUNT_FIELD_NUMBER: _ClassVar[int]
    ROUNDING_FIELD_NUMBER: _ClassVar[int]
    DECAY_FIELD_NUMBER: _ClassVar[int]
    moments: Moments
    count: int
    intervals: MomentIntervals
    outliers: _containers.RepeatedCompositeFieldContainer[Outlier]
    outlier_count: int
    rounding: float
    decay: DecayEstimate
    def __init__(self, moments: _Optional[_Union[Moments, _Mapping]] = ..., count: _Optional[int] = ..., intervals: _Optional[_Union[MomentIntervals, _Mapping]] = ..., outliers: _Optional[_Iterable[_Union[Outlier, _Mapping]]] = ..., outlier_count: _Optional[int] = ..., rounding: _Optional[float] = ..., decay: _Optional[_Union[DecayEstimate, _Mapping]] = ...) -> None: ...

class Outlier(_message.Message):
    __slots__ = ("index", "velocity", "deviations")
    INDEX_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_FIELD_NUMBER: _ClassVar[int]
    DEVIATIONS_FIELD_NUMBER: _ClassVar[int]
    index: int
    velocity: float
    deviations: float
    def __init__(self, index: _Optional[int] = ..., velocity: _Optional[float] = ..., deviations: _Optional[float] = ...) -> None: ...

class MomentIntervals(_message.Message):
    __slots__ = ("mean", "coefficient_of_variation", "level")
    MEAN_FIELD_NUMBER: _ClassVar[int]
    COEFFICIENT_OF_VARIATION_FIELD_NUMBER: _ClassVar[int]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    mean: Interval
    coefficient_of_variation: Interval
    level: float
    def __init__(self, mean: _Optional[_Union[Interval, _Mapping]] = ..., coefficient_of_variation: _Optional[_Union[Interval, _Mapping]] = ..., level: _Optional[float] = ...) -> None: ...

class Sensitivity(_message.Message):
    __slots__ = ("parameter", "mean", "coefficient_of_variation", "decay")
    PARAMETER_FIELD_NUMBER: _ClassVar[int]
    MEAN_FIELD_NUMBER: _ClassVar[int]
    COEFFICIENT_OF_VARIATION_FIELD_NUMBER: _ClassVar[int]
    DECAY_FIELD_NUMBER: _ClassVar[int]
    parameter: _specification_pb2.Parameter
    mean: float
    coefficient_of_variation: float
    decay: float
    def __init__(self, parameter: _Optional[_Union[_specification_pb2.Parameter, str]] = ..., mean: _Optional[float] = ..., coefficient_of_variation: _Optional[float] = ..., decay: _Optional[float] = ...) -> None: ...

class Identified(_message.Message):
    __slots__ = ("matched", "level", "data_noise", "sampling_noise", "bulk_velocity", "dispersion", "parameters", "directions", "free_directions")
    MATCHED_FIELD_NUMBER: _ClassVar[int]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    DATA_NOISE_FIELD_NUMBER: _ClassVar[int]
    SAMPLING_NOISE_FIELD_NUMBER: _ClassVar[int]
    BULK_VELOCITY_FIELD_NUMBER: _ClassVar[int]
    DISPERSION_FIELD_NUMBER: _ClassVar[int]
    PARAMETERS_FIELD_NUMBER: _ClassVar[int]
    DIRECTIONS_FIELD_NUMBER: _ClassVar[int]
    FREE_DIRECTIONS_FIELD_NUMBER: _ClassVar[int]
    matched: bool
    level: float
    data_noise: Moments
    sampling_noise: Moments
    bulk_velocity: Quantity
    dispersion: Quantity
    parameters: _containers.RepeatedCompositeFieldContainer[ParameterQuantity]
    directions: _containers.RepeatedCompositeFieldContainer[Direction]
    free_directions: _containers.RepeatedCompositeFieldContainer[_specification_pb2.ParameterValues]
    def __init__(self, matched: bool = ..., level: _Optional[float] = ..., data_noise: _Optional[_Union[Moments, _Mapping]] = ..., sampling_noise: _Optional[_Union[Moments, _Mapping]] = ..., bulk_velocity: _Optional[_Union[Quantity, _Mapping]] = ..., dispersion: _Optional[_Union[Quantity, _Mapping]] = ..., parameters: _Optional[_Iterable[_Union[ParameterQuantity, _Mapping]]] = ..., directions: _Optional[_Iterable[_Union[Direction, _Mapping]]] = ..., free_directions: _Optional[_Iterable[_Union[_specification_pb2.ParameterValues, _Mapping]]] = ...) -> None: ...

class Quantity(_message.Message):
    __slots__ = ("value", "standard_error", "interval", "free_share")
    VALUE_FIELD_NUMBER: _ClassVar[int]
    STANDARD_ERROR_FIELD_NUMBER: _ClassVar[int]
    INTERVAL_FIELD_NUMBER: _ClassVar[int]
    FREE_SHARE_FIELD_NUMBER: _ClassVar[int]
    value: float
    standard_error: float
    interval: Interval
    free_share: float
    def __init__(self, value: _Optional[float] = ..., standard_error: _Optional[float] = ..., interval: _Optional[_Union[Interval, _Mapping]] = ..., free_share: _Optional[float] = ...) -> None: ...

class ParameterQuantity(_message.Message):
    __slots__ = ("parameter", "quantity")
    PARAMETER_FIELD_NUMBER: _ClassVar[int]
    QUANTITY_FIELD_NUMBER: _ClassVar[int]
    parameter: _specification_pb2.Parameter
    quantity: Quantity
    def __init__(self, parameter: _Optional[_Union[_specification_pb2.Parameter, str]] = ..., quantity: _Optional[_Union[Quantity, _Mapping]] = ...) -> None: ...

class Direction(_message.Message):
    __slots__ = ("singular_value", "components")
    SINGULAR_VALUE_FIELD_NUMBER: _ClassVar[int]
    COMPONENTS_FIELD_NUMBER: _ClassVar[int]
    singular_value: float
    components: _specification_pb2.ParameterValues
    def __init__(self, singular_value: _Optional[float] = ..., components: _Optional[_Union[_specification_pb2.ParameterValues, _Mapping]] = ...) -> None: ...

class Profile(_message.Message):
    __slots__ = ("parameter", "values", "costs")
    PARAMETER_FIELD_NUMBER: _ClassVar[int]
    VALUES_FIELD_NUMBER: _ClassVar[int]
    COSTS_FIELD_NUMBER: _ClassVar[int]
    parameter: _specification_pb2.Parameter
    values: _containers.RepeatedScalarFieldContainer[float]
    costs: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, parameter: _Optional[_Union[_specification_pb2.Parameter, str]] = ..., values: _Optional[_Iterable[float]] = ..., costs: _Optional[_Iterable[float]] = ...) -> None: ...

class Solutions(_message.Message):
    __slots__ = ("points", "matching", "parameters", "mandel")
    POINTS_FIELD_NUMBER: _ClassVar[int]
    MATCHING_FIELD_NUMBER: _ClassVar[int]
    PARAMETERS_FIELD_NUMBER: _ClassVar[int]
    MANDEL_FIELD_NUMBER: _ClassVar[int]
    points: _containers.RepeatedCompositeFieldContainer[Solution]
    matching: int
    parameters: _containers.RepeatedCompositeFieldContainer[ParameterSpread]
    mandel: _containers.RepeatedCompositeFieldContainer[EntrySpread]
    def __init__(self, points: _Optional[_Iterable[_Union[Solution, _Mapping]]] = ..., matching: _Optional[int] = ..., parameters: _Optional[_Iterable[_Union[ParameterSpread, _Mapping]]] = ..., mandel: _Optional[_Iterable[_Union[EntrySpread, _Mapping]]] = ...) -> None: ...

class Solution(_message.Message):
    __slots__ = ("start", "point", "cost", "evaluations")
    START_FIELD_NUMBER: _ClassVar[int]
    POINT_FIELD_NUMBER: _ClassVar[int]
    COST_FIELD_NUMBER: _ClassVar[int]
    EVALUATIONS_FIELD_NUMBER: _ClassVar[int]
    start: int
    point: _specification_pb2.ParameterValues
    cost: float
    evaluations: int
    def __init__(self, start: _Optional[int] = ..., point: _Optional[_Union[_specification_pb2.ParameterValues, _Mapping]] = ..., cost: _Optional[float] = ..., evaluations: _Optional[int] = ...) -> None: ...

class Spread(_message.Message):
    __slots__ = ("smallest", "largest", "mean")
    SMALLEST_FIELD_NUMBER: _ClassVar[int]
    LARGEST_FIELD_NUMBER: _ClassVar[int]
    MEAN_FIELD_NUMBER: _ClassVar[int]
    smallest: float
    largest: float
    mean: float
    def __init__(self, smallest: _Optional[float] = ..., largest: _Optional[float] = ..., mean: _Optional[float] = ...) -> None: ...

class ParameterSpread(_message.Message):
    __slots__ = ("parameter", "spread")
    PARAMETER_FIELD_NUMBER: _ClassVar[int]
    SPREAD_FIELD_NUMBER: _ClassVar[int]
    parameter: _specification_pb2.Parameter
    spread: Spread
    def __init__(self, parameter: _Optional[_Union[_specification_pb2.Parameter, str]] = ..., spread: _Optional[_Union[Spread, _Mapping]] = ...) -> None: ...

class EntrySpread(_message.Message):
    __slots__ = ("row", "column", "spread")
    ROW_FIELD_NUMBER: _ClassVar[int]
    COLUMN_FIELD_NUMBER: _ClassVar[int]
    SPREAD_FIELD_NUMBER: _ClassVar[int]
    row: int
    column: int
    spread: Spread
    def __init__(self, row: _Optional[int] = ..., column: _Optional[int] = ..., spread: _Optional[_Union[Spread, _Mapping]] = ...) -> None: ...

class Posterior(_message.Message):
    __slots__ = ("converged", "reason", "evaluations", "effective_draws", "checked_draws", "model_error", "check_efficiency", "pareto_k", "sampling_error", "parameters", "correlations", "bulk_velocity", "mean", "coefficient_of_variation", "mandel", "predictive_p_value", "draws", "outlier_share")
    CONVERGED_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    EVALUATIONS_FIELD_NUMBER: _ClassVar[int]
    EFFECTIVE_DRAWS_FIELD_NUMBER: _ClassVar[int]
    CHECKED_DRAWS_FIELD_NUMBER: _ClassVar[int]
    MODEL_ERROR_FIELD_NUMBER: _ClassVar[int]
    CHECK_EFFICIENCY_FIELD_NUMBER: _ClassVar[int]
    PARETO_K_FIELD_NUMBER: _ClassVar[int]
    SAMPLING_ERROR_FIELD_NUMBER: _ClassVar[int]
    PARAMETERS_FIELD_NUMBER: _ClassVar[int]
    CORRELATIONS_FIELD_NUMBER: _ClassVar[int]
    BULK_VELOCITY_FIELD_NUMBER: _ClassVar[int]
    MEAN_FIELD_NUMBER: _ClassVar[int]
    COEFFICIENT_OF_VARIATION_FIELD_NUMBER: _ClassVar[int]
    MANDEL_FIELD_NUMBER: _ClassVar[int]
    PREDICTIVE_P_VALUE_FIELD_NUMBER: _ClassVar[int]
    DRAWS_FIELD_NUMBER: _ClassVar[int]
    OUTLIER_SHARE_FIELD_NUMBER: _ClassVar[int]
    converged: bool
    reason: str
    evaluations: int
    effective_draws: float
    checked_draws: int
    model_error: float
    check_efficiency: float
    pareto_k: float
    sampling_error: float
    parameters: _containers.RepeatedCompositeFieldContainer[ParameterPosterior]
    correlations: _containers.RepeatedCompositeFieldContainer[_specification_pb2.ParameterValues]
    bulk_velocity: QuantityPosterior
    mean: QuantityPosterior
    coefficient_of_variation: QuantityPosterior
    mandel: _containers.RepeatedCompositeFieldContainer[EntryPosterior]
    predictive_p_value: float
    draws: int
    outlier_share: float
    def __init__(self, converged: bool = ..., reason: _Optional[str] = ..., evaluations: _Optional[int] = ..., effective_draws: _Optional[float] = ..., checked_draws: _Optional[int] = ..., model_error: _Optional[float] = ..., check_efficiency: _Optional[float] = ..., pareto_k: _Optional[float] = ..., sampling_error: _Optional[float] = ..., parameters: _Optional[_Iterable[_Union[ParameterPosterior, _Mapping]]] = ..., correlations: _Optional[_Iterable[_Union[_specification_pb2.ParameterValues, _Mapping]]] = ..., bulk_velocity: _Optional[_Union[QuantityPosterior, _Mapping]] = ..., mean: _Optional[_Union[QuantityPosterior, _Mapping]] = ..., coefficient_of_variation: _Optional[_Union[QuantityPosterior, _Mapping]] = ..., mandel: _Optional[_Iterable[_Union[EntryPosterior, _Mapping]]] = ..., predictive_p_value: _Optional[float] = ..., draws: _Optional[int] = ..., outlier_share: _Optional[float] = ...) -> None: ...

class QuantityPosterior(_message.Message):
    __slots__ = ("mean", "standard_deviation", "quantiles", "prior_standard_deviation")
    MEAN_FIELD_NUMBER: _ClassVar[int]
    STANDARD_DEVIATION_FIELD_NUMBER: _ClassVar[int]
    QUANTILES_FIELD_NUMBER: _ClassVar[int]
    PRIOR_STANDARD_DEVIATION_FIELD_NUMBER: _ClassVar[int]
    mean: float
    standard_deviation: float
    quantiles: _containers.RepeatedScalarFieldContainer[float]
    prior_standard_deviation: float
    def __init__(self, mean: _Optional[float] = ..., standard_deviation: _Optional[float] = ..., quantiles: _Optional[_Iterable[float]] = ..., prior_standard_deviation: _Optional[float] = ...) -> None: ...

class ParameterPosterior(_message.Message):
    __slots__ = ("parameter", "posterior")
    PARAMETER_FIELD_NUMBER: _ClassVar[int]
    POSTERIOR_FIELD_NUMBER: _ClassVar[int]
    parameter: _specification_pb2.Parameter
    posterior: QuantityPosterior
    def __init__(self, parameter: _Optional[_Union[_specification_pb2.Parameter, str]] = ..., posterior: _Optional[_Union[QuantityPosterior, _Mapping]] = ...) -> None: ...

class EntryPosterior(_message.Message):
    __slots__ = ("row", "column", "posterior")
    ROW_FIELD_NUMBER: _ClassVar[int]
    COLUMN_FIELD_NUMBER: _ClassVar[int]
    POSTERIOR_FIELD_NUMBER: _ClassVar[int]
    row: int
    column: int
    posterior: QuantityPosterior
    def __init__(self, row: _Optional[int] = ..., column: _Optional[int] = ..., posterior: _Optional[_Union[QuantityPosterior, _Mapping]] = ...) -> None: ...

class NominalSampling(_message.Message):
    __slots__ = ("band", "period", "pairs")
    BAND_FIELD_NUMBER: _ClassVar[int]
    PERIOD_FIELD_NUMBER: _ClassVar[int]
    PAIRS_FIELD_NUMBER: _ClassVar[int]
    band: float
    period: float
    pairs: int
    def __init__(self, band: _Optional[float] = ..., period: _Optional[float] = ..., pairs: _Optional[int] = ...) -> None: ...

class JobResult(_message.Message):
    __slots__ = ("status", "failure", "reason", "digest", "best", "data", "sensitivities", "identified", "profiles", "solutions", "objective", "search", "evaluations", "realizations", "seed", "sampling", "scrambles", "control_variate", "solver", "nominal_sampling", "picking", "version", "numerics", "commit", "posterior", "integrity")
    STATUS_FIELD_NUMBER: _ClassVar[int]
    FAILURE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    DIGEST_FIELD_NUMBER: _ClassVar[int]
    BEST_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    SENSITIVITIES_FIELD_NUMBER: _ClassVar[int]
    IDENTIFIED_FIELD_NUMBER: _ClassVar[int]
    PROFILES_FIELD_NUMBER: _ClassVar[int]
    SOLUTIONS_FIELD_NUMBER: _ClassVar[int]
    OBJECTIVE_FIELD_NUMBER: _ClassVar[int]
    SEARCH_FIELD_NUMBER: _ClassVar[int]
    EVALUATIONS_FIELD_NUMBER: _ClassVar[int]
    REALIZATIONS_FIELD_NUMBER: _ClassVar[int]
    SEED_FIELD_NUMBER: _ClassVar[int]
    SAMPLING_FIELD_NUMBER: _ClassVar[int]
    SCRAMBLES_FIELD_NUMBER: _ClassVar[int]
    CONTROL_VARIATE_FIELD_NUMBER: _ClassVar[int]
    SOLVER_FIELD_NUMBER: _ClassVar[int]
    NOMINAL_SAMPLING_FIELD_NUMBER: _ClassVar[int]
    PICKING_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    NUMERICS_FIELD_NUMBER: _ClassVar[int]
    COMMIT_FIELD_NUMBER: _ClassVar[int]
    POSTERIOR_FIELD_NUMBER: _ClassVar[int]
    INTEGRITY_FIELD_NUMBER: _ClassVar[int]
    status: JobStatus
    failure: JobFailureKind
    reason: str
    digest: str
    best: BestPoint
    data: DataSummary
    sensitivities: _containers.RepeatedCompositeFieldContainer[Sensitivity]
    identified: Identified
    profiles: _containers.RepeatedCompositeFieldContainer[Profile]
    solutions: Solutions
    objective: _specification_pb2.Objective
    search: _specification_pb2.Search
    evaluations: int
    realizations: int
    seed: int
    sampling: _specification_pb2.Sampling
    scrambles: int
    control_variate: bool
    solver: _specification_pb2.SolverSettings
    nominal_sampling: NominalSampling
    picking: _specification_pb2.Picking
    version: str
    numerics: int
    commit: str
    posterior: Posterior
    integrity: Integrity
    def __init__(self, status: _Optional[_Union[JobStatus, str]] = ..., failure: _Optional[_Union[JobFailureKind, str]] = ..., reason: _Optional[str] = ..., digest: _Optional[str] = ..., best: _Optional[_Union[BestPoint, _Mapping]] = ..., data: _Optional[_Union[DataSummary, _Mapping]] = ..., sensitivities: _Optional[_Iterable[_Union[Sensitivity, _Mapping]]] = ..., identified: _Optional[_Union[Identified, _Mapping]] = ..., profiles: _Optional[_Iterable[_Union[Profile, _Mapping]]] = ..., solutions: _Optional[_Union[Solutions, _Mapping]] = ..., objective: _Optional[_Union[_specification_pb2.Objective, _Mapping]] = ..., search: _Optional[_Union[_specification_pb2.Search, _Mapping]] = ..., evaluations: _Optional[int] = ..., realizations: _Optional[int] = ..., seed: _Optional[int] = ..., sampling: _Optional[_Union[_specification_pb2.Sampling, str]] = ..., scrambles: _Optional[int] = ..., control_variate: bool = ..., solver: _Optional[_Union[_specification_pb2.SolverSettings, _Mapping]] = ..., nominal_sampling: _Optional[_Union[NominalSampling, _Mapping]] = ..., picking: _Optional[_Union[_specification_pb2.Picking, _Mapping]] = ..., version: _Optional[str] = ..., numerics: _Optional[int] = ..., commit: _Optional[str] = ..., posterior: _Optional[_Union[Posterior, _Mapping]] = ..., integrity: _Optional[_Union[Integrity, _Mapping]] = ...) -> None: ...

class Integrity(_message.Message):
    __slots__ = ("banned_hosts", "earlier_digest")
    BANNED_HOSTS_FIELD_NUMBER: _ClassVar[int]
    EARLIER_DIGEST_FIELD_NUMBER: _ClassVar[int]
    banned_hosts: _containers.RepeatedScalarFieldContainer[str]
    earlier_digest: str
    def __init__(self, banned_hosts: _Optional[_Iterable[str]] = ..., earlier_digest: _Optional[str] = ...) -> None: ...

class GroupResult(_message.Message):
    __slots__ = ("group", "name", "status", "reason", "best", "data", "sensitivities", "identified", "profiles", "solutions", "posterior")
    GROUP_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    STATUS_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    BEST_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    SENSITIVITIES_FIELD_NUMBER: _ClassVar[int]
    IDENTIFIED_FIELD_NUMBER: _ClassVar[int]
    PROFILES_FIELD_NUMBER: _ClassVar[int]
    SOLUTIONS_FIELD_NUMBER: _ClassVar[int]
    POSTERIOR_FIELD_NUMBER: _ClassVar[int]
    group: int
    name: str
    status: JobStatus
    reason: str
    best: BestPoint
    data: DataSummary
    sensitivities: _containers.RepeatedCompositeFieldContainer[Sensitivity]
    identified: Identified
    profiles: _containers.RepeatedCompositeFieldContainer[Profile]
    solutions: Solutions
    posterior: Posterior
    def __init__(self, group: _Optional[int] = ..., name: _Optional[str] = ..., status: _Optional[_Union[JobStatus, str]] = ..., reason: _Optional[str] = ..., best: _Optional[_Union[BestPoint, _Mapping]] = ..., data: _Optional[_Union[DataSummary, _Mapping]] = ..., sensitivities: _Optional[_Iterable[_Union[Sensitivity, _Mapping]]] = ..., identified: _Optional[_Union[Identified, _Mapping]] = ..., profiles: _Optional[_Iterable[_Union[Profile, _Mapping]]] = ..., solutions: _Optional[_Union[Solutions, _Mapping]] = ..., posterior: _Optional[_Union[Posterior, _Mapping]] = ...) -> None: ...

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
