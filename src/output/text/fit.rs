//! Statements on whether the model fits the data, and which parameters the data determine.

use osteon_common::job::{JobSpecification, Measurements, Objective, Range, SearchMethod};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::results::Status;
use osteon_files::report::{Identification, Moment, PosteriorReport};
use osteon_search::search_box::{SearchBox, Side};

use super::data_notes;
use super::identified;
use super::layout::{glued, wrapped};
use super::number::{DIGITS, digits, significant};
use super::result::readable;

/// Standard errors by which a moment of the model may be off, as in the computation of intervals.
const ERRORS_MAX: f64 = 3.0;
/// Relative difference below which a moment counts as matched however small its error is, as in the
/// computation of intervals.
const EXACT: f64 = 1e-4;

/// Returns whether the model fits the data: if nothing but the posterior was asked for, according to
/// that, otherwise according to the inference from the derivatives, or, without it, to cost and
/// moments.
pub(super) fn fits(found: &Identification, specification: &JobSpecification) -> bool {
    if found.status == Status::NotMatched {
        return false;
    }
    if specification.search.method == SearchMethod::Posterior {
        return found.posterior().is_some_and(|posterior| posterior_fits(found, posterior));
    }
    if let Some(identified) = found.identified() {
        return identified.matched;
    }
    is_reached(found, specification)
        || Moment::ALL.into_iter().all(|moment| is_within_noise(found, moment))
}

/// Returns whether the data's moments are among those that the posterior leaves possible. Priors may
/// keep it from them.
fn posterior_fits(found: &Identification, posterior: &PosteriorReport) -> bool {
    let of = |moment: Moment| match moment {
        Moment::Mean => &posterior.mean,
        Moment::CoefficientOfVariation => &posterior.coefficient_of_variation,
    };
    let agrees = |moment: Moment| {
        let data = found.data.as_ref().and_then(|data| data.moments.get(moment));
        let known = of(moment).mean.zip(of(moment).standard_deviation);
        let Some((data, (mean, deviation))) = data.zip(known) else { return false };
        let noise = of_data(found, moment).hypot(deviation / mean);
        (mean / data - 1.0).abs() <= (ERRORS_MAX * noise).max(EXACT)
    };
    // Outlying velocities count in the data's moments, and hardly in the posterior.
    has_outliers(found) || Moment::ALL.into_iter().all(agrees)
}

/// Returns the relative standard error of a moment of the data; 0 if it is not known.
fn of_data(found: &Identification, moment: Moment) -> f64 {
    let Some(data) = &found.data else { return 0.0 };
    let Some(intervals) = data.intervals() else { return 0.0 };
    let value = data.moments.get(moment).unwrap_or(f64::NAN);
    let [low, high] = intervals.get(moment);
    // An interval of 95 % reaches two standard errors to each side.
    (high - low) / 4.0 / value
}

/// Returns whether the search reached its target cost.
fn is_reached(found: &Identification, specification: &JobSpecification) -> bool {
    let cost = found.cost.unwrap_or(f64::INFINITY);
    found.objective.is_of_moments() && cost <= specification.search.cost_tolerance
}

/// Returns whether a moment of the model agrees with the data within the noise of both.
fn is_within_noise(found: &Identification, moment: Moment) -> bool {
    let Some(difference) = difference(found, moment) else { return false };
    let of_model = found.velocity.standard_error.get(moment).unwrap_or(0.0);
    let of_model = of_model / found.velocity.moments.get(moment).unwrap_or(f64::NAN);
    let noise = of_model.hypot(of_data(found, moment));
    difference.abs() <= (ERRORS_MAX * noise).max(EXACT)
}

/// Returns the relative difference of a moment of the model from that of the data.
fn difference(found: &Identification, moment: Moment) -> Option<f64> {
    Some(found.velocity.moments.get(moment)? / found.data.as_ref()?.moments.get(moment)? - 1.0)
}

/// Returns whether the data contain velocities far from the others. A search counts them in full, a
/// posterior hardly.
pub(super) fn has_outliers(found: &Identification) -> bool {
    found.data.as_ref().is_some_and(|data| !data.outliers.is_empty())
}

/// Returns the statement that the model misses the data, by how much, and at which bounds.
pub(super) fn misfit(
    found: &Identification,
    point: &Point,
    specification: &JobSpecification,
) -> String {
    let off = |moment: Moment| {
        let difference = difference(found, moment)?;
        // A large difference may be due to data in other units than the model's.
        if !(-0.5..=1.0).contains(&difference) {
            return Some(format!("{} times the data's", digits(1.0 + difference, 2)));
        }
        let side = if difference < 0.0 { "below" } else { "above" };
        let percent = glued(&format!("{} %", digits(100.0 * difference.abs(), 2)));
        Some(format!("{percent} {side} the data's"))
    };
    let intervals = match (found.posterior(), has_outliers(found)) {
        (Some(_), true) => {
            "which contain velocities far from the others; the posterior below allows for them"
        }
        (Some(_), false) => "so the posterior below says little",
        (None, _) => "so no intervals can be given",
    };
    let mut text = format!("The model does not fit the data, {intervals}.");
    // The reason in the headline has said the rest.
    if found.status == Status::NotMatched && found.reason.is_some() {
        return format!("\n{}", wrapped(&text));
    }
    if let [Some(mean), Some(variation)] = Moment::ALL.map(off) {
        text.push_str(&format!(
            " Its mean velocity is {mean}, its coefficient of variation {variation}."
        ));
    }
    let on_bounds = SearchBox::new(specification.parameters).on_bounds(point);
    let on_bounds = on_bounds.iter().map(|(parameter, side)| match side {
        Side::Lower => format!("{} (lower)", readable(*parameter)),
        Side::Upper => format!("{} (upper)", readable(*parameter)),
    });
    let on_bounds: Vec<String> = on_bounds.collect();
    if on_bounds.is_empty() {
        text.push_str(" No parameter lies on a bound.");
    } else {
        text.push_str(&format!(" On their bounds: {}.", on_bounds.join(", ")));
    }
    format!("\n{}", wrapped(&text))
}

/// Returns the statement on which parameters the data determine, and what the others mean, for a
/// model that fits.
pub(super) fn uniqueness(
    found: &Identification,
    point: &Point,
    specification: &JobSpecification,
) -> String {
    let free = |parameter| matches!(specification.range(parameter), Range::Free { .. });
    let searched = Parameter::ALL.into_iter().filter(|&parameter| free(parameter)).count();
    let dispersion = free(Parameter::Dispersion);
    let Ok(speed) = specification.setup.structure.bulk_logarithm(point) else {
        return String::new();
    };
    let speed = speed.exp();
    let speed = glued(&format!("√(c1111/ρ) = {} m/s", digits(speed, DIGITS)));
    let shown_below = identified::has_intervals(found);
    let measured = specification.observables();
    if searched - usize::from(dispersion) < 2 + measured.members().count() {
        return if shown_below {
            String::new()
        } else {
            let reason = no_intervals(found, specification).unwrap_or_default();
            format!("\n{}", wrapped(&format!("{speed} at this point.{reason}")))
        };
    }
    let known = match specification.objective {
        _ if !measured.is_empty() => &format!("Two moments and the mean {}", measured.titles()),
        Objective::Moments | Objective::ChiSquare => "Two moments",
        Objective::Likelihood => "The distribution of one velocity",
    };
    let mut fixed = "the mean velocity and the coefficient of variation".to_owned();
    for observable in measured.members() {
        fixed.push_str(&format!(", and the mean {}", observable.row().title));
    }
    let nearest =
        is_reached(found, specification) && specification.search.method == SearchMethod::Newton;
    let this = if nearest {
        "many other parameter sets fit equally well, and this is the one nearest to the start \
         (distances in units of the bounds)."
    } else {
        "many other parameter sets fit equally well, and this is one of them."
    };
    let mut text = format!(
        "{known} cannot determine {searched} parameters. The data fix {fixed}; {this} Fix parameters that are known from other measurements \
         (`fixed = …`) to narrow the others down."
    );
    if found.posterior().is_none() {
        let needed = match specification.data.as_ref().map(|data| &data.measurements) {
            Some(Measurements::Moments { count: None, .. }) => "With `data.count`, a",
            _ => "A",
        };
        text.push_str(&format!(
            " {needed} section `[posterior]` in the job file gives intervals that include what is \
             left free."
        ));
    }
    if !shown_below {
        let dispersion = if dispersion {
            format!(", dispersion {}", significant(point.dispersion(), DIGITS))
        } else {
            String::new()
        };
        text.push_str(&format!("\n{speed}{dispersion}"));
    }
    format!("\n{}", wrapped(&text))
}

/// Says why a model that matches, with parameters that the data could determine, has no intervals:
/// the noise of the data is not known.
fn no_intervals(found: &Identification, specification: &JobSpecification) -> Option<String> {
    let data = specification.data.as_ref()?;
    if found.data.as_ref()?.intervals().is_some() {
        return None;
    }
    let needed = match data.measurements {
        Measurements::Moments { count: None, .. } => {
            "the noise of the data is not known; `data.count`, the number of velocities behind the \
             moments, gives it"
        }
        _ => data_notes::TOO_FEW,
    };
    Some(format!(" No intervals: {needed}."))
}
