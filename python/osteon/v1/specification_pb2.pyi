from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class JobKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    JOB_KIND_UNSPECIFIED: _ClassVar[JobKind]
    JOB_KIND_IDENTIFICATION: _ClassVar[JobKind]
    JOB_KIND_PROPAGATION: _ClassVar[JobKind]

class Extremum(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    EXTREMUM_UNSPECIFIED: _ClassVar[Extremum]
    EXTREMUM_FIRST: _ClassVar[Extremum]
    EXTREMUM_SECOND: _ClassVar[Extremum]

class SolverMethod(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    SOLVER_METHOD_UNSPECIFIED: _ClassVar[SolverMethod]
    SOLVER_METHOD_EXACT: _ClassVar[SolverMethod]
    SOLVER_METHOD_HYBRID: _ClassVar[SolverMethod]

class Parameter(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    PARAMETER_UNSPECIFIED: _ClassVar[Parameter]
    PARAMETER_DENSITY: _ClassVar[Parameter]
    PARAMETER_LONGITUDINAL_YOUNG_MODULUS: _ClassVar[Parameter]
    PARAMETER_LONGITUDINAL_POISSON_RATIO: _ClassVar[Parameter]
    PARAMETER_LONGITUDINAL_SHEAR_MODULUS: _ClassVar[Parameter]
    PARAMETER_TRANSVERSE_YOUNG_MODULUS: _ClassVar[Parameter]
    PARAMETER_TRANSVERSE_POISSON_RATIO: _ClassVar[Parameter]
    PARAMETER_DISPERSION: _ClassVar[Parameter]
    PARAMETER_BONE_THICKNESS: _ClassVar[Parameter]
    PARAMETER_BONE_QUALITY_FACTOR: _ClassVar[Parameter]
    PARAMETER_COUPLING_SOUND_SPEED: _ClassVar[Parameter]

class Sampling(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    SAMPLING_UNSPECIFIED: _ClassVar[Sampling]
    SAMPLING_MONTE_CARLO: _ClassVar[Sampling]
    SAMPLING_SOBOL: _ClassVar[Sampling]

class RandomDistribution(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    RANDOM_DISTRIBUTION_UNSPECIFIED: _ClassVar[RandomDistribution]
    RANDOM_DISTRIBUTION_NORMAL: _ClassVar[RandomDistribution]
    RANDOM_DISTRIBUTION_LOG_NORMAL: _ClassVar[RandomDistribution]
    RANDOM_DISTRIBUTION_UNIFORM: _ClassVar[RandomDistribution]

class ObjectiveKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    OBJECTIVE_KIND_UNSPECIFIED: _ClassVar[ObjectiveKind]
    OBJECTIVE_KIND_MOMENTS: _ClassVar[ObjectiveKind]
    OBJECTIVE_KIND_LIKELIHOOD: _ClassVar[ObjectiveKind]
    OBJECTIVE_KIND_CHI_SQUARE: _ClassVar[ObjectiveKind]

class SearchMethod(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    SEARCH_METHOD_UNSPECIFIED: _ClassVar[SearchMethod]
    SEARCH_METHOD_SIMPLEX: _ClassVar[SearchMethod]
    SEARCH_METHOD_NEWTON: _ClassVar[SearchMethod]
    SEARCH_METHOD_POSTERIOR: _ClassVar[SearchMethod]

class PriorDistribution(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    PRIOR_DISTRIBUTION_UNSPECIFIED: _ClassVar[PriorDistribution]
    PRIOR_DISTRIBUTION_UNIFORM: _ClassVar[PriorDistribution]
    PRIOR_DISTRIBUTION_NORMAL: _ClassVar[PriorDistribution]
    PRIOR_DISTRIBUTION_LOG_NORMAL: _ClassVar[PriorDistribution]
JOB_KIND_UNSPECIFIED: JobKind
JOB_KIND_IDENTIFICATION: JobKind
JOB_KIND_PROPAGATION: JobKind
EXTREMUM_UNSPECIFIED: Extremum
EXTREMUM_FIRST: Extremum
EXTREMUM_SECOND: Extremum
SOLVER_METHOD_UNSPECIFIED: SolverMethod
SOLVER_METHOD_EXACT: SolverMethod
SOLVER_METHOD_HYBRID: SolverMethod
PARAMETER_UNSPECIFIED: Parameter
PARAMETER_DENSITY: Parameter
PARAMETER_LONGITUDINAL_YOUNG_MODULUS: Parameter
PARAMETER_LONGITUDINAL_POISSON_RATIO: Parameter
PARAMETER_LONGITUDINAL_SHEAR_MODULUS: Parameter
PARAMETER_TRANSVERSE_YOUNG_MODULUS: Parameter
PARAMETER_TRANSVERSE_POISSON_RATIO: Parameter
PARAMETER_DISPERSION: Parameter
PARAMETER_BONE_THICKNESS: Parameter
PARAMETER_BONE_QUALITY_FACTOR: Parameter
PARAMETER_COUPLING_SOUND_SPEED: Parameter
SAMPLING_UNSPECIFIED: Sampling
SAMPLING_MONTE_CARLO: Sampling
SAMPLING_SOBOL: Sampling
RANDOM_DISTRIBUTION_UNSPECIFIED: RandomDistribution
RANDOM_DISTRIBUTION_NORMAL: RandomDistribution
RANDOM_DISTRIBUTION_LOG_NORMAL: RandomDistribution
RANDOM_DISTRIBUTION_UNIFORM: RandomDistribution
OBJECTIVE_KIND_UNSPECIFIED: ObjectiveKind
OBJECTIVE_KIND_MOMENTS: ObjectiveKind
OBJECTIVE_KIND_LIKELIHOOD: ObjectiveKind
OBJECTIVE_KIND_CHI_SQUARE: ObjectiveKind
SEARCH_METHOD_UNSPECIFIED: SearchMethod
SEARCH_METHOD_SIMPLEX: SearchMethod
SEARCH_METHOD_NEWTON: SearchMethod
SEARCH_METHOD_POSTERIOR: SearchMethod
PRIOR_DISTRIBUTION_UNSPECIFIED: PriorDistribution
PRIOR_DISTRIBUTION_UNIFORM: PriorDistribution
PRIOR_DISTRIBUTION_NORMAL: PriorDistribution
PRIOR_DISTRIBUTION_LOG_NORMAL: PriorDistribution

class JobSpecification(_message.Message):
    __slots__ = ("kind", "layers", "probe", "picking", "solver", "data", "parameters", "monte_carlo", "objective", "search", "posterior", "random")
    KIND_FIELD_NUMBER: _ClassVar[int]
    LAYERS_FIELD_NUMBER: _ClassVar[int]
    PROBE_FIELD_NUMBER: _ClassVar[int]
    PICKING_FIELD_NUMBER: _ClassVar[int]
    SOLVER_FIELD_NUMBER: _ClassVar[int]
    DATA_FIELD_NUMBER: _ClassVar[int]
    PARAMETERS_FIELD_NUMBER: _ClassVar[int]
    MONTE_CARLO_FIELD_NUMBER: _ClassVar[int]
    OBJECTIVE_FIELD_NUMBER: _ClassVar[int]
    SEARCH_FIELD_NUMBER: _ClassVar[int]
    POSTERIOR_FIELD_NUMBER: _ClassVar[int]
    RANDOM_FIELD_NUMBER: _ClassVar[int]
    kind: JobKind
    layers: Layers
    probe: Probe
    picking: Picking
    solver: SolverSettings
    data: Data
    parameters: Parameters
    monte_carlo: MonteCarlo
    objective: Objective
    search: Search
    posterior: PosteriorSettings
    random: RandomQuantities
    def __init__(self, kind: _Optional[_Union[JobKind, str]] = ..., layers: _Optional[_Union[Layers, _Mapping]] = ..., probe: _Optional[_Union[Probe, _Mapping]] = ..., picking: _Optional[_Union[Picking, _Mapping]] = ..., solver: _Optional[_Union[SolverSettings, _Mapping]] = ..., data: _Optional[_Union[Data, _Mapping]] = ..., parameters: _Optional[_Union[Parameters, _Mapping]] = ..., monte_carlo: _Optional[_Union[MonteCarlo, _Mapping]] = ..., objective: _Optional[_Union[Objective, _Mapping]] = ..., search: _Optional[_Union[Search, _Mapping]] = ..., posterior: _Optional[_Union[PosteriorSettings, _Mapping]] = ..., random: _Optional[_Union[RandomQuantities, _Mapping]] = ...) -> None: ...

class Layers(_message.Message):
    __slots__ = ("coupling", "bone", "marrow")
    COUPLING_FIELD_NUMBER: _ClassVar[int]
    BONE_FIELD_NUMBER: _ClassVar[int]
    MARROW_FIELD_NUMBER: _ClassVar[int]
    coupling: Fluid
    bone: BoneLayer
    marrow: Fluid
    def __init__(self, coupling: _Optional[_Union[Fluid, _Mapping]] = ..., bone: _Optional[_Union[BoneLayer, _Mapping]] = ..., marrow: _Optional[_Union[Fluid, _Mapping]] = ...) -> None: ...

class Fluid(_message.Message):
    __slots__ = ("thickness", "density", "sound_speed", "attenuation")
    THICKNESS_FIELD_NUMBER: _ClassVar[int]
    DENSITY_FIELD_NUMBER: _ClassVar[int]
    SOUND_SPEED_FIELD_NUMBER: _ClassVar[int]
    ATTENUATION_FIELD_NUMBER: _ClassVar[int]
    thickness: float
    density: float
    sound_speed: float
    attenuation: Attenuation
    def __init__(self, thickness: _Optional[float] = ..., density: _Optional[float] = ..., sound_speed: _Optional[float] = ..., attenuation: _Optional[_Union[Attenuation, _Mapping]] = ...) -> None: ...

class BoneLayer(_message.Message):
    __slots__ = ("thickness", "attenuation")
    THICKNESS_FIELD_NUMBER: _ClassVar[int]
    ATTENUATION_FIELD_NUMBER: _ClassVar[int]
    thickness: float
    attenuation: Attenuation
    def __init__(self, thickness: _Optional[float] = ..., attenuation: _Optional[_Union[Attenuation, _Mapping]] = ...) -> None: ...

class Attenuation(_message.Message):
    __slots__ = ("quality_factor", "reference_frequency")
    QUALITY_FACTOR_FIELD_NUMBER: _ClassVar[int]
    REFERENCE_FREQUENCY_FIELD_NUMBER: _ClassVar[int]
    quality_factor: float
    reference_frequency: float
    def __init__(self, quality_factor: _Optional[float] = ..., reference_frequency: _Optional[float] = ...) -> None: ...

class Probe(_message.Message):
    __slots__ = ("center_frequency", "amplitude", "source", "receivers", "tilt", "bidirectional")
    CENTER_FREQUENCY_FIELD_NUMBER: _ClassVar[int]
    AMPLITUDE_FIELD_NUMBER: _ClassVar[int]
    SOURCE_FIELD_NUMBER: _ClassVar[int]
    RECEIVERS_FIELD_NUMBER: _ClassVar[int]
    TILT_FIELD_NUMBER: _ClassVar[int]
    BIDIRECTIONAL_FIELD_NUMBER: _ClassVar[int]
    center_frequency: float
    amplitude: float
    source: Source
    receivers: Receivers
    tilt: float
    bidirectional: bool
    def __init__(self, center_frequency: _Optional[float] = ..., amplitude: _Optional[float] = ..., source: _Optional[_Union[Source, _Mapping]] = ..., receivers: _Optional[_Union[Receivers, _Mapping]] = ..., tilt: _Optional[float] = ..., bidirectional: bool = ...) -> None: ...

class Source(_message.Message):
    __slots__ = ("x1", "x3")
    X1_FIELD_NUMBER: _ClassVar[int]
    X3_FIELD_NUMBER: _ClassVar[int]
    x1: float
    x3: float
    def __init__(self, x1: _Optional[float] = ..., x3: _Optional[float] = ...) -> None: ...

class Receivers(_message.Message):
    __slots__ = ("first_x1", "pitch", "count", "x3")
    FIRST_X1_FIELD_NUMBER: _ClassVar[int]
    PITCH_FIELD_NUMBER: _ClassVar[int]
    COUNT_FIELD_NUMBER: _ClassVar[int]
    X3_FIELD_NUMBER: _ClassVar[int]
    first_x1: float
    pitch: float
    count: int
    x3: float
    def __init__(self, first_x1: _Optional[float] = ..., pitch: _Optional[float] = ..., count: _Optional[int] = ..., x3: _Optional[float] = ...) -> None: ...

class Picking(_message.Message):
    __slots__ = ("extremum", "threshold")
    EXTREMUM_FIELD_NUMBER: _ClassVar[int]
    THRESHOLD_FIELD_NUMBER: _ClassVar[int]
    extremum: Extremum
    threshold: float
    def __init__(self, extremum: _Optional[_Union[Extremum, str]] = ..., threshold: _Optional[float] = ...) -> None: ...

class SolverSettings(_message.Message):
    __slots__ = ("method", "refinement", "element_size", "element_order", "time_step")
    METHOD_FIELD_NUMBER: _ClassVar[int]
    REFINEMENT_FIELD_NUMBER: _ClassVar[int]
    ELEMENT_SIZE_FIELD_NUMBER: _ClassVar[int]
    ELEMENT_ORDER_FIELD_NUMBER: _ClassVar[int]
    TIME_STEP_FIELD_NUMBER: _ClassVar[int]
    method: SolverMethod
    refinement: float
    element_size: float
    element_order: int
    time_step: float
    def __init__(self, method: _Optional[_Union[SolverMethod, str]] = ..., refinement: _Optional[float] = ..., element_size: _Optional[float] = ..., element_order: _Optional[int] = ..., time_step: _Optional[float] = ...) -> None: ...

class Data(_message.Message):
    __slots__ = ("velocities", "mean", "coefficient_of_variation", "groups", "subjects", "repeatability", "count", "decays")
    VELOCITIES_FIELD_NUMBER: _ClassVar[int]
    MEAN_FIELD_NUMBER: _ClassVar[int]
    COEFFICIENT_OF_VARIATION_FIELD_NUMBER: _ClassVar[int]
    GROUPS_FIELD_NUMBER: _ClassVar[int]
    SUBJECTS_FIELD_NUMBER: _ClassVar[int]
    REPEATABILITY_FIELD_NUMBER: _ClassVar[int]
    COUNT_FIELD_NUMBER: _ClassVar[int]
    DECAYS_FIELD_NUMBER: _ClassVar[int]
    velocities: _containers.RepeatedScalarFieldContainer[float]
    mean: float
    coefficient_of_variation: float
    groups: _containers.RepeatedCompositeFieldContainer[VelocityGroup]
    subjects: _containers.RepeatedScalarFieldContainer[int]
    repeatability: float
    count: int
    decays: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, velocities: _Optional[_Iterable[float]] = ..., mean: _Optional[float] = ..., coefficient_of_variation: _Optional[float] = ..., groups: _Optional[_Iterable[_Union[VelocityGroup, _Mapping]]] = ..., subjects: _Optional[_Iterable[int]] = ..., repeatability: _Optional[float] = ..., count: _Optional[int] = ..., decays: _Optional[_Iterable[float]] = ...) -> None: ...

class VelocityGroup(_message.Message):
    __slots__ = ("name", "velocities", "subjects", "bone_thickness", "bone_quality_factor", "coupling_sound_speed", "decays")
    NAME_FIELD_NUMBER: _ClassVar[int]
    VELOCITIES_FIELD_NUMBER: _ClassVar[int]
    SUBJECTS_FIELD_NUMBER: _ClassVar[int]
    BONE_THICKNESS_FIELD_NUMBER: _ClassVar[int]
    BONE_QUALITY_FACTOR_FIELD_NUMBER: _ClassVar[int]
    COUPLING_SOUND_SPEED_FIELD_NUMBER: _ClassVar[int]
    DECAYS_FIELD_NUMBER: _ClassVar[int]
    name: str
    velocities: _containers.RepeatedScalarFieldContainer[float]
    subjects: _containers.RepeatedScalarFieldContainer[int]
    bone_thickness: float
    bone_quality_factor: float
    coupling_sound_speed: float
    decays: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, name: _Optional[str] = ..., velocities: _Optional[_Iterable[float]] = ..., subjects: _Optional[_Iterable[int]] = ..., bone_thickness: _Optional[float] = ..., bone_quality_factor: _Optional[float] = ..., coupling_sound_speed: _Optional[float] = ..., decays: _Optional[_Iterable[float]] = ...) -> None: ...

class ParameterValues(_message.Message):
    __slots__ = ("density", "longitudinal_young_modulus", "longitudinal_poisson_ratio", "longitudinal_shear_modulus", "transverse_young_modulus", "transverse_poisson_ratio", "dispersion", "bone_thickness", "bone_quality_factor", "coupling_sound_speed")
    DENSITY_FIELD_NUMBER: _ClassVar[int]
    LONGITUDINAL_YOUNG_MODULUS_FIELD_NUMBER: _ClassVar[int]
    LONGITUDINAL_POISSON_RATIO_FIELD_NUMBER: _ClassVar[int]
    LONGITUDINAL_SHEAR_MODULUS_FIELD_NUMBER: _ClassVar[int]
    TRANSVERSE_YOUNG_MODULUS_FIELD_NUMBER: _ClassVar[int]
    TRANSVERSE_POISSON_RATIO_FIELD_NUMBER: _ClassVar[int]
    DISPERSION_FIELD_NUMBER: _ClassVar[int]
    BONE_THICKNESS_FIELD_NUMBER: _ClassVar[int]
    BONE_QUALITY_FACTOR_FIELD_NUMBER: _ClassVar[int]
    COUPLING_SOUND_SPEED_FIELD_NUMBER: _ClassVar[int]
    density: float
    longitudinal_young_modulus: float
    longitudinal_poisson_ratio: float
    longitudinal_shear_modulus: float
    transverse_young_modulus: float
    transverse_poisson_ratio: float
    dispersion: float
    bone_thickness: float
    bone_quality_factor: float
    coupling_sound_speed: float
    def __init__(self, density: _Optional[float] = ..., longitudinal_young_modulus: _Optional[float] = ..., longitudinal_poisson_ratio: _Optional[float] = ..., longitudinal_shear_modulus: _Optional[float] = ..., transverse_young_modulus: _Optional[float] = ..., transverse_poisson_ratio: _Optional[float] = ..., dispersion: _Optional[float] = ..., bone_thickness: _Optional[float] = ..., bone_quality_factor: _Optional[float] = ..., coupling_sound_speed: _Optional[float] = ...) -> None: ...

class Parameters(_message.Message):
    __slots__ = ("density", "longitudinal_young_modulus", "longitudinal_poisson_ratio", "longitudinal_shear_modulus", "transverse_young_modulus", "transverse_poisson_ratio", "dispersion", "bone_thickness", "bone_quality_factor", "coupling_sound_speed")
    DENSITY_FIELD_NUMBER: _ClassVar[int]
    LONGITUDINAL_YOUNG_MODULUS_FIELD_NUMBER: _ClassVar[int]
    LONGITUDINAL_POISSON_RATIO_FIELD_NUMBER: _ClassVar[int]
    LONGITUDINAL_SHEAR_MODULUS_FIELD_NUMBER: _ClassVar[int]
    TRANSVERSE_YOUNG_MODULUS_FIELD_NUMBER: _ClassVar[int]
    TRANSVERSE_POISSON_RATIO_FIELD_NUMBER: _ClassVar[int]
    DISPERSION_FIELD_NUMBER: _ClassVar[int]
    BONE_THICKNESS_FIELD_NUMBER: _ClassVar[int]
    BONE_QUALITY_FACTOR_FIELD_NUMBER: _ClassVar[int]
    COUPLING_SOUND_SPEED_FIELD_NUMBER: _ClassVar[int]
    density: ParameterRange
    longitudinal_young_modulus: ParameterRange
    longitudinal_poisson_ratio: ParameterRange
    longitudinal_shear_modulus: ParameterRange
    transverse_young_modulus: ParameterRange
    transverse_poisson_ratio: ParameterRange
    dispersion: ParameterRange
    bone_thickness: ParameterRange
    bone_quality_factor: ParameterRange
    coupling_sound_speed: ParameterRange
    def __init__(self, density: _Optional[_Union[ParameterRange, _Mapping]] = ..., longitudinal_young_modulus: _Optional[_Union[ParameterRange, _Mapping]] = ..., longitudinal_poisson_ratio: _Optional[_Union[ParameterRange, _Mapping]] = ..., longitudinal_shear_modulus: _Optional[_Union[ParameterRange, _Mapping]] = ..., transverse_young_modulus: _Optional[_Union[ParameterRange, _Mapping]] = ..., transverse_poisson_ratio: _Optional[_Union[ParameterRange, _Mapping]] = ..., dispersion: _Optional[_Union[ParameterRange, _Mapping]] = ..., bone_thickness: _Optional[_Union[ParameterRange, _Mapping]] = ..., bone_quality_factor: _Optional[_Union[ParameterRange, _Mapping]] = ..., coupling_sound_speed: _Optional[_Union[ParameterRange, _Mapping]] = ...) -> None: ...

class ParameterRange(_message.Message):
    __slots__ = ("fixed", "free")
    FIXED_FIELD_NUMBER: _ClassVar[int]
    FREE_FIELD_NUMBER: _ClassVar[int]
    fixed: float
    free: FreeRange
    def __init__(self, fixed: _Optional[float] = ..., free: _Optional[_Union[FreeRange, _Mapping]] = ...) -> None: ...

class FreeRange(_message.Message):
    __slots__ = ("start", "lower", "upper")
    START_FIELD_NUMBER: _ClassVar[int]
    LOWER_FIELD_NUMBER: _ClassVar[int]
    UPPER_FIELD_NUMBER: _ClassVar[int]
    start: float
    lower: float
    upper: float
    def __init__(self, start: _Optional[float] = ..., lower: _Optional[float] = ..., upper: _Optional[float] = ...) -> None: ...

class Scatter(_message.Message):
    __slots__ = ("standard_deviation", "distribution")
    STANDARD_DEVIATION_FIELD_NUMBER: _ClassVar[int]
    DISTRIBUTION_FIELD_NUMBER: _ClassVar[int]
    standard_deviation: float
    distribution: RandomDistribution
    def __init__(self, standard_deviation: _Optional[float] = ..., distribution: _Optional[_Union[RandomDistribution, str]] = ...) -> None: ...

class RandomQuantities(_message.Message):
    __slots__ = ("bone_thickness", "bone_quality_factor", "coupling_sound_speed", "probe_tilt")
    BONE_THICKNESS_FIELD_NUMBER: _ClassVar[int]
    BONE_QUALITY_FACTOR_FIELD_NUMBER: _ClassVar[int]
    COUPLING_SOUND_SPEED_FIELD_NUMBER: _ClassVar[int]
    PROBE_TILT_FIELD_NUMBER: _ClassVar[int]
    bone_thickness: Scatter
    bone_quality_factor: Scatter
    coupling_sound_speed: Scatter
    probe_tilt: Scatter
    def __init__(self, bone_thickness: _Optional[_Union[Scatter, _Mapping]] = ..., bone_quality_factor: _Optional[_Union[Scatter, _Mapping]] = ..., coupling_sound_speed: _Optional[_Union[Scatter, _Mapping]] = ..., probe_tilt: _Optional[_Union[Scatter, _Mapping]] = ...) -> None: ...

class MonteCarlo(_message.Message):
    __slots__ = ("realizations", "seed", "sampling", "max_failed_fraction", "scrambles", "control_variate")
    REALIZATIONS_FIELD_NUMBER: _ClassVar[int]
    SEED_FIELD_NUMBER: _ClassVar[int]
    SAMPLING_FIELD_NUMBER: _ClassVar[int]
    MAX_FAILED_FRACTION_FIELD_NUMBER: _ClassVar[int]
    SCRAMBLES_FIELD_NUMBER: _ClassVar[int]
    CONTROL_VARIATE_FIELD_NUMBER: _ClassVar[int]
    realizations: int
    seed: int
    sampling: Sampling
    max_failed_fraction: float
    scrambles: int
    control_variate: bool
    def __init__(self, realizations: _Optional[int] = ..., seed: _Optional[int] = ..., sampling: _Optional[_Union[Sampling, str]] = ..., max_failed_fraction: _Optional[float] = ..., scrambles: _Optional[int] = ..., control_variate: bool = ...) -> None: ...

class Objective(_message.Message):
    __slots__ = ("kind",)
    KIND_FIELD_NUMBER: _ClassVar[int]
    kind: ObjectiveKind
    def __init__(self, kind: _Optional[_Union[ObjectiveKind, str]] = ...) -> None: ...

class Search(_message.Message):
    __slots__ = ("method", "max_evaluations", "cost_tolerance", "size_tolerance", "initial_step", "starts", "first_start", "sensitivities", "priors")
    METHOD_FIELD_NUMBER: _ClassVar[int]
    MAX_EVALUATIONS_FIELD_NUMBER: _ClassVar[int]
    COST_TOLERANCE_FIELD_NUMBER: _ClassVar[int]
    SIZE_TOLERANCE_FIELD_NUMBER: _ClassVar[int]
    INITIAL_STEP_FIELD_NUMBER: _ClassVar[int]
    STARTS_FIELD_NUMBER: _ClassVar[int]
    FIRST_START_FIELD_NUMBER: _ClassVar[int]
    SENSITIVITIES_FIELD_NUMBER: _ClassVar[int]
    PRIORS_FIELD_NUMBER: _ClassVar[int]
    method: SearchMethod
    max_evaluations: int
    cost_tolerance: float
    size_tolerance: float
    initial_step: float
    starts: int
    first_start: int
    sensitivities: bool
    priors: _containers.RepeatedCompositeFieldContainer[Prior]
    def __init__(self, method: _Optional[_Union[SearchMethod, str]] = ..., max_evaluations: _Optional[int] = ..., cost_tolerance: _Optional[float] = ..., size_tolerance: _Optional[float] = ..., initial_step: _Optional[float] = ..., starts: _Optional[int] = ..., first_start: _Optional[int] = ..., sensitivities: bool = ..., priors: _Optional[_Iterable[_Union[Prior, _Mapping]]] = ...) -> None: ...

class Prior(_message.Message):
    __slots__ = ("parameter", "value", "weight")
    PARAMETER_FIELD_NUMBER: _ClassVar[int]
    VALUE_FIELD_NUMBER: _ClassVar[int]
    WEIGHT_FIELD_NUMBER: _ClassVar[int]
    parameter: Parameter
    value: float
    weight: float
    def __init__(self, parameter: _Optional[_Union[Parameter, str]] = ..., value: _Optional[float] = ..., weight: _Optional[float] = ...) -> None: ...

class PosteriorSettings(_message.Message):
    __slots__ = ("draws", "max_evaluations", "priors")
    DRAWS_FIELD_NUMBER: _ClassVar[int]
    MAX_EVALUATIONS_FIELD_NUMBER: _ClassVar[int]
    PRIORS_FIELD_NUMBER: _ClassVar[int]
    draws: int
    max_evaluations: int
    priors: _containers.RepeatedCompositeFieldContainer[PosteriorPrior]
    def __init__(self, draws: _Optional[int] = ..., max_evaluations: _Optional[int] = ..., priors: _Optional[_Iterable[_Union[PosteriorPrior, _Mapping]]] = ...) -> None: ...

class PosteriorPrior(_message.Message):
    __slots__ = ("parameter", "distribution", "center", "spread")
    PARAMETER_FIELD_NUMBER: _ClassVar[int]
    DISTRIBUTION_FIELD_NUMBER: _ClassVar[int]
    CENTER_FIELD_NUMBER: _ClassVar[int]
    SPREAD_FIELD_NUMBER: _ClassVar[int]
    parameter: Parameter
    distribution: PriorDistribution
    center: float
    spread: float
    def __init__(self, parameter: _Optional[_Union[Parameter, str]] = ..., distribution: _Optional[_Union[PriorDistribution, str]] = ..., center: _Optional[float] = ..., spread: _Optional[float] = ...) -> None: ...
