//! What comes over the wire, damaged: never a panic, a bound on the work, and what is accepted is
//! accepted again, to the bit, when it is written out.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

use std::path::Path;
use std::sync::Arc;

use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::outcome::{FailureKind, Outcome, RealizationResult};
use osteon_common::parameters::Point;
use osteon_common::posterior::PosteriorDraw;
use osteon_files::document::Format;
use osteon_files::{job_file, results_csv};
use osteon_fuzz::{bounded, damaged, properties, texts};
use osteon_proto::announced::Received;
use osteon_proto::batch::{self, Work};
use osteon_proto::v1::fetch_response::Part;
use osteon_proto::{
    draws, evaluation, history, parameter_values, realizations, specification, status, v1,
};
use proptest::prelude::*;
use prost::Message as _;
use tonic::{Code, Status};

/// Longest details of a status, bytes: HTTP/2 peers refuse trailers above 16 KiB, in base64.
const DETAILS_BYTES_MAX: usize = 12 << 10;

/// Every job of the corpus that is one.
fn jobs() -> Vec<JobSpecification> {
    let kinds = [JobKind::Identification, JobKind::Propagation];
    let read = |text: &String| {
        kinds.map(|kind| job_file::parse(text, Format::Toml, Path::new("/nonexistent"), kind).ok())
    };
    let jobs: Vec<_> = texts("jobs").iter().flat_map(read).flatten().collect();
    assert!(jobs.len() > 3, "{} jobs", jobs.len());
    jobs
}

fn specifications() -> Vec<Vec<u8>> {
    jobs().iter().map(|job| specification::to_message(job).encode_to_vec()).collect()
}

fn check_specification(bytes: &[u8]) {
    let decode = || v1::JobSpecification::decode(bytes);
    let Ok(message) = bounded(bytes.len(), decode) else { return };
    match bounded(bytes.len(), || specification::from_message(&message)) {
        Ok(job) => {
            assert!(job.check().is_empty(), "{}", job.check());
            let written = specification::to_message(&job);
            assert_eq!(specification::from_message(&written).as_ref(), Ok(&job));
            // What the wire accepts, a file may say.
            let text = job_file::to_toml(&job);
            let read = job_file::parse(&text, Format::Toml, Path::new(""), job.kind).unwrap();
            assert_eq!(read, job);
            assert_eq!(specification::to_message(&read), written);
        }
        Err(violations) => {
            let refusal = status::invalid_argument(&violations);
            assert!(refusal.details().len() <= DETAILS_BYTES_MAX, "{}", refusal.details().len());
            assert!(status::violations(&refusal).is_some());
        }
    }
}

/// The evaluation at the start of a job.
fn evaluation_of(job: &JobSpecification) -> evaluation::EvaluationInput {
    let (setup, point, germs) = (job.setup.clone(), job.start(), job.monte_carlo.germs());
    let observables = job.observables();
    evaluation::EvaluationInput { id: 7, setup, point, germs, random: job.random, observables }
}

fn evaluations() -> Vec<Vec<u8>> {
    jobs().iter().map(|job| evaluation::to_message(&evaluation_of(job)).encode_to_vec()).collect()
}

fn check_evaluation(bytes: &[u8]) {
    let Ok(message) = bounded(bytes.len(), || v1::Evaluation::decode(bytes)) else { return };
    match bounded(bytes.len(), || evaluation::from_message(&message)) {
        Ok(evaluation) => {
            let written = evaluation::to_message(&evaluation);
            assert_eq!(evaluation::from_message(&written), Ok(evaluation));
            // A worker guesses nothing: what it took is all that was said.
            assert_eq!(written, message);
        }
        Err(malformed) => assert!(malformed.to_string().len() < DETAILS_BYTES_MAX),
    }
}

/// A stream on which the evaluation of [`batches`] came.
fn received() -> Received {
    let mut received = Received::default();
    received.receive(&evaluation::to_message(&evaluation_of(&jobs()[0]))).unwrap();
    received
}

fn batches() -> Vec<Vec<u8>> {
    let evaluation = Arc::new(evaluation_of(&jobs()[0]));
    let work = |(first, count)| Work { evaluation: Arc::clone(&evaluation), first, count };
    let ranges = [(17, 5), (0, 65_536), (9_999_999, 1)];
    ranges.map(|range| batch::to_message(3, &work(range)).encode_to_vec()).to_vec()
}

fn check_batch(bytes: &[u8], received: &Received) {
    let Ok(message) = bounded(bytes.len(), || v1::Batch::decode(bytes)) else { return };
    match bounded(bytes.len(), || batch::from_message(&message, received)) {
        Ok(work) => {
            let written = batch::to_message(message.batch, &work);
            assert_eq!(batch::from_message(&written, received), Ok(work));
            // A worker guesses nothing: what it took is all that was said.
            assert_eq!(written, message);
        }
        Err(malformed) => assert!(malformed.to_string().len() < DETAILS_BYTES_MAX),
    }
}

fn outcomes() -> Vec<Outcome> {
    vec![Ok(3900.5), Err(FailureKind::NoArrival), Ok(4000.25), Ok(f64::MIN_POSITIVE)]
}

fn answers() -> Vec<Vec<u8>> {
    let solve = |outcome: Outcome| match outcome {
        Ok(velocity) => RealizationResult::solved(velocity, 2e-5),
        Err(kind) => RealizationResult::failed(kind),
    };
    let solved: Vec<_> = outcomes().into_iter().map(solve).collect();
    [1, 100]
        .map(|times| batch::answer_to_message(3, &solved.repeat(times), 0.25).encode_to_vec())
        .to_vec()
}

fn check_answer(bytes: &[u8]) {
    let Ok(message) = bounded(bytes.len(), || v1::BatchResult::decode(bytes)) else { return };
    if let Ok(solved) = bounded(bytes.len(), || batch::answer_from_message(&message)) {
        let written = batch::answer_to_message(message.batch, &solved, message.elapsed_s);
        assert_eq!(written.encode_to_vec(), message.encode_to_vec());
        assert!(solved.iter().all(RealizationResult::is_consistent));
    }
}

const POINT: Point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);

fn row(number: u64) -> v1::EvaluationRow {
    let failures =
        vec![v1::FailureCount { kind: 1, count: 1 }, v1::FailureCount { kind: 5, count: 2 }];
    v1::EvaluationRow {
        number,
        point: Some(parameter_values::point_to_message(&POINT)),
        moments: Some(v1::Moments { mean: 3906.0, coefficient_of_variation: 0.027 }),
        cost: Some(f64::INFINITY),
        failures,
        estimated_error: Some(v1::EstimatedError { median: 1e-5, largest: 3e-5 }),
        start: 1,
        varied: (number == 2).then_some(v1::Parameter::Dispersion.into()),
        ..v1::EvaluationRow::default()
    }
}

fn draw() -> PosteriorDraw {
    PosteriorDraw { point: POINT, log_density: -1.5, mean: 3900.0, coefficient_of_variation: 0.03 }
}

/// Parts of a fetch whose contents this crate converts: history, realizations and draws.
fn fetches() -> Vec<Vec<u8>> {
    let parts = [
        Part::History(v1::HistoryBlock { rows: (0..3).map(row).collect(), groups: Vec::new() }),
        Part::Realizations(realizations::to_message(Some(7), 0, &outcomes())),
        Part::Draws(draws::draws_to_message(Some(7), 0, &[draw()])),
    ];
    parts.map(|part| v1::FetchResponse { part: Some(part) }.encode_to_vec()).to_vec()
}

/// What a client does with a part of a fetch.
fn check_fetch(bytes: &[u8]) {
    let decode = || v1::FetchResponse::decode(bytes);
    let Ok(v1::FetchResponse { part: Some(part) }) = bounded(bytes.len(), decode) else { return };
    bounded(bytes.len(), || match part {
        Part::Specification(message) => check_specification(&message.encode_to_vec()),
        Part::History(block) => check_history(&block),
        // Clients read the texts in these as files.
        Part::Result(_) | Part::Group(_) => {}
        Part::Realizations(block) => {
            let Ok((first, outcomes)) = realizations::from_message(&block) else { return };
            assert_eq!(realizations::to_message(block.group, first, &outcomes), block);
        }
        Part::Draws(block) => {
            let Ok((first, draws)) = draws::draws_from_message(&block) else { return };
            let written = draws::draws_to_message(block.group, first, &draws);
            assert_eq!(written.encode_to_vec(), block.encode_to_vec());
        }
    });
}

fn check_history(block: &v1::HistoryBlock) {
    let rows = block.rows.iter().map(history::evaluation_from_message);
    let Ok(rows) = rows.collect::<Result<Vec<_>, _>>() else { return };
    for row in &rows {
        let written = history::evaluation_to_message(row);
        let again = history::evaluation_from_message(&written).unwrap();
        let again = history::evaluation_to_message(&again);
        assert_eq!(again.encode_to_vec(), written.encode_to_vec());
    }
    let searched = rows.iter().filter(|row| row.role.varied.is_none()).count();
    assert_eq!(results_csv::history(&jobs()[0], &rows).lines().count(), searched + 1);
}

#[test]
fn every_seed_is_taken() {
    for bytes in specifications() {
        let message = v1::JobSpecification::decode(bytes.as_slice()).unwrap();
        specification::from_message(&message).unwrap();
        check_specification(&bytes);
    }
    for bytes in evaluations() {
        let message = v1::Evaluation::decode(bytes.as_slice()).unwrap();
        evaluation::from_message(&message).unwrap();
        check_evaluation(&bytes);
    }
    let received = received();
    for bytes in batches() {
        let message = v1::Batch::decode(bytes.as_slice()).unwrap();
        batch::from_message(&message, &received).unwrap();
        check_batch(&bytes, &received);
    }
    for bytes in answers() {
        let message = v1::BatchResult::decode(bytes.as_slice()).unwrap();
        batch::answer_from_message(&message).unwrap();
        check_answer(&bytes);
    }
    history::evaluation_from_message(&row(0)).unwrap();
    fetches().iter().for_each(|bytes| check_fetch(bytes));
}

#[test]
fn large_and_deep_messages_take_no_more_than_their_share() {
    let mut job = specification::to_message(&jobs()[0]);
    // At the bound, and above it.
    for count in [1_000_000, 1_000_001] {
        job.data = Some(v1::Data { velocities: vec![-1.0; count], ..v1::Data::default() });
        check_specification(&job.encode_to_vec());
    }
    job.picking.as_mut().unwrap().extremum = i32::MAX;
    job.solver.as_mut().unwrap().method = i32::MIN;
    check_specification(&job.encode_to_vec());
    // The same fields again and again: the last ones count.
    check_specification(&specifications()[0].repeat(1000));
    // Messages within messages: refused, or not looked at.
    let mut nested = Vec::new();
    for _ in 0..2000 {
        let mut outer = vec![0x12];
        prost::encoding::encode_varint(nested.len() as u64, &mut outer);
        outer.append(&mut nested);
        nested = outer;
    }
    check_specification(&nested);
    check_fetch(&nested);
    let failures = vec![v1::FailureCount { kind: 1, count: u64::MAX }; 10_000];
    for failures in
        [failures, (1..=5).map(|kind| v1::FailureCount { kind, count: u64::MAX }).collect()]
    {
        let rows = vec![v1::EvaluationRow { failures, ..row(0) }];
        let part = Some(Part::History(v1::HistoryBlock { rows, groups: Vec::new() }));
        check_fetch(&v1::FetchResponse { part }.encode_to_vec());
    }
}

properties! {
    fn damaged_specifications_are_read_or_refused(bytes in damaged(specifications())) {
        check_specification(&bytes);
    }

    fn damaged_evaluations_are_read_or_refused(bytes in damaged(evaluations())) {
        check_evaluation(&bytes);
    }

    fn damaged_batches_are_read_or_refused(bytes in damaged(batches())) {
        check_batch(&bytes, &received());
    }

    fn damaged_answers_are_read_or_refused(bytes in damaged(answers())) {
        check_answer(&bytes);
    }

    fn damaged_fetches_are_read_or_refused(bytes in damaged(fetches())) {
        check_fetch(&bytes);
    }

    fn arbitrary_details_of_a_status_do_not_matter(bytes in proptest::collection::vec(any::<u8>(), 0..100)) {
        let status = Status::with_details(Code::InvalidArgument, "no", bytes.into());
        let _ = status::violations(&status);
    }
}
