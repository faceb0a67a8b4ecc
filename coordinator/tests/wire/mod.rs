//! The results of an identification that a client can get from the messages alone.

use osteon_common::job::JobKind;
use osteon_common::outcome::Outcome;
use osteon_common::results::JobResult;
use osteon_files::report::ResultFile;
use osteon_files::results_csv;

use osteon_proto::results::ResultBlocks;
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

/// Returns the result that a client makes of the parts.
fn result(parts: &Parts) -> JobResult {
    let of = |group: Option<u32>| {
        let found = parts.realizations.iter().find(|(of, _)| *of == group);
        let outcomes = found.map(|(_, outcomes)| outcomes.clone()).unwrap_or_default();
        ResultBlocks { outcomes, ..ResultBlocks::default() }
    };
    let groups = parts
        .groups
        .iter()
        .map(|group| results::group_from_message(group, of(Some(group.group))).unwrap());
    results::from_message(&parts.result, of(None), groups.collect()).unwrap()
}

/// The files are those that clients used to compute by themselves from evaluations and data.
#[tokio::test(flavor = "multi_thread")]
async fn a_result_needs_no_more_than_the_wire() {
    for (name, job) in jobs::jobs() {
        let parts = fetched(&job).await;
        let result = result(&parts);
        let expected = match name {
            "several" => include_str!("several.json"),
            "likelihood" => include_str!("likelihood.json"),
            "drawn" => include_str!("drawn.json"),
            "grouped" => include_str!("grouped.json"),
            other => panic!("{other} has no file"),
        };
        let written = ResultFile::from_job(JobKind::Identification, &result).to_json();
        assert_eq!(written, expected, "{name}");
        assert_eq!(ResultFile::from_json(expected).unwrap().to_json(), expected, "{name}");
        if name == "grouped" {
            let rows = parts.history.iter().flat_map(|block| &block.rows);
            let history: Vec<_> =
                rows.map(|row| results::evaluation_from_message(row).unwrap()).collect();
            let groups = results_csv::groups(&job, &result, &history);
            let tables = groups + &results_csv::comparison(&result);
            assert_eq!(tables, include_str!("grouped.csv"));
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn messages_hold_the_uncertainty() {
    let [(_, several), .., (_, grouped)] = jobs::jobs();
    let Parts { result, history, realizations, .. } = fetched(&several).await;
    assert_eq!(result.sensitivities.len(), 7);
    let identified = result.identified.unwrap();
    // With free directions only a posterior has intervals.
    let bulk = identified.bulk_velocity.unwrap();
    assert!(bulk.value > Some(0.0) && bulk.interval.is_none(), "{bulk:?}");
    assert_eq!((identified.directions.len(), identified.free_directions.len()), (2, 5));
    assert_eq!(result.profiles.len(), 7);
    let solutions = result.solutions.unwrap();
    assert_eq!((solutions.points.len(), solutions.mandel.len()), (3, 21));
    let data = result.data.unwrap();
    assert_eq!(data.count, Some(40));
    let of_mean = data.intervals.unwrap().mean.unwrap();
    assert!(of_mean.lower < Some(3900.0) && Some(3900.0) < of_mean.upper, "{of_mean:?}");
    let best = result.best.unwrap();
    assert_ne!(best.meaning(), osteon_proto::v1::PointMeaning::Unspecified);
    let varied = history.iter().flat_map(|block| &block.rows).filter(|row| row.varied.is_some());
    assert_eq!(varied.count(), 7);
    assert!(realizations.iter().all(|(group, outcomes)| group.is_none() && outcomes.len() == 300));

    let Parts { result, groups, realizations, .. } = fetched(&grouped).await;
    assert!(result.best.is_none() && result.data.is_none() && result.identified.is_none());
    let names: Vec<&str> = groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["left", "right, \"distal\""]);
    let whose: Vec<Option<u32>> = realizations.iter().map(|(group, _)| *group).collect();
    assert_eq!(whose, [Some(0), Some(1)]);
    for (group, (_, outcomes)) in groups.iter().zip(&realizations) {
        let dispersion = group.identified.as_ref().unwrap().dispersion.unwrap();
        assert!(dispersion.value.is_some() && dispersion.interval.is_none());
        let velocities: Vec<f64> = outcomes.iter().filter_map(|outcome| outcome.ok()).collect();
        let mean = velocities.iter().sum::<f64>() / velocities.len() as f64;
        let found = group.best.as_ref().unwrap().velocity.unwrap().moments.unwrap().mean;
        // Both sum in double precision, in different orders.
        assert!((mean / found - 1.0).abs() < 1e-12, "{mean}, {found}");
    }
}
