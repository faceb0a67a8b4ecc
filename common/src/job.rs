//! The specification of a job: everything that its result depends on.

use crate::case::Setup;
use crate::fields::{Key, Section};
use crate::group_settings::GroupSettings;
use crate::inference::data_noise;
use crate::moments::MomentMatrix;
use crate::observables::ObservableSet;
use crate::parameters::{self, AS_IN_SETUP, BONE_PARAMETERS, PARAMETERS, Parameter, Point};
use crate::random_quantities::RandomQuantities;
use crate::realization::{Ensemble, PointError};
use crate::systematic::{Shift, Systematic, SystematicQuantity, Uncertain};

pub use crate::data::{Data, Group, Measurements, NoVariation, VelocitySet};
pub use crate::monte_carlo::{MonteCarlo, Sampling};
pub use crate::posterior_settings::{
    DRAWS_MAX, POSTERIOR_EVALUATIONS_MAX, PosteriorPrior, PosteriorSettings, PriorDistribution,
};
pub use crate::search_settings::{Objective, Prior, Search, SearchMethod};

/// Kind of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JobKind {
    /// Searches for the point whose moments match the data's.
    Identification,
    /// Evaluates the moments at the fixed/start point; no search.
    Propagation,
}

impl JobKind {
    /// Returns the name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Identification => "identification",
            Self::Propagation => "propagation",
        }
    }
}

/// The range of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// Held at a value.
    Fixed(f64),
    /// Searched between bounds.
    Free {
        /// Starting value; lower ≤ start ≤ upper.
        start: f64,
        /// Lower bound.
        lower: f64,
        /// Upper bound, above the lower one.
        upper: f64,
    },
}

/// A value at most this far from a bound, as a fraction of the range, counts as lying on it: a
/// simplex that a bound stops comes near it, but not onto it.
pub const ON_BOUND: f64 = 1e-4;

impl Range {
    /// The range of a parameter of the setup that is not searched.
    pub const AS_IN_SETUP: Self = Self::Fixed(AS_IN_SETUP);

    /// Returns the ranges of all parameters, given those of [`Parameter::OF_BONE`]; those of the setup
    /// are not searched.
    pub const fn of_bone(ranges: [Self; BONE_PARAMETERS]) -> [Self; PARAMETERS] {
        parameters::extended(ranges, Self::AS_IN_SETUP)
    }

    /// Returns the distance of the bounds, in the parameter's unit; 0 if it is fixed.
    pub fn edge(&self) -> f64 {
        match *self {
            Self::Fixed(_) => 0.0,
            Self::Free { lower, upper, .. } => upper - lower,
        }
    }

    /// Returns the position of a value between the bounds, 0 at the lower and 1 at the upper;
    /// `None` if the parameter is fixed.
    pub fn coordinate(&self, value: f64) -> Option<f64> {
        match *self {
            Self::Fixed(_) => None,
            Self::Free { lower, upper, .. } => Some((value - lower) / (upper - lower)),
        }
    }

    /// Returns whether a value lies on a bound; never if the parameter is fixed.
    pub fn is_on_bound(&self, value: f64) -> bool {
        let at = self.coordinate(value);
        at.is_some_and(|at| !(ON_BOUND..=1.0 - ON_BOUND).contains(&at))
    }

    /// Returns the fixed value, or the start.
    pub fn start(&self) -> f64 {
        match *self {
            Self::Fixed(value) => value,
            Self::Free { start, .. } => start,
        }
    }
}

/// Everything that a job's result depends on, with defaults filled in and data inlined.
#[derive(Debug, Clone, PartialEq)]
pub struct JobSpecification {
    /// Identification or propagation.
    pub kind: JobKind,
    /// Layers, probe, picking, solver.
    pub setup: Setup,
    /// The measured velocities; present for an identification, absent for a propagation.
    pub data: Option<Data>,
    /// Ranges of [`Parameter::ALL`], in that order.
    pub parameters: [Range; PARAMETERS],
    /// Scatter of quantities of the setup.
    pub random: RandomQuantities,
    /// Systematic errors: quantities of the setup that are not known exactly, and wrong in all data alike.
    pub systematic: Systematic,
    /// Whether the results of the groups of the data are pooled.
    pub groups: GroupSettings,
    /// Settings of the Monte Carlo loop.
    pub monte_carlo: MonteCarlo,
    /// The function to be minimised.
    pub objective: Objective,
    /// Settings of the search loop.
    pub search: Search,
    /// Settings of the posterior; `None` if none is asked for.
    pub posterior: Option<PosteriorSettings>,
}

/// The settings of a run that are sections of a job file.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RunSettings {
    /// Scatter of quantities of the setup.
    pub random: RandomQuantities,
    /// Systematic errors: quantities of the setup that are not known exactly, and wrong in all data alike.
    pub systematic: Systematic,
    /// Whether the results of the groups of the data are pooled.
    pub groups: GroupSettings,
    /// Settings of the Monte Carlo loop.
    pub monte_carlo: MonteCarlo,
    /// The function to be minimised.
    pub objective: Objective,
    /// Settings of the search loop.
    pub search: Search,
}

impl RunSettings {
    /// Returns each section with its key, in the order of a canonical file.
    pub fn sections(&mut self) -> [(Key, &mut dyn Section); 6] {
        [
            (
                Key {
                    name: "random",
                    meaning: "quantities of the setup that differ from realization to realization",
                },
                &mut self.random,
            ),
            (Systematic::KEY, &mut self.systematic),
            (GroupSettings::KEY, &mut self.groups),
            (
                Key { name: "monte_carlo", meaning: "settings of the Monte Carlo loop" },
                &mut self.monte_carlo,
            ),
            (
                Key { name: "objective", meaning: "the function to be minimised" },
                &mut self.objective,
            ),
            (Key { name: "search", meaning: "settings of the search" }, &mut self.search),
        ]
    }
}

/// Keys that a file or message leaves out, and whose default depends on others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Omitted {
    /// Whether the objective is left out.
    pub objective: bool,
    /// Whether the tolerance of the cost is left out.
    pub cost_tolerance: bool,
}

/// Returns whether the noise of all data that are searched is known.
fn has_known_noise(data: &Data) -> bool {
    let is_known = |covariance: MomentMatrix| covariance[0][0] > 0.0 && covariance[1][1] > 0.0;
    let found = |set| data_noise(data, set).is_some_and(|noise| is_known(noise.covariance));
    data.searchable_sets().all(found)
}

impl JobSpecification {
    /// Returns the settings of the run.
    pub fn run_settings(&self) -> RunSettings {
        let &Self { random, systematic, groups, monte_carlo, objective, search, .. } = self;
        RunSettings { random, systematic, groups, monte_carlo, objective, search }
    }

    /// Returns the observables that were measured, and that each realization must have therefore.
    pub fn observables(&self) -> ObservableSet {
        self.data.as_ref().map(Data::observables).unwrap_or_default()
    }

    /// Returns the range of one parameter.
    pub fn range(&self, parameter: Parameter) -> Range {
        self.parameters[parameter as usize]
    }

    /// Returns the parameters that have a range of their own: all of the bone that have an effect, and
    /// those of the setup that are searched.
    pub fn parameters_ranged(&self) -> impl Iterator<Item = Parameter> + '_ {
        let is_free = |parameter: &Parameter| matches!(self.range(*parameter), Range::Free { .. });
        let searched = Parameter::OF_SETUP.into_iter().filter(is_free);
        self.parameters_of_bone().chain(searched)
    }

    /// Returns the parameters of the bone that have an effect.
    fn parameters_of_bone(&self) -> impl Iterator<Item = Parameter> + '_ {
        let structure = &self.setup.structure;
        Parameter::OF_BONE.into_iter().filter(|parameter| !structure.ignores(*parameter))
    }

    /// Returns the parameters that points of an identification have: those with a range, and quantities
    /// of the setup that are known of each group.
    pub fn parameters_given(&self) -> impl Iterator<Item = Parameter> + '_ {
        // All groups have the same ones.
        let known = self.data.as_ref().map(|data| data.known(0)).unwrap_or_default();
        let has = move |parameter: &Parameter| {
            let is_free = matches!(self.range(*parameter), Range::Free { .. });
            is_free || known.get(*parameter).is_some()
        };
        self.parameters_of_bone().chain(Parameter::OF_SETUP.into_iter().filter(has))
    }

    /// Returns the ranges for set number `set` of the data: what is known of it is fixed.
    pub fn ranges_of(&self, set: usize) -> [Range; PARAMETERS] {
        let mut ranges = self.parameters;
        let known = self.data.as_ref().map(|data| data.known(set)).unwrap_or_default();
        for (parameter, value) in known.given() {
            ranges[parameter as usize] = Range::Fixed(value);
        }
        ranges
    }

    /// Returns the point of fixed values and starts for set number `set` of the data.
    pub fn start_of(&self, set: usize) -> Point {
        Point::new(self.ranges_of(set).map(|range| range.start()))
    }

    /// Returns the specification of the search for set number `set` of the data, without data.
    #[must_use]
    pub fn of_set(&self, set: usize) -> Self {
        Self { data: None, parameters: self.ranges_of(set), ..self.clone() }
    }

    /// Returns the parameters that are searched.
    pub fn free(&self) -> impl Iterator<Item = Parameter> + '_ {
        let is_free = |parameter: &Parameter| matches!(self.range(*parameter), Range::Free { .. });
        Parameter::ALL.into_iter().filter(is_free)
    }

    /// Returns the contribution of the priors to the cost of a point: the sum of w (p -
    /// prior)²/(upper - lower)² (Tikhonov regularisation).
    pub fn penalty(&self, point: &Point) -> f64 {
        let of = |parameter: Parameter| {
            let prior = self.search.priors[parameter as usize]?;
            let edge = self.range(parameter).edge();
            let off = (point.get(parameter) - prior.value) / edge;
            Some(prior.weight * (off * off))
        };
        Parameter::ALL.into_iter().filter_map(of).sum()
    }

    /// Returns whether there is a prior.
    pub fn has_priors(&self) -> bool {
        self.search.priors.iter().any(Option::is_some)
    }

    /// Returns the maximum number of evaluations of the whole job, including those that measure
    /// derivatives and those of the posterior.
    pub fn evaluations_max(&self) -> u64 {
        if self.kind == JobKind::Propagation {
            return 1;
        }
        let free = self.free().count() as u64;
        let differences = free + self.shifts(&self.start().setup(&self.setup)).len() as u64;
        let measured =
            if self.search.sensitivities && self.is_searched() { differences } else { 0 };
        let sampled = self.posterior.map_or(0, |posterior| posterior.max_evaluations);
        let sets = self.data.as_ref().map_or(1, Data::searchable_count) as u64;
        let each = self.searched_max().saturating_add(measured).saturating_add(sampled);
        each.saturating_mul(sets)
    }

    /// Returns the quantities of this setup that are the same for all data and not known exactly.
    pub fn uncertain(&self, setup: &Setup) -> Vec<Uncertain> {
        let is_searched = |quantity: SystematicQuantity| {
            self.free().any(|parameter| parameter.name() == quantity.name())
        };
        self.systematic.uncertain(setup, is_searched)
    }

    /// Returns the shifts of a setup by which the effects of what is not known exactly are measured.
    pub fn shifts(&self, setup: &Setup) -> Vec<Shift> {
        self.uncertain(setup).iter().flat_map(Uncertain::shifts).collect()
    }

    /// Returns the maximum number of evaluations of the searches of one set of data, from all
    /// starts; 0 if only the posterior is computed.
    pub fn searched_max(&self) -> u64 {
        let Search { max_evaluations, starts, .. } = self.search;
        if self.is_searched() { starts.saturating_mul(max_evaluations) } else { 0 }
    }

    /// Returns whether a search is made, and not the posterior alone computed.
    pub fn is_searched(&self) -> bool {
        self.search.method != SearchMethod::Posterior
    }

    /// Returns the specification with the defaults that depend on other keys, as files and messages
    /// are read: the default posterior if the method needs one and none is given; of what is
    /// `omitted`, the objective [`Objective::ChiSquare`] for a search whose data have a known noise,
    /// and the tolerance of objective and method.
    #[must_use]
    pub fn with_implied(mut self, omitted: Omitted) -> Self {
        let implied = self.kind == JobKind::Identification && !self.is_searched();
        self.posterior = self.posterior.or(implied.then(PosteriorSettings::default));
        let known = self.kind == JobKind::Identification && self.is_searched();
        if omitted.objective && known && self.data.as_ref().is_some_and(has_known_noise) {
            self.objective = Objective::ChiSquare;
        }
        if omitted.cost_tolerance {
            let Search { method, .. } = self.search;
            self.search.cost_tolerance = Search::default_tolerance(method, self.objective);
        }
        self
    }

    /// Returns the realizations at a point.
    ///
    /// # Errors
    /// Same as [`Ensemble::drawn`].
    pub fn ensemble(&self, point: &Point) -> Result<Ensemble, PointError> {
        Ok(Ensemble::drawn(point, self.monte_carlo.germs())?.with_random(self.random))
    }

    /// Returns the point of fixed values and starts.
    pub fn start(&self) -> Point {
        Point::new(self.parameters.map(|range| range.start()))
    }
}
