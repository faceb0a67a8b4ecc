//! Draws from posteriors as CSV: `posterior.csv`.

use osteon_common::bone_structure::BoneStructure;
use osteon_common::job::{Data, JobSpecification};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::posterior::PosteriorDraw;

use crate::results_csv::{field, number};

/// Returns the text of `posterior.csv`, given the draws from the posterior of each set of data: one row per
/// draw, with the parameters (SI units) between its number and √(c1111/ρ), the moments of the model's
/// velocities (m/s) and the logarithm of the density (nats); with groups, the rows of one group after
/// another.
pub fn posterior<'a>(
    specification: &JobSpecification,
    draws: impl IntoIterator<Item = &'a [PosteriorDraw]>,
) -> String {
    let parameters: Vec<_> = specification.parameters_given().map(Parameter::name).collect();
    let parameters = parameters.join(",");
    let moments = "mean,coefficient_of_variation";
    let mut out = format!("draw,{parameters},bulk_velocity,{moments},log_density");
    let names: Vec<&str> = specification.data.iter().flat_map(Data::names).collect();
    out.push_str(if names.is_empty() { "\n" } else { ",group\n" });
    for (set, draws) in draws.into_iter().enumerate() {
        let end = names.get(set).map(|name| format!(",{}", field(name))).unwrap_or_default();
        add(&mut out, &specification.setup.structure, draws, &end);
    }
    out
}

/// Appends a row for each draw, each with this end.
fn add(out: &mut String, structure: &BoneStructure, draws: &[PosteriorDraw], end: &str) {
    for (place, draw) in draws.iter().enumerate() {
        out.push_str(&place.to_string());
        let PosteriorDraw { point, log_density, mean, coefficient_of_variation } = draw;
        let derived = [speed(structure, point), Some(*mean), Some(*coefficient_of_variation)];
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
fn speed(structure: &BoneStructure, point: &Point) -> Option<f64> {
    structure.bulk_logarithm(point).ok().map(libm::exp)
}
