use osteon_common::job::{Data, Group};
use osteon_common::results::{DataSummary, GroupResult, Status};

use super::*;
use crate::results_directory::tests::fetched;
use crate::sample_result::drawn_posterior;

/// The output of a job with a posterior: of the job itself, or of two groups.
fn output(grouped: bool) -> Fetched {
    let mut output = fetched(Status::Converged);
    output.specification = output.specification.clone();
    let posterior = Some(drawn_posterior());
    if !grouped {
        output.result.conclusions.posterior = posterior;
        return output;
    }
    let groups = ["left", "right"].map(|name| (name.to_owned(), vec![3900.0, 3950.0]));
    let data = groups.map(|(name, velocities)| Group::new(name, velocities)).to_vec();
    let data = Data::from_groups(data);
    let group = |(set, name): (usize, &str)| {
        let mut conclusions = output.result.conclusions.clone();
        conclusions.posterior.clone_from(&posterior);
        let data = DataSummary::from_data(&data, set);
        let (status, reason, best) = (Status::Converged, None, None);
        GroupResult { name: name.to_owned(), status, reason, best, data, conclusions }
    };
    output.result.groups = data.names().enumerate().map(group).collect();
    output.specification.data = Some(data);
    output
}

fn draws(group: Option<u32>, first: u64) -> Part {
    let draws = drawn_posterior().draws;
    let first_of = usize::try_from(first).unwrap();
    Part::Draws(posterior::draws_to_message(group, first, &draws[first_of..=first_of]))
}

/// The parts of a fetch, each draw in a block of its own.
fn parts(output: &Fetched) -> Vec<Part> {
    let mut parts = vec![
        Part::Specification(specification::to_message(&output.specification)),
        Part::Result(results::to_message(&output.result)),
    ];
    if output.result.groups.is_empty() {
        parts.extend([draws(None, 0), draws(None, 1)]);
    }
    for (number, group) in (0..).zip(&output.result.groups) {
        parts.push(Part::Group(results::group_to_message(number, group)));
        parts.extend([draws(Some(number), 0), draws(Some(number), 1)]);
    }
    parts
}

fn assembled(parts: Vec<Part>) -> Result<Fetched, Malformed> {
    let mut fetched = FetchedParts::default();
    parts.into_iter().try_for_each(|part| fetched.add(part))?;
    fetched.assemble()
}

#[test]
fn draws_come_back_to_their_posterior() {
    for grouped in [false, true] {
        let output = output(grouped);
        let again = assembled(parts(&output)).unwrap();
        assert_eq!(again.result, output.result);
        assert_eq!(again.specification, output.specification);
    }
}

#[test]
fn draws_out_of_place_are_refused() {
    let refused = |grouped: bool, change: fn(&mut Vec<Part>)| {
        let mut parts = parts(&output(grouped));
        change(&mut parts);
        match assembled(parts).unwrap_err() {
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
            result.posterior = None;
        }
    };
    assert_eq!(refused(false, without), "posterior");
}
