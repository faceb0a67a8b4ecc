//! A cheap substitute for the physics: moments that depend on the point like those of a bone, and
//! an occasional failure. It is deterministic: a function of point, seed and index. Also helpers
//! around a coordinator that a test drives directly: submissions, workers, and the store's writes
//! and reads.

use std::sync::Arc;

use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{Data, JobKind, JobSpecification, MonteCarlo, Objective, Range, Search};
use osteon_common::outcome::{FailureKind, RealizationResult};
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::results::{EstimatedError, JobResult};
use osteon_common::systematic::Systematic;
use osteon_common::version::{self, Program, VERSION};
use osteon_coordinator::core::effect::Record;
use osteon_coordinator::core::event::{Event, Hello, Request};
use osteon_coordinator::core::ids::{JobId, WorkerId};
use osteon_coordinator::store::Store;
use osteon_proto::batch::Work;
use osteon_proto::evaluation::EvaluationInput;
use osteon_proto::v1::WorkerHello;
use osteon_search::{Ending, Search as Driven, Step};

/// Starts and bounds of the seven parameters.
const RANGES: [(f64, f64, f64); 7] = [
    (1700.0, 1500.0, 2000.0),
    (20e9, 12e9, 25e9),
    (0.33, 0.2, 0.45),
    (4.5e9, 3e9, 6.5e9),
    (11e9, 8e9, 16e9),
    (0.38, 0.2, 0.5),
    (0.15, 0.02, 0.3),
];

/// Returns a small identification.
pub(crate) fn identification(
    realizations: u64,
    max_evaluations: u64,
    seed: u64,
) -> JobSpecification {
    JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(Data::from_moments(3906.0, 0.027)),
        parameters: Range::of_bone(RANGES.map(|(start, lower, upper)| Range::Free {
            start,
            lower,
            upper,
        })),
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo {
            realizations,
            seed,
            max_failed_fraction: 0.2,
            ..MonteCarlo::default()
        },
        objective: Objective::default(),
        search: Search { max_evaluations, sensitivities: false, ..Search::default() },
        posterior: None,
    }
}

/// Returns a propagation at the start values.
pub(crate) fn propagation(realizations: u64, seed: u64) -> JobSpecification {
    JobSpecification {
        kind: JobKind::Propagation,
        data: None,
        ..identification(realizations, 1, seed)
    }
}

/// Returns the submission of a job by a client without a name, with a request id unless it is
/// empty.
pub(crate) fn submission(specification: &JobSpecification, request_id: &str) -> Request {
    Request::Submit {
        specification: Arc::new(specification.clone()),
        request_id: request_id.to_owned(),
        client: String::new(),
        priority: 0,
        name: String::new(),
    }
}

/// Returns the event that a worker with one thread attaches; its stay has the number of its
/// process.
pub(crate) fn attached(process: u32) -> Event {
    Event::Hello { worker: WorkerId(process.into()), hello: hello(process) }
}

/// Returns the introduction of a worker with one thread, on a host of its own.
pub(crate) fn hello(process: u32) -> Hello {
    let WorkerHello { version, fingerprint, slots, host, process, instance } = wire_hello(process);
    Hello { version, fingerprint, slots, host, process, instance }
}

/// Returns the same introduction as a message.
pub(crate) fn wire_hello(process: u32) -> WorkerHello {
    WorkerHello {
        version: VERSION.to_owned(),
        fingerprint: version::fingerprint(),
        slots: 1,
        host: format!("node-{process}"),
        process,
        instance: mix(process.into()),
    }
}

/// Puts a record into the store, and returns the event that reports it.
pub(crate) fn written(store: &mut dyn Store, record: &Record) -> Event {
    match record {
        Record::Job(record) => store.put_job(record),
        Record::Evaluation { record, deletes_later } => {
            store.put_evaluation(record, *deletes_later)
        }
        Record::Evaluations(records) => store.put_evaluations(records),
        Record::Part(record) => store.put_part(record),
        Record::Piece { record, .. } => store.put_piece(record),
        Record::End { end, summary } => store.finish_job(end, summary),
        Record::Ban(record) => store.put_ban(record),
    }
    .unwrap();
    let (job, key) = record.key();
    Event::Stored { job, key }
}

/// Reads an evaluation from the store, and returns the event that reports it.
pub(crate) fn read(store: &mut dyn Store, job: JobId, number: u64) -> Event {
    Event::Read { job, number, found: Ok(store.evaluation(job, number).unwrap()) }
}

/// Returns all realizations of a batch.
pub(crate) fn solved(work: &Work) -> Vec<RealizationResult> {
    (work.first..work.first + u64::from(work.count)).map(|index| realization(work, index)).collect()
}

/// Returns the realization at one index.
fn realization(work: &Work, index: u64) -> RealizationResult {
    let noise = mix(work.evaluation.germs.seed ^ index.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    if noise.is_multiple_of(29) {
        return RealizationResult::failed(FailureKind::ALL[(noise / 29 % 5) as usize]);
    }
    let uniform = (noise >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
    let [density, e_l, nu_l, _, e_t, nu_t, dispersion, ..] = work.evaluation.point.0;
    let margin = e_l * (1.0 - nu_t) - 2.0 * e_t * nu_l * nu_l;
    let c11 = e_l * e_l * (1.0 - nu_t) / margin;
    let velocity = 0.99 * (c11 / density).sqrt() * (1.0 + 0.92 * dispersion * uniform);
    RealizationResult::solved(velocity, 1e-5 * (noise % 1000) as f64 / velocity)
}

/// Returns a well mixed function of one number (splitmix64).
pub(crate) fn mix(number: u64) -> u64 {
    let mut z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Returns the result of a specification, computed in one loop without a coordinator.
pub(crate) fn plain_run(specification: &JobSpecification) -> JobResult {
    let mut search = Driven::new(Arc::new(specification.clone()));
    let mut told = Vec::new();
    loop {
        match search.ask() {
            Step::Evaluate(point) => {
                let (outcomes, estimated_error) = evaluation(specification, point);
                told.push(outcomes.clone());
                search.tell(outcomes, estimated_error);
            }
            Step::Done(ending) => return left_by(&search, specification, &told, &ending),
        }
    }
}

/// Returns the output of a job, given the outcomes of all its evaluations.
pub(crate) fn left_by(
    search: &Driven,
    specification: &JobSpecification,
    told: &[Outcomes],
    ending: &Ending,
) -> JobResult {
    let summary = search.summary();
    let best = |number: Option<u64>| {
        let number = number?;
        summary.best_point(specification, number, &told[usize::try_from(number).unwrap()])
    };
    let groups = summary.groups.iter().enumerate();
    let groups =
        groups.filter_map(|(set, group)| summary.group(specification, set, best(group.best)));
    let groups = groups.collect();
    summary.result(specification, ending, &Program::current(None), best(summary.best), groups)
}

/// Returns all outcomes at one point, with the median and the largest of their estimated errors.
pub(crate) fn evaluation(
    specification: &JobSpecification,
    point: Point,
) -> (Outcomes, Option<EstimatedError>) {
    let evaluation = Arc::new(EvaluationInput {
        id: 1,
        setup: specification.setup.clone(),
        point,
        random: RandomQuantities::default(),
        observables: osteon_common::observables::ObservableSet::NONE,
        germs: specification.monte_carlo.germs(),
    });
    let work = |first| Work { evaluation: Arc::clone(&evaluation), first, count: 1 };
    let indices = 0..specification.monte_carlo.realizations;
    let solved: Vec<_> = indices.map(|index| realization(&work(index), index)).collect();
    let successes = solved.iter().filter(|solved| solved.outcome.is_ok());
    let mut errors: Vec<_> = successes.map(|solved| solved.estimated_error).collect();
    errors.sort_by(f64::total_cmp);
    let middle = errors.len() / 2;
    let estimated_error = errors.last().map(|&largest| EstimatedError {
        // For an even number of errors, the mean of the two middle ones.
        median: match errors.len() % 2 {
            0 => 0.5_f64.mul_add(errors[middle] - errors[middle - 1], errors[middle - 1]),
            _ => errors[middle],
        },
        largest,
    });
    (solved.iter().map(|solved| solved.outcome).collect(), estimated_error)
}
