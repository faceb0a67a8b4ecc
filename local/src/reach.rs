//! Data that are out of reach of a job's bounds. They are worth a warning and never change the job: the point
//! nearest to such data is a valid result, too.

use osteon_common::attainable_moments::{self, AttainableMoments};
use osteon_common::case::Setup;
use osteon_common::job::{JobKind, JobSpecification, Range};
use osteon_common::parameters::{PARAMETERS, Parameter, Point};
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::realization::mean_bone;
use osteon_common::results::Moments;
use osteon_common::sampling::pair_count;
use osteon_common::settings::SolverSettings;
use osteon_common::setup_quantity::SetupQuantity;
use osteon_solver::{Failure, Solver, Workspace};

/// Setups with more (frequency, wavenumber) pairs are not solved in advance, as it would take too
/// long.
const PAIRS_MAX: f64 = 2e5;
/// Fraction by which a mean may be beyond the velocities of mean models: g_L, which the closed form
/// does not contain, and the dispersion shift it by less.
const MEAN_MARGIN: f64 = 0.01;
/// The same for a coefficient of variation, whose closed form is a rough approximation.
const VARIATION_MARGIN: f64 = 0.05;
/// Number of standard errors by which measured moments may be off.
const ERRORS: f64 = 3.0;
/// Maximum number of groups with setups of their own whose velocities are solved for in advance.
const OWN_SETUPS_MAX: usize = 10;
/// Maximum number of groups that are named.
const GROUPS_LISTED_MAX: usize = 5;

/// Returns which data of an identification lie outside the moments that points within the bounds can
/// have, according to the solver's velocities of the mean models of smallest and largest √(c1111/ρ).
pub fn out_of_reach(specification: &JobSpecification) -> Vec<String> {
    let Some(data) = &specification.data else { return Vec::new() };
    let solver = SolverSettings::default();
    let setup = Setup { solver, ..specification.setup.clone() };
    if specification.kind != JobKind::Identification || pair_count(&setup) > PAIRS_MAX {
        return Vec::new();
    }
    let solved = ClosedFormMoments::new(specification, &setup);
    let own = |set: usize| {
        let is_own = !data.known(set).is_empty();
        is_own.then(|| ClosedFormMoments::new(&specification.of_set(set), &setup))
    };
    // A group with a setup of its own is solved by itself.
    let has_own = (0..data.sets()).any(|set| !data.known(set).is_empty());
    let sets = if has_own { data.sets().min(OWN_SETUPS_MAX) } else { data.sets() };
    let mut lines = Vec::new();
    if let Err(failure) = &solved.start
        && !has_own
    {
        lines.push(format!(
            "the mean model of the starts has no velocity ({}): {}",
            failure.kind.name(),
            failure.detail
        ));
    }
    let names: Vec<&str> = data.names().collect();
    let mut missed = 0;
    for set in 0..sets {
        let count = data.count(set);
        let own = own(set);
        let of_set =
            own.as_ref().unwrap_or(&solved).missed(specification, data.moments(set), count);
        missed += usize::from(!of_set.is_empty());
        if missed > GROUPS_LISTED_MAX {
            continue;
        }
        let of = names.get(set).map(|name| format!(" of the group {name:?}")).unwrap_or_default();
        lines.extend(of_set.into_iter().map(|(moment, rest)| format!("the {moment}{of} {rest}")));
    }
    if missed > GROUPS_LISTED_MAX {
        let more = missed - GROUPS_LISTED_MAX;
        lines.push(format!("{more} more groups are out of reach of the bounds"));
    }
    lines
}

/// Velocities of mean models, m/s, and coefficients of variation by the closed form.
struct ClosedFormMoments {
    slowest: Option<(Point, f64)>,
    fastest: Option<(Point, f64)>,
    start: Result<f64, Failure>,
    variation: (f64, f64),
}

impl ClosedFormMoments {
    fn new(specification: &JobSpecification, setup: &Setup) -> Self {
        let ranges = &specification.parameters;
        let (mut solver, mut workspace) = (Solver::new(setup), Workspace::default());
        let mut velocity = |point: &Point| {
            let setup = point.setup(setup);
            let bone = mean_bone(point, &setup).ok()?;
            solver.change_setup(&setup);
            Some(solver.arrival(&bone, &mut workspace).map(|arrival| arrival.velocity))
        };
        let slower = |one: (Point, f64), other: (Point, f64)| one.1 <= other.1;
        let slowest = Some(attainable_moments::lowest_bulk_velocity_point(ranges));
        let slowest = of_corners(slowest, ranges, &mut velocity, slower);
        let fastest = attainable_moments::highest_bulk_velocity_point(ranges);
        let fastest = of_corners(fastest, ranges, &mut velocity, |one, other| !slower(one, other));
        let start = velocity(&specification.start()).unwrap_or(Ok(f64::NAN));
        let of_elasticity =
            AttainableMoments::from_ranges(ranges, setup, &RandomQuantities::default()).variation;
        let of_setup = scatter_at_start(specification, setup);
        let variation = [of_elasticity.0, of_elasticity.1].map(|part| part.hypot(of_setup));
        Self { slowest, fastest, start, variation: variation.into() }
    }

    /// Returns which moments of data with this number of velocities are out of reach, each with the
    /// rest of a sentence.
    fn missed(
        &self,
        specification: &JobSpecification,
        data: Moments,
        count: Option<u64>,
    ) -> Vec<(&'static str, String)> {
        let ranges = &specification.parameters;
        let count = count.map_or(f64::INFINITY, |count| count as f64);
        let (mean, variation) = (data.mean, data.coefficient_of_variation);
        // A velocity is proportional to the root of a stiffness, so its mean lies below that of the
        // mean model.
        let most = self.variation.1;
        let error = ERRORS * variation / count.sqrt();
        let margins = (MEAN_MARGIN + error + 0.5 * most * most, MEAN_MARGIN + error);
        let mut missed = Vec::new();
        let velocities = self.velocities();
        if let Some((point, slowest)) = &self.slowest
            && mean < slowest * (1.0 - margins.0)
        {
            let cure = widened(ranges, point);
            missed.push(("mean", beyond(&rounded(mean), "below", &velocities, &cure)));
        }
        if let Some((point, fastest)) = &self.fastest
            && mean > fastest * (1.0 + margins.1)
        {
            let cure = widened(ranges, point);
            missed.push(("mean", beyond(&rounded(mean), "above", &velocities, &cure)));
        }
        let margin = VARIATION_MARGIN + ERRORS / (2.0 * count).sqrt();
        let (least, most) = self.variation;
        let side = if variation < least * (1.0 - margin) {
            Some(("below", "lower"))
        } else if variation > most * (1.0 + margin) {
            Some(("above", "upper"))
        } else {
            None
        };
        if let Some((side, bound)) = side {
            let cure = match ranges[Parameter::Dispersion as usize] {
                Range::Free { .. } => format!("widen the {bound} bound of parameters.dispersion"),
                Range::Fixed(_) => "free parameters.dispersion".to_owned(),
            };
            let reached = format!("about {least:.2e} to {most:.2e}");
            let reached = beyond(&format!("{variation:.3e}"), side, &reached, &cure);
            missed.push(("coefficient of variation", reached));
        }
        missed
    }

    /// Describes the velocities within reach, as far as they are known.
    fn velocities(&self) -> String {
        let [slowest, fastest] =
            [&self.slowest, &self.fastest].map(|end| end.as_ref().map(|&(_, velocity)| velocity));
        match (slowest, fastest) {
            (Some(slowest), Some(fastest)) => {
                format!("{} to {} m/s", rounded(slowest), rounded(fastest))
            }
            (Some(slowest), None) => format!("{} m/s and more", rounded(slowest)),
            (None, Some(fastest)) => format!("up to {} m/s", rounded(fastest)),
            (None, None) => "nothing".to_owned(),
        }
    }
}

/// Returns the velocity, m/s, of a point, or of those with the bounds of the setup's parameters in
/// place of their starts: the one that `is_better` than all others, with its point.
fn of_corners(
    point: Option<Point>,
    ranges: &[Range; PARAMETERS],
    velocity: &mut impl FnMut(&Point) -> Option<Result<f64, Failure>>,
    is_better: impl Fn((Point, f64), (Point, f64)) -> bool,
) -> Option<(Point, f64)> {
    let mut corners = vec![point?];
    for parameter in Parameter::OF_SETUP {
        if let Range::Free { lower, upper, .. } = ranges[parameter as usize] {
            let at = |bound: f64, mut corner: Point| {
                corner.0[parameter as usize] = bound;
                corner
            };
            let ends = [lower, upper];
            corners = corners.iter().flat_map(|&one| ends.map(|bound| at(bound, one))).collect();
        }
    }
    let solved = corners.into_iter().map(|point| Some((point, velocity(&point)?.ok()?)));
    let solved: Option<Vec<(Point, f64)>> = solved.collect();
    solved?.into_iter().reduce(|best, one| if is_better(one, best) { one } else { best })
}

/// Returns the approximate coefficient of variation that the random quantities of the setup give the
/// velocity of the start's mean model, from its values one standard deviation below and above their
/// means.
fn scatter_at_start(specification: &JobSpecification, setup: &Setup) -> f64 {
    let (start, random) = (specification.start(), &specification.random);
    let (setup, mut workspace) = (start.setup(setup), Workspace::default());
    let of_quantity = |quantity: SetupQuantity| {
        let ends = random.scatter(quantity).about(quantity.value_in(&setup)?);
        let mut velocity = |value| {
            let setup = quantity.with(value, setup.clone());
            let (solver, bone) = (Solver::new(&setup), mean_bone(&start, &setup).ok()?);
            solver.arrival(&bone, &mut workspace).ok().map(|arrival| arrival.velocity)
        };
        let (below, above) = (velocity(ends[0])?, velocity(ends[1])?);
        Some(((above - below) / (above + below)).abs())
    };
    random.random().filter_map(of_quantity).fold(0.0, f64::hypot)
}

fn rounded(velocity: f64) -> String {
    format!("{velocity:.0}")
}

fn beyond(value: &str, side: &str, reached: &str, cure: &str) -> String {
    format!(
        "is {value}, {side} what points within the bounds reach ({reached}): the search will end at its \
         bounds; {cure}"
    )
}

/// Returns which bounds must be widened to get beyond this corner of the box.
fn widened(ranges: &[Range; PARAMETERS], corner: &Point) -> String {
    let (mut lower_bounds, mut upper_bounds) = (Vec::new(), Vec::new());
    for parameter in Parameter::ALL {
        // Neither of these has much influence on the mean.
        if matches!(parameter, Parameter::LongitudinalShearModulus | Parameter::Dispersion) {
            continue;
        }
        let Range::Free { lower, upper, .. } = ranges[parameter as usize] else { continue };
        let value = corner.get(parameter);
        if value.to_bits() == lower.to_bits() {
            lower_bounds.push(parameter.name());
        } else if value.to_bits() == upper.to_bits() {
            upper_bounds.push(parameter.name());
        }
    }
    let of = |side: &str, names: Vec<&str>| {
        (!names.is_empty()).then(|| format!("the {side} bound of {}", names.join(" or ")))
    };
    let bounds: Vec<String> =
        [of("lower", lower_bounds), of("upper", upper_bounds)].into_iter().flatten().collect();
    if bounds.is_empty() {
        return "free more parameters".to_owned();
    }
    format!("widen {}", bounds.join(", or "))
}

#[cfg(test)]
mod tests;
