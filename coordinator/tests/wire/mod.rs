//! The results of an identification that a client can get from the messages alone.

use std::path::Path;
use std::{env, fs};

use osteon_common::outcome::Outcome;
use osteon_files::report::{Group, ResultFile};
use osteon_files::results_csv;
use osteon_proto::history;
use osteon_proto::v1::{GroupResult, HistoryBlock, JobResult as ResultMessage};

use super::*;

mod jobs;

/// The parts of a fetch, in their order.
struct Parts {
    result: ResultMessage,
    history: Vec<HistoryBlock>,
    groups: Vec<GroupResult>,
    /// Realizations with the number of their group.
    realizations: Vec<(Option<u32>, Vec<Outcome>)>,
}

/// Runs a job, and fetches its output.
async fn fetched(job: &osteon_common::job::JobSpecification) -> Parts {
    let coordinator = coordinator("127.0.0.1:0", Box::new(MemoryStore::new())).await;
    let mut client = client(&coordinator).await;
    let worker = tokio::spawn(work(channel(&coordinator).await, usize::MAX));
    let id = submit(&mut client, job, "").await.unwrap();
    watch(&mut client, &id).await;
    let mut parts = fetch(&mut client, &id).await.unwrap().into_iter();
    coordinator.shutdown().await;
    worker.await.unwrap().unwrap_err();
    assert!(matches!(parts.next(), Some(Part::Specification(_))));
    let Some(Part::Result(result)) = parts.next() else { panic!("no result") };
    let (history, groups, realizations) = (Vec::new(), Vec::new(), Vec::new());
    let mut left = Parts { result, history, groups, realizations };
    for part in parts {
        match part {
            Part::History(block) => left.history.push(block),
            Part::Group(group) => left.groups.push(group),
            Part::Realizations(block) => {
                let (_, outcomes) = realizations::from_message(&block).unwrap();
                left.realizations.push((block.group, outcomes));
            }
            Part::Draws(_) => panic!("draws from a posterior that nobody asked for"),
            Part::Specification(_) | Part::Result(_) => panic!("two of one kind"),
        }
    }
    left
}

/// Returns the result that the parts have.
fn result(parts: &Parts) -> ResultFile {
    let mut result = ResultFile::from_json(&parts.result.json).unwrap();
    if let ResultFile::Identification(found) = &mut result
        && !parts.groups.is_empty()
    {
        let group = |part: &GroupResult| Group::from_json(&part.json).unwrap();
        found.set_groups(parts.groups.iter().map(group).collect());
    }
    result
}

/// The files are those that clients used to compute by themselves from evaluations and data. With
/// `INSTA_UPDATE=always`, as for snapshots, they are written instead.
#[tokio::test(flavor = "multi_thread")]
async fn a_result_needs_no_more_than_the_wire() {
    for (name, job) in jobs::jobs() {
        let parts = fetched(&job).await;
        let result = result(&parts);
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/wire/{name}.json"));
        if env::var_os("INSTA_UPDATE").is_some_and(|mode| mode == "always") {
            fs::write(&path, result.to_json()).unwrap();
        }
        let expected = fs::read_to_string(path).unwrap();
        assert_eq!(result.to_json(), expected, "{name}");
        assert_eq!(ResultFile::from_json(&expected).unwrap().to_json(), expected, "{name}");
        if name == "grouped" {
            let rows = parts.history.iter().flat_map(|block| &block.rows);
            let history: Vec<_> =
                rows.map(|row| history::evaluation_from_message(row).unwrap()).collect();
            let groups = results_csv::groups(&job, result.groups(), &history);
            let tables = groups + &results_csv::comparison(result.groups());
            assert_eq!(tables, include_str!("grouped.csv"));
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn realizations_and_derivatives_come_in_blocks() {
    let [(_, several), .., (_, grouped)] = jobs::jobs();
    let Parts { history, realizations, .. } = fetched(&several).await;
    let varied = history.iter().flat_map(|block| &block.rows).filter(|row| row.varied.is_some());
    assert_eq!(varied.count(), 7);
    assert!(realizations.iter().all(|(group, outcomes)| group.is_none() && outcomes.len() == 300));

    let parts = fetched(&grouped).await;
    let whose: Vec<Option<u32>> = parts.realizations.iter().map(|(group, _)| *group).collect();
    assert_eq!(whose, [Some(0), Some(1)]);
    let result = result(&parts);
    let names: Vec<&str> = result.groups().iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["left", "right, \"distal\""]);
    for (group, (_, outcomes)) in result.groups().iter().zip(&parts.realizations) {
        let velocities: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.ok()).collect();
        let mean = velocities.iter().sum::<f64>() / velocities.len() as f64;
        let found = group.velocity.moments.mean.unwrap();
        // Both sum in double precision, in different orders.
        assert!((mean / found - 1.0).abs() < 1e-12, "{mean}, {found}");
    }
}
