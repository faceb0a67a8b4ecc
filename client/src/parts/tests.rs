use serde_json::json;

use super::*;
use crate::results_directory::tests::sample_output;
use crate::sample_result::{drawn_posterior, identification, posterior, propagation};
use osteon_common::results::Status;

/// The output of a job with a posterior: of the job itself, or of its groups.
fn output(grouped: bool) -> Fetched {
    let samples = SetSamples { outcomes: Vec::new(), draws: drawn_posterior().draws };
    if !grouped {
        let partial = json!({ "dispersion": null, "posterior": posterior() });
        let result = identification(&partial.to_string());
        return Fetched { result, samples: vec![samples], ..sample_output(Status::Converged) };
    }
    let text = include_str!("../../../fuzz/corpus/results/groups.json");
    let mut result = ResultFile::from_json(text).unwrap();
    let ResultFile::Identification(found) = &mut result else { unreachable!() };
    for group in found.groups.as_mut().unwrap() {
        (group.dispersion, group.posterior) = (None, Some(posterior()));
    }
    let samples = vec![samples; result.groups().len()];
    Fetched { result, samples, ..sample_output(Status::Converged) }
}

fn draws(group: Option<u32>, first: u64) -> Part {
    let draws = drawn_posterior().draws;
    let first_of = usize::try_from(first).unwrap();
    Part::Draws(draws::draws_to_message(group, first, &draws[first_of..=first_of]))
}

/// The parts of a fetch, each draw in a block of its own.
fn parts(output: &Fetched) -> Vec<Part> {
    let mut of_job = output.result.clone();
    let ResultFile::Identification(found) = &mut of_job else { unreachable!() };
    let groups = found.groups.take().unwrap_or_default();
    found.groups = (!groups.is_empty()).then(Vec::new);
    let (status, reason) = (JOB_STATUS.number(output.status), output.reason.clone());
    let mut parts = vec![
        Part::Specification(specification::to_message(&output.specification)),
        Part::Result(v1::JobResult { status, reason, json: of_job.to_json() }),
    ];
    if groups.is_empty() {
        parts.extend([draws(None, 0), draws(None, 1)]);
    }
    for (number, group) in (0..).zip(groups) {
        parts.push(Part::Group(v1::GroupResult { group: number, json: group.to_json() }));
        parts.extend([draws(Some(number), 0), draws(Some(number), 1)]);
    }
    parts
}

fn assemble_parts(parts: Vec<Part>) -> Result<Fetched, Malformed> {
    let mut fetched = FetchedParts::default();
    parts.into_iter().try_for_each(|part| fetched.add(part))?;
    fetched.assemble()
}

#[test]
fn draws_come_back_to_their_posterior() {
    for grouped in [false, true] {
        let output = output(grouped);
        let again = assemble_parts(parts(&output)).unwrap();
        assert_eq!(again, output);
    }
}

#[test]
fn draws_out_of_place_are_refused() {
    let refused = |grouped: bool, change: fn(&mut Vec<Part>)| {
        let mut parts = parts(&output(grouped));
        change(&mut parts);
        match assemble_parts(parts).unwrap_err() {
            Malformed::OutOfRange { field, .. }
            | Malformed::WrongLength { field, .. }
            | Malformed::Missing { field } => field,
            other => panic!("{other}"),
        }
    };
    assert_eq!(refused(false, |parts| parts.swap(2, 3)), "first");
    assert_eq!(refused(false, |parts| parts.push(draws(None, 0))), "first");
    assert_eq!(refused(false, |parts| parts.push(draws(Some(0), 0))), "group");
    assert_eq!(refused(false, |parts| drop(parts.pop())), "draws");
    assert_eq!(refused(true, |parts| parts.push(draws(Some(0), 1))), "group");
    assert_eq!(refused(true, |parts| drop(parts.pop())), "draws");
    // A result without a posterior has no draws.
    let without = |parts: &mut Vec<Part>| {
        if let Part::Result(result) = &mut parts[1] {
            result.json = sample_output(Status::Converged).result.to_json();
        }
    };
    assert_eq!(refused(false, without), "draws");
}

#[test]
fn a_result_that_is_none_is_refused() {
    let refused = |grouped: bool, json: &str| {
        let mut parts = parts(&output(grouped));
        for part in &mut parts {
            match part {
                Part::Result(result) if !grouped => result.json = json.to_owned(),
                Part::Group(group) => group.json = json.to_owned(),
                _ => {}
            }
        }
        assemble_parts(parts).unwrap_err().to_string()
    };
    for grouped in [false, true] {
        assert!(refused(grouped, "").starts_with("field `json`: "), "{}", refused(grouped, ""));
    }
    let json = propagation("{}").to_json();
    let expected =
        "field `json`: it is the result of a propagation, and the job is a identification";
    assert_eq!(refused(false, &json), expected);
}
