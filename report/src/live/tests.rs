use std::path::Path;

use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::outcome::FailureKind;
use osteon_common::parameters::Parameter;
use osteon_common::results::{DataSummary, Evaluation, EvaluationRole, Moments};

use super::*;

fn specification() -> JobSpecification {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/fast.toml");
    osteon_files::job_file::read(&path, JobKind::Identification).unwrap()
}

fn row(specification: &JobSpecification, number: u64, cost: f64) -> Evaluation {
    Evaluation {
        number,
        role: EvaluationRole::default(),
        point: specification.start_of(0),
        moments: Some(Moments { mean: 3900.0, coefficient_of_variation: 0.03 }),
        observables: osteon_common::observables::ObservableValues::default(),
        cost: Some(cost),
        failures: FailureCounts::default(),
        estimated_error: None,
    }
}

#[test]
fn a_search_has_figures_from_its_second_evaluation_on() {
    let specification = specification();
    let mut course = SearchCourse::for_job(&specification, 0);
    course.set_data(&DataSummary::from_data(specification.data.as_ref().unwrap(), 0));
    course.add(&row(&specification, 0, 0.5));
    assert_eq!(search_figures(&course), []);
    // Evaluations that only measure a derivative are not of the search.
    let varied = Some(Parameter::Density);
    let role = EvaluationRole { varied, ..EvaluationRole::default() };
    course.add(&Evaluation { role, ..row(&specification, 1, 0.4) });
    assert_eq!(course.count(), 1);
    course.add(&row(&specification, 2, 0.25));
    let figures = search_figures(&course);
    let names: Vec<&str> = figures.iter().map(|figure| figure.name.as_str()).collect();
    let expected = ["cost", "search-mean", "search-coefficient-of-variation", "search-parameters"];
    assert_eq!(names, expected);
    assert!(
        figures[0].svg.contains("2 evaluations; the lowest cost is 0.250."),
        "{}",
        figures[0].svg
    );
    assert!(figures[1].svg.contains(">measured</text>"), "{}", figures[1].svg);
}

#[test]
fn a_long_search_is_thinned_and_keeps_its_best() {
    let specification = specification();
    let mut course = SearchCourse::for_job(&specification, 0);
    let count = 50_000;
    for number in 0..count {
        let cost = if number == 12_345 { 1e-9 } else { 1.0 };
        course.add(&row(&specification, number, cost));
    }
    assert!(course.rows.len() < 10_000, "{}", course.rows.len());
    assert_eq!(course.count(), count);
    let best = course.rows.iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).unwrap();
    assert_eq!((best.place, best.cost), (12_345.0, 1e-9));
    assert!(search_figures(&course)[0].svg.len() < 200_000);
}

#[test]
fn failures_are_drawn_if_there_are_any() {
    let mut failures = FailureCounts::default();
    assert_eq!(failure_figure(&failures, 100), None);
    failures.add(FailureKind::NoArrival, 3);
    let figure = failure_figure(&failures, 100).unwrap();
    assert!(figure.reading.starts_with("3 of 100 realizations (3.0 %)"), "{}", figure.reading);
}
