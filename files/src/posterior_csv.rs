//! Draws from posteriors as CSV: `posterior.csv`.

use osteon_common::bulk_velocity::bulk_velocity;
use osteon_common::job::{Data, JobSpecification};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::posterior::{Posterior, PosteriorDraw};
use osteon_common::results::JobResult;

use crate::results_csv::{field, number};

/// Returns the text of `posterior.csv`: one row per draw, with the parameters (SI units)
/// between its number and √(c1111/ρ), the moments of the model's velocities (m/s) and the logarithm
/// of the density (nats); with groups, the rows of one group after another.
pub fn posterior(specification: &JobSpecification, result: &JobResult) -> String {
    let parameters: Vec<_> = specification.parameters_given().map(Parameter::name).collect();
    let parameters = parameters.join(",");
    let moments = "mean,coefficient_of_variation";
    let mut out = format!("draw,{parameters},bulk_velocity,{moments},log_density");
    let grouped = specification.data.as_ref().is_some_and(Data::is_grouped);
    out.push_str(if grouped { ",group\n" } else { "\n" });
    add(&mut out, result.conclusions.posterior.as_ref(), "");
    for group in &result.groups {
        let name = format!(",{}", field(&group.name));
        add(&mut out, group.conclusions.posterior.as_ref(), &name);
    }
    out
}

/// Appends a row for each draw, each with this end.
fn add(out: &mut String, posterior: Option<&Posterior>, end: &str) {
    for (place, draw) in posterior.iter().flat_map(|found| &found.draws).enumerate() {
        out.push_str(&place.to_string());
        let PosteriorDraw { point, log_density, mean, coefficient_of_variation } = draw;
        let derived = [speed(point), Some(*mean), Some(*coefficient_of_variation)];
        let numbers =
            point.given().map(|(_, value)| Some(value)).chain(derived).chain([Some(*log_density)]);
        for value in numbers {
            out.push(',');
            out.push_str(&number(value));
        }
        out.push_str(end);
        out.push('\n');
    }
}

/// Returns √(c1111/ρ), m/s; `None` at a point whose mean model is not admissible.
fn speed(point: &Point) -> Option<f64> {
    bulk_velocity(point).ok().map(|found| libm::exp(found.logarithm))
}
