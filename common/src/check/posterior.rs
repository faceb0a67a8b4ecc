//! Rules on the posterior.

use crate::accepted::Interval;
use crate::job::{
    Data, JobKind, JobSpecification, PosteriorPrior, PosteriorSettings, PriorDistribution, Range,
};
use crate::limits::DRAWS_ALL_MAX;
use crate::parameters::Parameter;
use crate::violations::Violations;

use super::section::section;
use super::value::{known_wrong, number, quantity};

/// Maximum distance of a prior's center from the bounds, in spreads: a normal law has a probability
/// of 1e-23 beyond.
const SPREADS_MAX: f64 = 10.0;

/// Records all violations of the settings of a posterior by themselves, and in relation to the
/// parameters of a job.
pub fn posterior(
    specification: &JobSpecification,
    settings: &PosteriorSettings,
    violations: &mut Violations,
) {
    let (mut checked, mut default) = (*settings, PosteriorSettings::default());
    section("posterior", &mut checked, &mut default, violations);
    for (parameter, law) in Parameter::ALL.into_iter().zip(settings.priors) {
        prior(parameter, law, specification.range(parameter), violations);
    }
}

/// Checks the posterior of a job, and what else the job needs for it.
pub(super) fn posterior_of_job(specification: &JobSpecification, violations: &mut Violations) {
    let identifies = specification.kind == JobKind::Identification;
    let Some(settings) = &specification.posterior else {
        if identifies && !specification.is_searched() && !known_wrong("posterior", violations) {
            violations.add("posterior", "is missing; the search method \"posterior\" needs it");
        }
        return;
    };
    if !identifies {
        if !known_wrong("posterior", violations) {
            violations.add("posterior", "a propagation has no posterior; leave it out");
        }
        return;
    }
    if specification.setup.structure.has_fixed_solids() && !known_wrong("posterior", violations) {
        // The solution for a pivot takes it that the whole bone follows the parameters.
        let message = "is not computed for a bone of which sublayers have solids of their own; leave it out, \
                       or give each of bone.sublayers a porosity";
        violations.add("posterior", message);
    }
    posterior(specification, settings, violations);
    let realizations = "monte_carlo.realizations";
    if specification.monte_carlo.realizations == 1 && !known_wrong(realizations, violations) {
        violations.add(
            realizations,
            "is 1; a posterior needs the distribution of the velocities, hence at least 2 realizations",
        );
    }
    all_draws(specification, settings, violations);
    noise(specification, violations);
}

/// Refuses moments without the number of velocities behind them: nothing says how accurate they are.
fn noise(specification: &JobSpecification, violations: &mut Violations) {
    let unknown = specification
        .data
        .as_ref()
        .is_some_and(|data| data.has_only_moments() && data.count(0).is_none());
    if unknown && !known_wrong("data.count", violations) {
        violations.add(
            "data.count",
            "is missing; a posterior needs the number of velocities behind the moments, or the \
             velocities",
        );
    }
}

/// Checks the number of draws from the posteriors of all groups.
fn all_draws(
    specification: &JobSpecification,
    settings: &PosteriorSettings,
    violations: &mut Violations,
) {
    if ["posterior.draws", "data"].iter().any(|field| known_wrong(field, violations)) {
        return;
    }
    let sets = specification.data.as_ref().map_or(1, Data::searchable_count) as u64;
    let draws = settings.draws;
    if draws.saturating_mul(sets) > DRAWS_ALL_MAX {
        let message =
            format!("is {draws}, for each of {sets} groups; all together may have {DRAWS_ALL_MAX}");
        violations.add("posterior.draws", message);
    }
}

fn prior(parameter: Parameter, law: PosteriorPrior, range: Range, violations: &mut Violations) {
    let path = format!("posterior.priors.{}", parameter.name());
    let Some([center, spread]) = law.numbers() else { return };
    let (center_path, spread_path) = (format!("{path}.center"), format!("{path}.spread"));
    let unit = parameter.unit();
    let by_logarithm = law.distribution() == PriorDistribution::LogNormal;
    let (centers, spreads) = if by_logarithm {
        (Interval::above(0.0, unit), Interval::above(0.0, ""))
    } else {
        (Interval::finite(unit), Interval::above(0.0, unit))
    };
    quantity(&center_path, center, centers, parameter.row().plausible, violations);
    number(&spread_path, spread, spreads, violations);
    let Range::Free { lower, upper, .. } = range else {
        if !violations.has_at_or_below(&path) {
            violations.add(path, "is for a parameter that is fixed; only free ones have priors");
        }
        return;
    };
    let bounds = format!("parameters.{}", parameter.name());
    if [&bounds, &center_path, &spread_path].iter().any(|field| known_wrong(field, violations)) {
        return;
    }
    let distance = if by_logarithm {
        distance(libm::log(center), [lower, upper].map(logarithm), spread)
    } else {
        distance(center, [lower, upper], spread)
    };
    if distance > SPREADS_MAX {
        violations.add(
            center_path,
            format!(
                "is {center:?}, more than {SPREADS_MAX} spreads outside the bounds {lower:?} to \
                 {upper:?}, where such a prior has no probability"
            ),
        );
    }
}

/// Returns the logarithm of a bound; -∞ for one at or below 0, where a log-normal law has nothing.
fn logarithm(bound: f64) -> f64 {
    if bound > 0.0 { libm::log(bound) } else { f64::NEG_INFINITY }
}

/// Returns how far a center is outside the bounds, in spreads; 0 within them.
fn distance(center: f64, [lower, upper]: [f64; 2], spread: f64) -> f64 {
    (lower - center).max(center - upper).max(0.0) / spread
}
