//! Output of `check`.

use osteon_search::ExpectedEvaluations;
use osteon_solver::Isa;

use super::*;
use osteon_local::cost::{JobCost, PlaceCost};

/// Costs of a job: milliseconds at the start, and at points of the box.
fn cost(specification: &JobSpecification, start_ms: Option<f64>, box_ms: &[f64]) -> JobCost {
    let place = |milliseconds: f64| PlaceCost {
        point: specification.start(),
        mean_s: 1e-3 * milliseconds,
        median_s: 1e-3 * milliseconds,
        measured: 8,
        failed: usize::from(milliseconds > 10.0),
    };
    JobCost {
        start: start_ms.map(place),
        places: box_ms.iter().copied().map(place).collect(),
        unmeasured: 3 - box_ms.len(),
        limit_s: 2.0,
        expected: ExpectedEvaluations::from_specification(specification),
        realizations: specification.monte_carlo.realizations,
        cores: 2,
    }
}

/// Returns what is printed for an identification of two parameters.
fn printed_cost(format: OutputFormat, start_ms: Option<f64>, box_ms: &[f64]) -> String {
    let free = ["longitudinal_young_modulus", "dispersion"];
    let specification = specification(JobKind::Identification, &free);
    let cost = cost(&specification, start_ms, box_ms);
    let isa = Isa::available()[0];
    let shown = ShownCost { specification: &specification, cost: &cost, isa };
    // Machines have different instruction sets.
    printed(format, |output| output.cost(&shown).unwrap()).replace(isa.name(), "ISA")
}

#[test]
fn a_cost_is_told_from_start_to_worst_point() {
    let measured = |format| printed_cost(format, Some(0.25), &[0.26, 1.2, 31.0]);
    insta::assert_snapshot!(measured(OutputFormat::Text));
    insta::assert_snapshot!(measured(OutputFormat::Json));
}

#[test]
fn what_could_not_be_measured_is_told() {
    insta::assert_snapshot!(printed_cost(OutputFormat::Text, Some(900.0), &[]));
    insta::assert_snapshot!(printed_cost(OutputFormat::Text, None, &[]));
    insta::assert_snapshot!(printed_cost(OutputFormat::Json, None, &[]));
}
