use std::path::Path;
use std::sync::Mutex;

use osteon_common::job::{Data, Group, JobKind};
use osteon_common::known_quantities::KnownQuantities;
use osteon_common::results::{EvaluationRole, Moments};
use osteon_files::job_file;
use tokio::sync::mpsc;

use super::*;
use crate::metrics::write_times::WriteTimes;
use crate::service::core_task::Message;

/// A core that knows one search, and answers nothing else.
struct FakeCore {
    source: PageSource,
    rows: Arc<Mutex<Vec<Evaluation>>>,
    /// Numbers of rows that were sent.
    sent: Arc<Mutex<Vec<usize>>>,
}

impl FakeCore {
    fn new(specification: JobSpecification) -> Self {
        let (messages, mut inbox) = mpsc::channel(8);
        let (store, _) = mpsc::channel(1);
        let rows: Arc<Mutex<Vec<Evaluation>>> = Arc::default();
        let (known, sent) = (Arc::clone(&rows), Arc::<Mutex<Vec<usize>>>::default());
        let (noted, specification) = (Arc::clone(&sent), Arc::new(specification));
        tokio::spawn(async move {
            while let Some(message) = inbox.recv().await {
                let Message::Ask(Request::Follow { from, limit, .. }, reply) = message else {
                    panic!("another message");
                };
                let rows = known.lock().unwrap();
                let from = usize::try_from(from).unwrap();
                let rows = rows.iter().skip(from).take(limit).copied().collect::<Vec<_>>();
                noted.lock().unwrap().push(rows.len());
                let specification = Arc::clone(&specification);
                drop(reply.send(Answer::Followed(SearchRows { specification, rows })));
            }
        });
        let source = PageSource::new(messages, &store, WriteTimes::default());
        Self { source, rows, sent }
    }

    fn add(&self, rows: impl IntoIterator<Item = Evaluation>) {
        self.rows.lock().unwrap().extend(rows);
    }

    async fn figures(&self, search: &mut FollowedSearch) -> Value {
        search.figures(&self.source, Caller::Connection(1)).await.unwrap().clone()
    }

    fn sent(&self) -> Vec<usize> {
        std::mem::take(&mut self.sent.lock().unwrap())
    }
}

fn specification() -> JobSpecification {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/fast.toml");
    let mut specification = job_file::read(&path, JobKind::Identification).unwrap();
    let group = |name: &str, base: f64| Group {
        name: name.to_owned(),
        velocities: (0..20).map(|k| base + 20.0 * f64::from(k)).collect(),
        subjects: None,
        observables: osteon_common::observables::ObservedColumns::default(),
        known: KnownQuantities::default(),
    };
    specification.data = Some(Data::from_groups(vec![group("a", 3800.0), group("b", 3900.0)]));
    specification
}

fn row(specification: &JobSpecification, number: u64, group: u32) -> Evaluation {
    Evaluation {
        number,
        role: EvaluationRole { group, ..EvaluationRole::default() },
        point: specification.start_of(0),
        moments: Some(Moments { mean: 3900.0, coefficient_of_variation: 0.03 }),
        observables: osteon_common::observables::ObservableValues::default(),
        cost: Some(1.0 / (number + 1) as f64),
        failures: FailureCounts::default(),
        estimated_error: None,
    }
}

#[tokio::test]
async fn each_update_reads_what_is_new_only() {
    let (job, core) = (specification(), FakeCore::new(specification()));
    let mut search = FollowedSearch::new(JobId(1), None);
    assert_eq!(core.figures(&mut search).await["figures"], json!([]));
    core.add((0..3).map(|number| row(&job, number, 0)));
    let drawn = core.figures(&mut search).await;
    assert_eq!((&drawn["evaluations"], &drawn["group"]), (&json!(3), &json!(0)));
    assert_eq!(drawn["groups"], json!(["a", "b"]));
    assert_eq!(core.figures(&mut search).await, drawn);
    core.add((3..5).map(|number| row(&job, number, 0)));
    assert_eq!(core.figures(&mut search).await["evaluations"], 5);
    // The last row is read again each time.
    assert_eq!(core.sent(), [0, 3, 1, 3]);
}

#[tokio::test]
async fn a_long_history_is_read_in_parts() {
    let (job, core) = (specification(), FakeCore::new(specification()));
    core.add((0..3 * ROWS_MAX as u64).map(|number| row(&job, number, 0)));
    let mut search = FollowedSearch::new(JobId(1), None);
    let drawn = core.figures(&mut search).await;
    assert_eq!(drawn["evaluations"], 3 * ROWS_MAX);
    assert!(core.sent().into_iter().all(|count| count <= ROWS_MAX));
}

#[tokio::test]
async fn the_group_that_the_search_is_at_is_shown_or_the_one_that_is_wanted() {
    let (job, core) = (specification(), FakeCore::new(specification()));
    let (mut newest, mut first) =
        (FollowedSearch::new(JobId(1), None), FollowedSearch::new(JobId(1), Some(0)));
    core.add((0..3).map(|number| row(&job, number, 0)));
    core.add((3..8).map(|number| row(&job, number, 1)));
    let drawn = core.figures(&mut newest).await;
    assert_eq!((&drawn["evaluations"], &drawn["group"]), (&json!(5), &json!(1)));
    assert!(drawn["figures"][0]["title"].as_str().unwrap().ends_with(", group b"), "{drawn}");
    // The data of that group, with their interval.
    assert!(drawn["figures"][1]["svg"].as_str().unwrap().contains("measured, 95 %"), "{drawn}");
    let drawn = core.figures(&mut first).await;
    assert_eq!((&drawn["evaluations"], &drawn["group"]), (&json!(3), &json!(0)));
    let mut none = FollowedSearch::new(JobId(1), Some(99));
    assert_eq!(core.figures(&mut none).await["evaluations"], 0);
}

#[tokio::test]
async fn a_search_that_begins_again_is_read_again() {
    let (job, core) = (specification(), FakeCore::new(specification()));
    let mut search = FollowedSearch::new(JobId(1), None);
    core.add((0..4).map(|number| row(&job, number, 0)));
    let before = core.figures(&mut search).await;
    // A worker was banned, and the last evaluation has another cost.
    core.rows.lock().unwrap().truncate(3);
    core.add([Evaluation { cost: Some(7.0), ..row(&job, 3, 0) }]);
    let after = core.figures(&mut search).await;
    assert_eq!(after["evaluations"], 4);
    assert_ne!(before["figures"][0]["svg"], after["figures"][0]["svg"]);
    core.rows.lock().unwrap().truncate(1);
    assert_eq!(core.figures(&mut search).await["evaluations"], 1);
}
