//! The specification of a job: everything that its result depends on.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::case::Setup;
use crate::germ_source::{GermScheme, GermSource};
use crate::parameters::{Parameter, Point};

/// What a job does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JobKind {
    /// Searches the point whose moments match the data's.
    Identification,
    /// Evaluates the moments at the fixed/start point; no search.
    Propagation,
}

impl JobKind {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Identification => "identification",
            Self::Propagation => "propagation",
        }
    }
}

/// What is known of the measured velocities.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    /// The velocities themselves, m/s, each finite and above 0, at least two.
    Velocities(Vec<f64>),
    /// Several sets of them: each group is identified by itself, in this order; at least one of them
    /// has two velocities that differ.
    Groups(Vec<Group>),
    /// Their mean, m/s, and coefficient of variation.
    Moments {
        /// Mean, m/s.
        mean: f64,
        /// Coefficient of variation.
        coefficient_of_variation: f64,
    },
}

/// The measured velocities of one group: a bone, a patient, a site.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Its name, unlike all others'; not empty, no control characters.
    pub name: String,
    /// m/s, each finite and above 0, at least one.
    pub velocities: Vec<f64>,
}

/// Why velocities have no coefficient of variation that a model could match.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum NoVariation {
    /// There is one.
    #[error("only one velocity: {NEEDS_TWO}")]
    OneVelocity,
    /// All are the same.
    #[error("all {count} velocities are {velocity:?} m/s: {NEEDS_TWO}")]
    AllEqual {
        /// How many there are.
        count: usize,
        /// The velocity, m/s.
        velocity: f64,
    },
}

const NEEDS_TWO: &str = "a coefficient of variation needs at least two different ones";

impl Group {
    /// Why no search can be made for this group; `None` if one can.
    pub fn no_variation(&self) -> Option<NoVariation> {
        match self.velocities.as_slice() {
            [_] => Some(NoVariation::OneVelocity),
            [velocity, others @ ..] if others.iter().all(|other| other == velocity) => {
                Some(NoVariation::AllEqual { count: self.velocities.len(), velocity: *velocity })
            }
            _ => None,
        }
    }
}

impl Data {
    /// The groups; none where the data are not grouped.
    pub fn groups(&self) -> &[Group] {
        match self {
            Self::Groups(groups) => groups,
            Self::Velocities(_) | Self::Moments { .. } => &[],
        }
    }

    /// How many sets of data there are, each to be identified by itself.
    pub fn sets(&self) -> usize {
        match self {
            Self::Groups(groups) => groups.len(),
            Self::Velocities(_) | Self::Moments { .. } => 1,
        }
    }

    /// How many of these a search can be made for.
    pub fn searched(&self) -> usize {
        let unsearched = self.groups().iter().filter(|group| group.no_variation().is_some());
        self.sets() - unsearched.count()
    }

    /// Name of each group; none where the data are not grouped.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.groups().iter().map(|group| group.name.as_str())
    }

    /// The velocities of a set, by its number; `None` where only their moments are known.
    pub fn velocities(&self, set: usize) -> Option<&[f64]> {
        match self {
            Self::Velocities(velocities) => Some(velocities),
            Self::Groups(groups) => groups.get(set).map(|group| group.velocities.as_slice()),
            Self::Moments { .. } => None,
        }
    }
}

/// Range of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Held at a value.
    Fixed(f64),
    /// Searched between bounds.
    Free {
        /// First value; lower ≤ start ≤ upper.
        start: f64,
        /// Lower bound.
        lower: f64,
        /// Upper bound, above the lower one.
        upper: f64,
    },
}

impl Range {
    /// Distance of the bounds, in the parameter's unit; 0 where it is fixed.
    pub fn edge(&self) -> f64 {
        match *self {
            Self::Fixed(_) => 0.0,
            Self::Free { lower, upper, .. } => upper - lower,
        }
    }

    /// Where a value lies between the bounds, 0 at the lower and 1 at the upper; `None` where the
    /// parameter is fixed.
    pub fn coordinate(&self, value: f64) -> Option<f64> {
        match *self {
            Self::Fixed(_) => None,
            Self::Free { lower, upper, .. } => Some((value - lower) / (upper - lower)),
        }
    }

    /// The fixed value, or the start.
    pub fn start(&self) -> f64 {
        match *self {
            Self::Fixed(value) => value,
            Self::Free { start, .. } => start,
        }
    }
}

/// How realizations are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// Independent germs, one ChaCha stream per realization.
    #[default]
    MonteCarlo,
    /// Scrambled Sobol' points.
    Sobol,
}

impl Sampling {
    /// Every sampling, in the order of a user's file.
    pub const ALL: [Self; 2] = [Self::MonteCarlo, Self::Sobol];

    /// Name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::MonteCarlo => "monte_carlo",
            Self::Sobol => "sobol",
        }
    }
}

/// The Monte Carlo loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MonteCarlo {
    /// Realizations of each evaluation, 1 to 10⁷.
    pub realizations: u64,
    /// Seed of the germs, 0 to 2⁶³-1.
    pub seed: u64,
    /// How germs are drawn.
    pub sampling: Sampling,
    /// Independent scrambles of the Sobol' points, among which the realizations are divided evenly:
    /// 1 to [`crate::limits::SCRAMBLES_MAX`], a divisor of their number; 1 for independent germs.
    pub scrambles: u64,
    /// Whether the moments are corrected by those of √(c1111/ρ), which the law knows.
    pub control_variate: bool,
    /// An evaluation with a larger fraction of failures is infeasible; 0 to 1.
    pub max_failed_fraction: f64,
}

impl Default for MonteCarlo {
    fn default() -> Self {
        Self {
            realizations: 2747,
            seed: 1,
            sampling: Sampling::MonteCarlo,
            scrambles: 1,
            control_variate: false,
            max_failed_fraction: 0.01,
        }
    }
}

impl MonteCarlo {
    /// Where the germs come from.
    pub fn germs(&self) -> GermSource {
        let scheme = match self.sampling {
            Sampling::MonteCarlo => GermScheme::Streams,
            Sampling::Sobol => GermScheme::Sobol { points: self.points() },
        };
        GermSource { seed: self.seed, scheme }
    }

    /// Realizations of each scramble.
    pub fn points(&self) -> u64 {
        self.realizations / self.scrambles.max(1)
    }
}

/// What is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// The paper's cost: relative squared errors of mean and coefficient of variation.
    #[default]
    Moments,
    /// Minus the mean log likelihood of the measured velocities under the law of the model's.
    Likelihood,
}

impl Objective {
    /// Every objective, in the order of a user's file.
    pub const ALL: [Self; 2] = [Self::Moments, Self::Likelihood];

    /// Name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Moments => "moments",
            Self::Likelihood => "likelihood",
        }
    }
}

/// How the minimum is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SearchMethod {
    /// The Nelder-Mead simplex (the paper's).
    #[default]
    Simplex,
    /// Minimum-norm Gauss-Newton steps with Broyden's updates.
    Newton,
}

impl SearchMethod {
    /// Every method, in the order of a user's file.
    pub const ALL: [Self; 2] = [Self::Simplex, Self::Newton];

    /// Name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Simplex => "simplex",
            Self::Newton => "newton",
        }
    }
}

/// A value that a free parameter is drawn to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Prior {
    /// The value, within the parameter's bounds, in its unit.
    pub value: f64,
    /// What the cost grows by where the parameter is off by the whole width of its bounds, above 0;
    /// by the square of less.
    pub weight: f64,
}

/// The search loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// How.
    pub method: SearchMethod,
    /// Most evaluations (points whose realizations are run).
    pub max_evaluations: u64,
    /// The search ends when the best cost is at most this; of no use to a likelihood, whose least cost
    /// nobody knows beforehand.
    pub cost_tolerance: f64,
    /// The search ends when the simplex, or a step without gain, is at most this large, as a
    /// fraction of the box.
    pub size_tolerance: f64,
    /// Edge of the first simplex, as a fraction of the box; of no use to other methods.
    pub initial_step: f64,
    /// Searches of each set of data: the first from the starts of the parameters, the others from
    /// random points of the box; 1 to [`crate::limits::STARTS_MAX`].
    pub starts: u64,
    /// Whether the derivatives of both moments are measured at the end, by one evaluation for each
    /// free parameter.
    pub sensitivities: bool,
    /// Values that [`Parameter::ALL`] are drawn to, in that order, where they are free.
    pub priors: [Option<Prior>; 7],
}

impl Search {
    /// The settings that a method has by default.
    pub fn by(method: SearchMethod) -> Self {
        Self {
            method,
            max_evaluations: 400,
            cost_tolerance: match method {
                SearchMethod::Simplex => 1e-10,
                SearchMethod::Newton => 1e-12,
            },
            size_tolerance: 1e-5,
            initial_step: 0.15,
            starts: 1,
            sensitivities: true,
            priors: [None; 7],
        }
    }
}

impl Default for Search {
    fn default() -> Self {
        Self::by(SearchMethod::default())
    }
}

/// Everything that a job's result depends on, defaults filled in, data inlined.
#[derive(Debug, Clone, PartialEq)]
pub struct JobSpecification {
    /// Identification or propagation.
    pub kind: JobKind,
    /// Layers, probe, picking, solver.
    pub setup: Setup,
    /// The measured velocities; present for an identification, absent for a propagation.
    pub data: Option<Data>,
    /// Ranges of [`Parameter::ALL`], in that order.
    pub parameters: [Range; 7],
    /// The Monte Carlo loop.
    pub monte_carlo: MonteCarlo,
    /// What is minimised.
    pub objective: Objective,
    /// How it is searched.
    pub search: Search,
}

impl JobSpecification {
    /// Range of one parameter.
    pub fn range(&self, parameter: Parameter) -> Range {
        self.parameters[parameter as usize]
    }

    /// What priors add to the cost of a point: w (p - prior)²/(upper - lower)², summed over them
    /// (Tikhonov's regularisation).
    pub fn penalty(&self, point: &Point) -> f64 {
        let of = |parameter: Parameter| {
            let prior = self.search.priors[parameter as usize]?;
            let edge = self.range(parameter).edge();
            let off = (point.get(parameter) - prior.value) / edge;
            Some(prior.weight * (off * off))
        };
        Parameter::ALL.into_iter().filter_map(of).sum()
    }

    /// Whether there is a prior.
    pub fn has_priors(&self) -> bool {
        self.search.priors.iter().any(Option::is_some)
    }

    /// Most evaluations of the whole job.
    pub fn evaluations_max(&self) -> u64 {
        if self.kind == JobKind::Propagation {
            return 1;
        }
        let Search { max_evaluations, starts, sensitivities, .. } = self.search;
        let free = self.parameters.iter().filter(|range| matches!(range, Range::Free { .. }));
        let measured = if sensitivities { free.count() as u64 } else { 0 };
        let sets = self.data.as_ref().map_or(1, Data::searched) as u64;
        starts.saturating_mul(max_evaluations).saturating_add(measured).saturating_mul(sets)
    }

    /// The point of fixed values and starts.
    pub fn start(&self) -> Point {
        Point(self.parameters.map(|range| range.start()))
    }
}
