use std::path::Path;
use std::time::Duration;

use osteon_common::job::JobKind;
use osteon_files::document::Format;
use osteon_files::job_file;

use super::*;

const JOB: &str = "\
[data]
mean = 3905.91
coefficient_of_variation = 0.02711
[parameters]
density = { fixed = 1598.8 }
longitudinal_poisson_ratio = { fixed = 0.3816 }
transverse_young_modulus = { fixed = 9.8254e9 }
transverse_poisson_ratio = { fixed = 0.4495 }
[parameters.longitudinal_shear_modulus]
fixed = 4.795e9
[parameters.longitudinal_young_modulus]
start = 18e9
bounds = [12e9, 25e9]
[parameters.dispersion]
start = 0.1
bounds = [0.02, 0.3]
[monte_carlo]
realizations = 100
";

/// Returns a job, with parts of its text replaced.
pub(super) fn job(changes: &[(&str, &str)]) -> JobSpecification {
    let changed = changes.iter().fold(JOB.to_owned(), |text, (from, to)| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    });
    let kind = JobKind::Identification;
    job_file::parse(&changed, Format::Toml, Path::new(""), kind).unwrap()
}

/// Measures without a limit that a busy machine could exceed.
async fn measured(specification: &JobSpecification) -> JobCost {
    let effort = Effort { limit: Duration::from_secs(120), ..Effort::THOROUGH };
    JobCost::measure(specification, Isa::fastest(), effort, 2).await
}

fn place(mean_s: f64) -> PlaceCost {
    let point = job(&[]).start();
    PlaceCost { point, mean_s, median_s: mean_s, measured: 8, failed: 0 }
}

fn cost(start_s: f64, box_s: &[f64]) -> JobCost {
    JobCost {
        start: Some(place(start_s)),
        places: box_s.iter().map(|&mean_s| place(mean_s)).collect(),
        unmeasured: 0,
        limit_s: 2.0,
        expected: ExpectedEvaluations { fewest: 50, most: 100 },
        realizations: 200,
        cores: 2,
    }
}

#[tokio::test]
async fn realizations_are_measured_all_over_the_box() {
    let cost = measured(&job(&[])).await;
    let start = cost.start.as_ref().unwrap();
    assert_eq!((start.measured, cost.places.len(), cost.unmeasured), (48, 13, 0));
    assert!(cost.places.iter().all(|place| place.measured == 8 && place.mean_s > 0.0));
    assert!(cost.worst().unwrap().mean_s >= cost.median_s().unwrap());
}

#[tokio::test]
async fn no_more_realizations_are_measured_than_a_point_has() {
    let few = [("realizations = 100", "realizations = 3")];
    let cost = measured(&job(&few)).await;
    assert_eq!(cost.start.unwrap().measured, 3);
    assert!(cost.places.iter().all(|place| place.measured == 3));
}

#[tokio::test]
async fn failures_are_counted() {
    let far = "[layers.coupling]\nsound_speed = 6000.0\n[monte_carlo]";
    let cost = measured(&job(&[("[monte_carlo]", far)])).await;
    let start = cost.start.unwrap();
    assert_eq!(start.failed, start.measured, "the direct wave is first");
}

/// A realization that takes longer than the limit is not waited for.
#[tokio::test]
async fn a_limit_ends_the_measurement() {
    let effort = Effort { limit: Duration::ZERO, ..Effort::THOROUGH };
    let cost = JobCost::measure(&job(&[]), Isa::fastest(), effort, 2).await;
    assert_eq!(cost.places.len() + cost.unmeasured, 13);
    let unknown = JobCost { start: None, places: Vec::new(), unmeasured: 13, ..cost };
    assert_eq!((unknown.processor_s(), unknown.wall_s()), (None, None));
}

#[test]
fn time_is_evaluations_times_realizations() {
    let close = |found: Option<[f64; 2]>, expected: [f64; 2]| {
        let found = found.unwrap();
        let near = found.iter().zip(expected).all(|(one, other)| (one / other - 1.0).abs() < 1e-12);
        assert!(near, "{found:?} {expected:?}");
    };
    let estimated = cost(1e-3, &[1e-3, 4e-3, 50e-3]);
    close(estimated.processor_s(), [10.0, 40.0]);
    close(estimated.wall_s(), [5.0, 20.0]);
    close(cost(4e-3, &[1e-3]).processor_s(), [10.0, 80.0]);
    assert_eq!(estimated.worst().unwrap().mean_s, 50e-3);
    close(cost(1e-3, &[]).processor_s(), [10.0, 20.0]);
    // Three realizations on two cores take as long as four.
    let few = JobCost { realizations: 3, ..cost(1e-3, &[]) };
    close(few.processor_s(), [0.15, 0.3]);
    close(few.wall_s(), [0.1, 0.2]);
    // Three on sixteen as long as one.
    close(JobCost { cores: 16, ..few }.wall_s(), [0.05, 0.1]);
}
