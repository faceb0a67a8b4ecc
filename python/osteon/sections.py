"""The sections of a job: the keyword arguments of :class:`osteon.Job`.

Every key may be left out unless it says otherwise; units are SI.

Written by `cargo xtask generate reference`; do not edit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypedDict


class LayersCouplingAttenuation(TypedDict, total=False):
    """Attenuation of sound in the fluid."""

    quality_factor: float
    """Quality factor Q: 1/Q is the tangent of the loss angle, the same at every frequency.
    Range: at least 2.0."""

    reference_frequency: float
    """Only with quality_factor: frequency at which elasticity or sound speed have the given
    values. Range: above 0.0. Default: 1000000.0."""


class LayersCoupling(TypedDict, total=False):
    """The fluid above the bone, in which source and receivers lie."""

    thickness: float
    """Thickness of the layer. Range: above 0.0. Default: 0.01."""

    density: float
    """Mass density. Range: above 0.0. Default: 1000.0."""

    sound_speed: float
    """Speed of sound. Range: above 0.0. Default: 1500.0."""

    attenuation: LayersCouplingAttenuation
    """Attenuation of sound in the fluid."""


class LayersBoneAttenuation(TypedDict, total=False):
    """Attenuation of waves in the bone."""

    quality_factor: float
    """Quality factor Q: 1/Q is the tangent of the loss angle, the same at every frequency.
    Range: at least 2.0."""

    reference_frequency: float
    """Only with quality_factor: frequency at which elasticity or sound speed have the given
    values. Range: above 0.0. Default: 1000000.0."""


class LayersBone(TypedDict, total=False):
    """The cortical bone."""

    thickness: float
    """Thickness of the bone. Range: above 0.0. Default: 0.004."""

    attenuation: LayersBoneAttenuation
    """Attenuation of waves in the bone."""


class LayersMarrowAttenuation(TypedDict, total=False):
    """Attenuation of sound in the fluid."""

    quality_factor: float
    """Quality factor Q: 1/Q is the tangent of the loss angle, the same at every frequency.
    Range: at least 2.0."""

    reference_frequency: float
    """Only with quality_factor: frequency at which elasticity or sound speed have the given
    values. Range: above 0.0. Default: 1000000.0."""


class LayersMarrow(TypedDict, total=False):
    """The fluid below the bone."""

    thickness: float
    """Thickness of the layer. Range: above 0.0. Default: 0.01."""

    density: float
    """Mass density. Range: above 0.0. Default: 1000.0."""

    sound_speed: float
    """Speed of sound. Range: above 0.0. Default: 1500.0."""

    attenuation: LayersMarrowAttenuation
    """Attenuation of sound in the fluid."""


class Layers(TypedDict, total=False):
    """The three layers."""

    coupling: LayersCoupling
    """The fluid above the bone, in which source and receivers lie."""

    bone: LayersBone
    """The cortical bone."""

    marrow: LayersMarrow
    """The fluid below the bone."""


class ProbeSource(TypedDict, total=False):
    """The line source; inside the coupling fluid."""

    x1: float
    """Position along the bone. Default: 0.0."""

    x3: float
    """Height above the bone. Range: above 0.0. Default: 0.002."""


class ProbeReceivers(TypedDict, total=False):
    """The receivers; all on one side of the source, inside the coupling fluid."""

    first_x1: float
    """Position of the first receiver along the bone. Default: 0.011."""

    pitch: float
    """Distance between neighbours. Range: above 0.0. Default: 0.0008."""

    count: int
    """Number of receivers. Range: at least 3, at most 64. Default: 14."""

    x3: float
    """Height above the bone. Range: above 0.0. Default: 0.002."""


class Probe(TypedDict, total=False):
    """Source, receivers, pulse."""

    center_frequency: float
    """Centre frequency fc of the pulse. Range: above 0.0. Default: 1000000.0."""

    amplitude: float
    """Amplitude F1 of the pulse (the paper gives it in N; physics.md explains the dimension).
    Range: above 0.0. Default: 100.0."""

    source: ProbeSource
    """The line source; inside the coupling fluid."""

    receivers: ProbeReceivers
    """The receivers; all on one side of the source, inside the coupling fluid."""

    tilt: float
    """Angle by which the probe is turned about the source; positive if receivers farther from
    it are higher. Range: at least -0.2, at most 0.2. Default: 0.0."""

    bidirectional: bool
    """Whether a second source at the other end emits, too: the velocity is then the harmonic
    mean of both directions. Default: False."""


class Picking(TypedDict, total=False):
    """Criterion of the first arriving signal."""

    extremum: Literal["first", "second"]
    """Whether the first or the second extremum of the packet gives the time of flight. Default:
    "first"."""

    threshold: float
    """An extremum can be the first arrival only if its size relative to its packet's peak, in
    the median over the receivers, is above this. Range: above 0.0, below 1.0. Default: 0.05."""


class Solver(TypedDict, total=False):
    """Settings of the wave solver."""

    method: Literal["exact", "hybrid"]
    """"exact": exact solution of the layered medium for each frequency and wavenumber;
    "hybrid": the paper's method, Fourier transform along the bone, spectral elements across it,
    time steps. Default: "exact"."""

    refinement: float
    """Larger is more accurate and slower; with "hybrid", element size and time step are divided
    by the square root of this value. Range: at least 0.5, at most 16.0. Default: 1.0."""

    element_size: float
    """Only for "hybrid": largest element size at refinement 1, measured through the thickness;
    the first pass uses elements up to a third larger. Range: at least 1e-6, at most 0.01.
    Default: 0.0005."""

    element_order: int
    """Only for "hybrid": polynomial degree of the elements. Range: at least 2, at most 12.
    Default: 8."""

    time_step: float
    """Only for "hybrid": time step of the first pass; later passes use proportionally smaller
    ones. Default: the stability limit of each bone. A step above the stability limit of a bone
    makes it fail with no_convergence. Range: above 0.0."""


class ParametersDensity(TypedDict, total=False):
    """Mass density of the bone, kg/m³."""

    start: float
    """Value at which the search starts, within the bounds; for a quantity of the setup by
    default its value there. Range: above 0.0."""

    bounds: Sequence[float]
    """[lower, upper] of a free parameter."""

    fixed: float
    """Instead of both: the value of a parameter that is held fixed. Range: above 0.0."""


class ParametersLongitudinalYoungModulus(TypedDict, total=False):
    """Longitudinal Young modulus, Pa."""

    start: float
    """Value at which the search starts, within the bounds; for a quantity of the setup by
    default its value there. Range: above 0.0."""

    bounds: Sequence[float]
    """[lower, upper] of a free parameter."""

    fixed: float
    """Instead of both: the value of a parameter that is held fixed. Range: above 0.0."""


class ParametersLongitudinalPoissonRatio(TypedDict, total=False):
    """Longitudinal Poisson ratio."""

    start: float
    """Value at which the search starts, within the bounds; for a quantity of the setup by
    default its value there."""

    bounds: Sequence[float]
    """[lower, upper] of a free parameter."""

    fixed: float
    """Instead of both: the value of a parameter that is held fixed."""


class ParametersLongitudinalShearModulus(TypedDict, total=False):
    """Longitudinal shear modulus, Pa."""

    start: float
    """Value at which the search starts, within the bounds; for a quantity of the setup by
    default its value there. Range: above 0.0."""

    bounds: Sequence[float]
    """[lower, upper] of a free parameter."""

    fixed: float
    """Instead of both: the value of a parameter that is held fixed. Range: above 0.0."""


class ParametersTransverseYoungModulus(TypedDict, total=False):
    """Transverse Young modulus, Pa."""

    start: float
    """Value at which the search starts, within the bounds; for a quantity of the setup by
    default its value there. Range: above 0.0."""

    bounds: Sequence[float]
    """[lower, upper] of a free parameter."""

    fixed: float
    """Instead of both: the value of a parameter that is held fixed. Range: above 0.0."""


class ParametersTransversePoissonRatio(TypedDict, total=False):
    """Transverse Poisson ratio."""

    start: float
    """Value at which the search starts, within the bounds; for a quantity of the setup by
    default its value there. Range: above -1.0, below 1.0."""

    bounds: Sequence[float]
    """[lower, upper] of a free parameter."""

    fixed: float
    """Instead of both: the value of a parameter that is held fixed. Range: above -1.0, below
    1.0."""


class ParametersDispersion(TypedDict, total=False):
    """Dispersion of the random elasticity."""

    start: float
    """Value at which the search starts, within the bounds; for a quantity of the setup by
    default its value there. Range: above 0.0, below 0.7977240352174656."""

    bounds: Sequence[float]
    """[lower, upper] of a free parameter."""

    fixed: float
    """Instead of both: the value of a parameter that is held fixed. Range: above 0.0, below
    0.7977240352174656."""


class ParametersBoneThickness(TypedDict, total=False):
    """Thickness of the bone, m."""

    start: float
    """Value at which the search starts, within the bounds; for a quantity of the setup by
    default its value there. Range: above 0.0."""

    bounds: Sequence[float]
    """[lower, upper] of a free parameter."""


class ParametersBoneQualityFactor(TypedDict, total=False):
    """Quality factor of the bone."""

    start: float
    """Value at which the search starts, within the bounds; for a quantity of the setup by
    default its value there. Range: at least 2.0."""

    bounds: Sequence[float]
    """[lower, upper] of a free parameter."""


class ParametersCouplingSoundSpeed(TypedDict, total=False):
    """Speed of sound of the coupling layer, m/s."""

    start: float
    """Value at which the search starts, within the bounds; for a quantity of the setup by
    default its value there. Range: above 0.0."""

    bounds: Sequence[float]
    """[lower, upper] of a free parameter."""


class Parameters(TypedDict, total=False):
    """The range of each parameter: fixed, or free between bounds."""

    density: ParametersDensity
    """Mass density of the bone, kg/m³."""

    longitudinal_young_modulus: ParametersLongitudinalYoungModulus
    """Longitudinal Young modulus, Pa."""

    longitudinal_poisson_ratio: ParametersLongitudinalPoissonRatio
    """Longitudinal Poisson ratio."""

    longitudinal_shear_modulus: ParametersLongitudinalShearModulus
    """Longitudinal shear modulus, Pa."""

    transverse_young_modulus: ParametersTransverseYoungModulus
    """Transverse Young modulus, Pa."""

    transverse_poisson_ratio: ParametersTransversePoissonRatio
    """Transverse Poisson ratio."""

    dispersion: ParametersDispersion
    """Dispersion of the random elasticity."""

    bone_thickness: ParametersBoneThickness
    """Thickness of the bone, m."""

    bone_quality_factor: ParametersBoneQualityFactor
    """Quality factor of the bone."""

    coupling_sound_speed: ParametersCouplingSoundSpeed
    """Speed of sound of the coupling layer, m/s."""

    material: Literal["human-radius-desceliers", "human-femur-ashman-1984", "human-femur-dong-2004", "human-femur-dry-yoon-1976", "human-tibia-rho-1996", "bovine-femur-haversian-katz-1984", "bovine-femur-plexiform-katz-1984", "bovine-femur-van-buskirk-1981", "bovine-phalanx-lang-1969", "sawbones-cortical-2016"]
    """Name of a material (osteon materials lists them): parameters that are left out are fixed
    at its values, and those with bounds alone start there; the dispersion must be given."""


class RandomBoneThickness(TypedDict, total=False):
    """Scatter of the bone's thickness about layers.bone.thickness."""

    standard_deviation: float
    """Standard deviation; without it, the quantity is the same in all realizations. Range:
    above 0.0."""

    distribution: Literal["normal", "log_normal", "uniform"]
    """Only with standard_deviation: law with the setup's value as mean; a log-normal one
    requires a mean above 0. Normal laws end at five standard deviations. Default: "normal"."""


class RandomBoneQualityFactor(TypedDict, total=False):
    """Scatter of the bone's quality factor about layers.bone.attenuation.quality_factor, which
    must be given."""

    standard_deviation: float
    """Standard deviation; without it, the quantity is the same in all realizations. Range:
    above 0.0."""

    distribution: Literal["normal", "log_normal", "uniform"]
    """Only with standard_deviation: law with the setup's value as mean; a log-normal one
    requires a mean above 0. Normal laws end at five standard deviations. Default: "normal"."""


class RandomCouplingSoundSpeed(TypedDict, total=False):
    """Scatter of the coupling layer's speed of sound about layers.coupling.sound_speed."""

    standard_deviation: float
    """Standard deviation; without it, the quantity is the same in all realizations. Range:
    above 0.0."""

    distribution: Literal["normal", "log_normal", "uniform"]
    """Only with standard_deviation: law with the setup's value as mean; a log-normal one
    requires a mean above 0. Normal laws end at five standard deviations. Default: "normal"."""


class RandomProbeTilt(TypedDict, total=False):
    """Scatter of the probe's tilt about probe.tilt."""

    standard_deviation: float
    """Standard deviation; without it, the quantity is the same in all realizations. Range:
    above 0.0."""

    distribution: Literal["normal", "log_normal", "uniform"]
    """Only with standard_deviation: law with the setup's value as mean; a log-normal one
    requires a mean above 0. Normal laws end at five standard deviations. Default: "normal"."""


class Random(TypedDict, total=False):
    """Quantities of the setup that differ from realization to realization."""

    bone_thickness: RandomBoneThickness
    """Scatter of the bone's thickness about layers.bone.thickness."""

    bone_quality_factor: RandomBoneQualityFactor
    """Scatter of the bone's quality factor about layers.bone.attenuation.quality_factor, which
    must be given."""

    coupling_sound_speed: RandomCouplingSoundSpeed
    """Scatter of the coupling layer's speed of sound about layers.coupling.sound_speed."""

    probe_tilt: RandomProbeTilt
    """Scatter of the probe's tilt about probe.tilt."""


class MonteCarlo(TypedDict, total=False):
    """Settings of the Monte Carlo loop."""

    realizations: int
    """Number of realizations of each evaluation. Range: at least 1, at most 10000000. Default:
    2747."""

    seed: int
    """Seed of the random numbers (germs). Range: at least 0, at most 9223372036854775807.
    Default: 1."""

    sampling: Literal["monte_carlo", "sobol"]
    """"monte_carlo": independent germs, one ChaCha20 stream per realization; "sobol": scrambled
    Sobol' points; about a thousand are as accurate as millions of independent germs
    (physics.md). Default: "monte_carlo"."""

    scrambles: int
    """With "sobol": number of independent scrambles over which the realizations are divided
    evenly; with several, standard errors come from their scatter. Must divide realizations;
    must be 1 with "monte_carlo". Range: at least 1, at most 1024. Default: 1."""

    control_variate: bool
    """True: the moments are corrected by those of √(c1111/ρ), which are known exactly
    (physics.md); not used at a point at which any realization failed. Default: False."""

    max_failed_fraction: float
    """A point with a larger share of failed realizations is infeasible. Range: at least 0.0, at
    most 1.0. Default: 0.01."""


class Objective(TypedDict, total=False):
    """The function to be minimised."""

    kind: Literal["moments", "likelihood", "chi_square"]
    """"moments": the paper's cost; "chi_square": the same differences weighted by the noise of
    the data (searches.md), which is the default of a search where velocities or data.count are
    given; "likelihood": minus the mean log likelihood of the measured velocities under the
    model's distribution (searches.md); it requires velocities, the search "simplex" and at
    least two realizations. Default: "moments"."""


class SearchPriorsDensity(TypedDict, total=False):
    """Mass density of the bone, kg/m³."""

    value: float
    """Value expected from prior knowledge, within the bounds; the cost grows with the distance
    from it. Range: above 0.0."""

    weight: float
    """Increase of the cost if the parameter is off by the full width of its bounds; above 0.
    Range: above 0.0."""


class SearchPriorsLongitudinalYoungModulus(TypedDict, total=False):
    """Longitudinal Young modulus, Pa."""

    value: float
    """Value expected from prior knowledge, within the bounds; the cost grows with the distance
    from it. Range: above 0.0."""

    weight: float
    """Increase of the cost if the parameter is off by the full width of its bounds; above 0.
    Range: above 0.0."""


class SearchPriorsLongitudinalPoissonRatio(TypedDict, total=False):
    """Longitudinal Poisson ratio."""

    value: float
    """Value expected from prior knowledge, within the bounds; the cost grows with the distance
    from it."""

    weight: float
    """Increase of the cost if the parameter is off by the full width of its bounds; above 0.
    Range: above 0.0."""


class SearchPriorsLongitudinalShearModulus(TypedDict, total=False):
    """Longitudinal shear modulus, Pa."""

    value: float
    """Value expected from prior knowledge, within the bounds; the cost grows with the distance
    from it. Range: above 0.0."""

    weight: float
    """Increase of the cost if the parameter is off by the full width of its bounds; above 0.
    Range: above 0.0."""


class SearchPriorsTransverseYoungModulus(TypedDict, total=False):
    """Transverse Young modulus, Pa."""

    value: float
    """Value expected from prior knowledge, within the bounds; the cost grows with the distance
    from it. Range: above 0.0."""

    weight: float
    """Increase of the cost if the parameter is off by the full width of its bounds; above 0.
    Range: above 0.0."""


class SearchPriorsTransversePoissonRatio(TypedDict, total=False):
    """Transverse Poisson ratio."""

    value: float
    """Value expected from prior knowledge, within the bounds; the cost grows with the distance
    from it. Range: above -1.0, below 1.0."""

    weight: float
    """Increase of the cost if the parameter is off by the full width of its bounds; above 0.
    Range: above 0.0."""


class SearchPriorsDispersion(TypedDict, total=False):
    """Dispersion of the random elasticity."""

    value: float
    """Value expected from prior knowledge, within the bounds; the cost grows with the distance
    from it. Range: above 0.0, below 0.7977240352174656."""

    weight: float
    """Increase of the cost if the parameter is off by the full width of its bounds; above 0.
    Range: above 0.0."""


class SearchPriorsBoneThickness(TypedDict, total=False):
    """Thickness of the bone, m."""

    value: float
    """Value expected from prior knowledge, within the bounds; the cost grows with the distance
    from it. Range: above 0.0."""

    weight: float
    """Increase of the cost if the parameter is off by the full width of its bounds; above 0.
    Range: above 0.0."""


class SearchPriorsBoneQualityFactor(TypedDict, total=False):
    """Quality factor of the bone."""

    value: float
    """Value expected from prior knowledge, within the bounds; the cost grows with the distance
    from it. Range: at least 2.0."""

    weight: float
    """Increase of the cost if the parameter is off by the full width of its bounds; above 0.
    Range: above 0.0."""


class SearchPriorsCouplingSoundSpeed(TypedDict, total=False):
    """Speed of sound of the coupling layer, m/s."""

    value: float
    """Value expected from prior knowledge, within the bounds; the cost grows with the distance
    from it. Range: above 0.0."""

    weight: float
    """Increase of the cost if the parameter is off by the full width of its bounds; above 0.
    Range: above 0.0."""


class SearchPriors(TypedDict, total=False):
    """For each free parameter that has one: { value = …, weight = … }; the cost grows by weight
    × ((p - value)/(upper - lower))² (searches.md). The value must be within the bounds, the
    weight above 0; only with "simplex"."""

    density: SearchPriorsDensity
    """Mass density of the bone, kg/m³."""

    longitudinal_young_modulus: SearchPriorsLongitudinalYoungModulus
    """Longitudinal Young modulus, Pa."""

    longitudinal_poisson_ratio: SearchPriorsLongitudinalPoissonRatio
    """Longitudinal Poisson ratio."""

    longitudinal_shear_modulus: SearchPriorsLongitudinalShearModulus
    """Longitudinal shear modulus, Pa."""

    transverse_young_modulus: SearchPriorsTransverseYoungModulus
    """Transverse Young modulus, Pa."""

    transverse_poisson_ratio: SearchPriorsTransversePoissonRatio
    """Transverse Poisson ratio."""

    dispersion: SearchPriorsDispersion
    """Dispersion of the random elasticity."""

    bone_thickness: SearchPriorsBoneThickness
    """Thickness of the bone, m."""

    bone_quality_factor: SearchPriorsBoneQualityFactor
    """Quality factor of the bone."""

    coupling_sound_speed: SearchPriorsCouplingSoundSpeed
    """Speed of sound of the coupling layer, m/s."""


class Search(TypedDict, total=False):
    """Settings of the search."""

    method: Literal["simplex", "newton", "posterior"]
    """"simplex": Nelder-Mead with the standard coefficients; "newton": Gauss-Newton steps to
    the matching point nearest to the start (searches.md), which requires at least two
    realizations; "posterior": no search, the posterior alone, with the defaults of [posterior]
    if that is left out. Default: "simplex"."""

    max_evaluations: int
    """Maximum number of evaluations of each search (from one start, for one group); all
    searches of a job together may have at most 1 000 000. Range: at least 1, at most 1000000.
    Default: 400."""

    cost_tolerance: float
    """The search ends at a cost of at most this (default with "newton": 1e-12, with the
    objective "chi_square": 1e-4); with "likelihood" it has no effect: the search ends when
    size_tolerance is reached. Range: at least 0.0. Default: 1e-10."""

    size_tolerance: float
    """The search also ends if it no longer improves and the simplex has shrunk to this fraction
    of the box, or the step of "newton" is at most this long. Range: at least 0.0, below 1.0.
    Default: 0.00001."""

    initial_step: float
    """Edge of the first simplex; other methods have no use for it. Range: above 0.0, at most
    0.5. Default: 0.15."""

    starts: int
    """Number of searches for each set of data: the first from the point given by the
    parameters' start, the others from random points of the box (searches.md). Range: at least
    1, at most 1000. Default: 1."""

    first_start: int
    """Index of the first start: 0 is the point given by the parameters' start, k the k-th
    random point. first_start = 10 continues a job that had starts = 10. Range: at least 0, at
    most 1000. Default: 0."""

    sensitivities: bool
    """After the search the derivatives of both moments are computed at the best point, with one
    evaluation for each free parameter; identified in the result requires them (searches.md).
    Default: True."""

    priors: SearchPriors
    """For each free parameter that has one: { value = …, weight = … }; the cost grows by weight
    × ((p - value)/(upper - lower))² (searches.md). The value must be within the bounds, the
    weight above 0; only with "simplex"."""


class PosteriorPriorsDensity(TypedDict, total=False):
    """Mass density of the bone, kg/m³."""

    distribution: Literal["uniform", "normal", "log_normal"]
    """Law of the prior within the bounds: "uniform", "normal" or "log_normal"; parameters
    without a prior have a uniform one."""

    center: float
    """Mean of a normal prior, or median of a log-normal one, before it is truncated to the
    bounds; at most ten spreads outside them, and above 0 for "log_normal"."""

    spread: float
    """Standard deviation of a normal prior, in the unit of the parameter, or of the natural
    logarithm under a log-normal one; above 0. Range: above 0.0."""


class PosteriorPriorsLongitudinalYoungModulus(TypedDict, total=False):
    """Longitudinal Young modulus, Pa."""

    distribution: Literal["uniform", "normal", "log_normal"]
    """Law of the prior within the bounds: "uniform", "normal" or "log_normal"; parameters
    without a prior have a uniform one."""

    center: float
    """Mean of a normal prior, or median of a log-normal one, before it is truncated to the
    bounds; at most ten spreads outside them, and above 0 for "log_normal"."""

    spread: float
    """Standard deviation of a normal prior, in the unit of the parameter, or of the natural
    logarithm under a log-normal one; above 0. Range: above 0.0."""


class PosteriorPriorsLongitudinalPoissonRatio(TypedDict, total=False):
    """Longitudinal Poisson ratio."""

    distribution: Literal["uniform", "normal", "log_normal"]
    """Law of the prior within the bounds: "uniform", "normal" or "log_normal"; parameters
    without a prior have a uniform one."""

    center: float
    """Mean of a normal prior, or median of a log-normal one, before it is truncated to the
    bounds; at most ten spreads outside them, and above 0 for "log_normal"."""

    spread: float
    """Standard deviation of a normal prior, in the unit of the parameter, or of the natural
    logarithm under a log-normal one; above 0. Range: above 0.0."""


class PosteriorPriorsLongitudinalShearModulus(TypedDict, total=False):
    """Longitudinal shear modulus, Pa."""

    distribution: Literal["uniform", "normal", "log_normal"]
    """Law of the prior within the bounds: "uniform", "normal" or "log_normal"; parameters
    without a prior have a uniform one."""

    center: float
    """Mean of a normal prior, or median of a log-normal one, before it is truncated to the
    bounds; at most ten spreads outside them, and above 0 for "log_normal"."""

    spread: float
    """Standard deviation of a normal prior, in the unit of the parameter, or of the natural
    logarithm under a log-normal one; above 0. Range: above 0.0."""


class PosteriorPriorsTransverseYoungModulus(TypedDict, total=False):
    """Transverse Young modulus, Pa."""

    distribution: Literal["uniform", "normal", "log_normal"]
    """Law of the prior within the bounds: "uniform", "normal" or "log_normal"; parameters
    without a prior have a uniform one."""

    center: float
    """Mean of a normal prior, or median of a log-normal one, before it is truncated to the
    bounds; at most ten spreads outside them, and above 0 for "log_normal"."""

    spread: float
    """Standard deviation of a normal prior, in the unit of the parameter, or of the natural
    logarithm under a log-normal one; above 0. Range: above 0.0."""


class PosteriorPriorsTransversePoissonRatio(TypedDict, total=False):
    """Transverse Poisson ratio."""

    distribution: Literal["uniform", "normal", "log_normal"]
    """Law of the prior within the bounds: "uniform", "normal" or "log_normal"; parameters
    without a prior have a uniform one."""

    center: float
    """Mean of a normal prior, or median of a log-normal one, before it is truncated to the
    bounds; at most ten spreads outside them, and above 0 for "log_normal"."""

    spread: float
    """Standard deviation of a normal prior, in the unit of the parameter, or of the natural
    logarithm under a log-normal one; above 0. Range: above 0.0."""


class PosteriorPriorsDispersion(TypedDict, total=False):
    """Dispersion of the random elasticity."""

    distribution: Literal["uniform", "normal", "log_normal"]
    """Law of the prior within the bounds: "uniform", "normal" or "log_normal"; parameters
    without a prior have a uniform one."""

    center: float
    """Mean of a normal prior, or median of a log-normal one, before it is truncated to the
    bounds; at most ten spreads outside them, and above 0 for "log_normal"."""

    spread: float
    """Standard deviation of a normal prior, in the unit of the parameter, or of the natural
    logarithm under a log-normal one; above 0. Range: above 0.0."""


class PosteriorPriorsBoneThickness(TypedDict, total=False):
    """Thickness of the bone, m."""

    distribution: Literal["uniform", "normal", "log_normal"]
    """Law of the prior within the bounds: "uniform", "normal" or "log_normal"; parameters
    without a prior have a uniform one."""

    center: float
    """Mean of a normal prior, or median of a log-normal one, before it is truncated to the
    bounds; at most ten spreads outside them, and above 0 for "log_normal"."""

    spread: float
    """Standard deviation of a normal prior, in the unit of the parameter, or of the natural
    logarithm under a log-normal one; above 0. Range: above 0.0."""


class PosteriorPriorsBoneQualityFactor(TypedDict, total=False):
    """Quality factor of the bone."""

    distribution: Literal["uniform", "normal", "log_normal"]
    """Law of the prior within the bounds: "uniform", "normal" or "log_normal"; parameters
    without a prior have a uniform one."""

    center: float
    """Mean of a normal prior, or median of a log-normal one, before it is truncated to the
    bounds; at most ten spreads outside them, and above 0 for "log_normal"."""

    spread: float
    """Standard deviation of a normal prior, in the unit of the parameter, or of the natural
    logarithm under a log-normal one; above 0. Range: above 0.0."""


class PosteriorPriorsCouplingSoundSpeed(TypedDict, total=False):
    """Speed of sound of the coupling layer, m/s."""

    distribution: Literal["uniform", "normal", "log_normal"]
    """Law of the prior within the bounds: "uniform", "normal" or "log_normal"; parameters
    without a prior have a uniform one."""

    center: float
    """Mean of a normal prior, or median of a log-normal one, before it is truncated to the
    bounds; at most ten spreads outside them, and above 0 for "log_normal"."""

    spread: float
    """Standard deviation of a normal prior, in the unit of the parameter, or of the natural
    logarithm under a log-normal one; above 0. Range: above 0.0."""


class PosteriorPriors(TypedDict, total=False):
    """For each free parameter whose prior is not uniform within its bounds: { distribution =
    "normal", center = …, spread = … }, with mean and standard deviation, or "log_normal", with
    the median and the standard deviation of the natural logarithm; both are truncated to the
    bounds."""

    density: PosteriorPriorsDensity
    """Mass density of the bone, kg/m³."""

    longitudinal_young_modulus: PosteriorPriorsLongitudinalYoungModulus
    """Longitudinal Young modulus, Pa."""

    longitudinal_poisson_ratio: PosteriorPriorsLongitudinalPoissonRatio
    """Longitudinal Poisson ratio."""

    longitudinal_shear_modulus: PosteriorPriorsLongitudinalShearModulus
    """Longitudinal shear modulus, Pa."""

    transverse_young_modulus: PosteriorPriorsTransverseYoungModulus
    """Transverse Young modulus, Pa."""

    transverse_poisson_ratio: PosteriorPriorsTransversePoissonRatio
    """Transverse Poisson ratio."""

    dispersion: PosteriorPriorsDispersion
    """Dispersion of the random elasticity."""

    bone_thickness: PosteriorPriorsBoneThickness
    """Thickness of the bone, m."""

    bone_quality_factor: PosteriorPriorsBoneQualityFactor
    """Quality factor of the bone."""

    coupling_sound_speed: PosteriorPriorsCouplingSoundSpeed
    """Speed of sound of the coupling layer, m/s."""


class Posterior(TypedDict, total=False):
    """If this section is there, even without keys, the posterior of the free parameters is
    computed after the search (searches.md); it requires at least two realizations, and
    identify."""

    draws: int
    """Number of draws of equal weight in posterior.csv. Range: at least 100, at most 20000.
    Default: 2000."""

    max_evaluations: int
    """Maximum number of points evaluated for the posterior of one set of data; it usually needs
    fewer. Range: at least 20, at most 2000. Default: 400."""

    priors: PosteriorPriors
    """For each free parameter whose prior is not uniform within its bounds: { distribution =
    "normal", center = …, spread = … }, with mean and standard deviation, or "log_normal", with
    the median and the standard deviation of the natural logarithm; both are truncated to the
    bounds."""
