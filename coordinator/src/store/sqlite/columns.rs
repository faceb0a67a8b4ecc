//! Converts records to columns and back, with their checksums.

use std::collections::BTreeSet;
use std::time::Duration;

use osteon_common::observables::{OBSERVABLES, ObservedColumns, PerObservable};
use osteon_common::outcome::{Outcome, decode, encode};
use osteon_common::parameters::{BONE_PARAMETERS, PARAMETERS, Point};
use osteon_common::results::EstimatedError;
use osteon_common::systematic::{Shift, SystematicQuantity};
use osteon_common::version::Program;

use crate::core::ids::JobId;
use crate::core::worker_name::WorkerName;
use crate::store::{BanRecord, EndRecord};

/// Size of an outcome in a blob, bytes: its code, and its velocity as little-endian f64.
const OUTCOME_BYTES: usize = 9;

/// Returns nanoseconds as stored: SQLite has only signed integers.
pub(super) fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).map_or(i64::MAX as u64, |ns| ns.min(i64::MAX as u64))
}

/// The columns of a job that its checksum covers.
pub(super) struct JobColumns<'a> {
    pub(super) job: JobId,
    pub(super) request_id: &'a str,
    pub(super) accepted_ns: u64,
    pub(super) specification: &'a [u8],
    pub(super) fingerprint: &'a str,
    pub(super) client: &'a str,
    pub(super) priority: u32,
    pub(super) name: &'a str,
}

pub(super) fn job_checksum(columns: &JobColumns<'_>) -> Vec<u8> {
    checksum(&[
        &columns.job.0.to_le_bytes(),
        columns.request_id.as_bytes(),
        &columns.accepted_ns.to_le_bytes(),
        columns.specification,
        columns.fingerprint.as_bytes(),
        columns.client.as_bytes(),
        &columns.priority.to_le_bytes(),
        columns.name.as_bytes(),
    ])
}

pub(super) fn ban_checksum(record: &BanRecord) -> Vec<u8> {
    // That it was lifted is in a row of its own.
    let BanRecord { number, worker, job, reason, at, lifted: _ } = record;
    let numbers = [*number, job.0, nanoseconds(*at), worker.process().into(), worker.instance()];
    let numbers = numbers.map(u64::to_le_bytes);
    let mut fields: Vec<&[u8]> = numbers.iter().map(<[u8; 8]>::as_slice).collect();
    fields.extend([worker.host().as_bytes(), reason.as_bytes()]);
    checksum(&fields)
}

/// Returns the checksum of an evaluation, which covers those of its pieces. Absent estimated errors are
/// an empty field; without pieces there is no field for them.
pub(super) fn evaluation_checksum(
    (job, number): (JobId, u64),
    point: &[u8],
    (outcomes, pieces): (&[u8], &[u8]),
    errors: Option<&[u8]>,
    workers: &str,
) -> Vec<u8> {
    let (job, number) = (job.0.to_le_bytes(), number.to_le_bytes());
    let errors = errors.unwrap_or_default();
    let fields: [&[u8]; 7] = [&job, &number, point, outcomes, errors, workers.as_bytes(), pieces];
    let without_pieces = fields.len() - 1;
    checksum(if pieces.is_empty() { &fields[..without_pieces] } else { &fields })
}

pub(super) fn end_checksum(end: &EndRecord) -> Vec<u8> {
    let EndRecord { job, ending, program, ended, evaluations, best_cost, best_moments } = end;
    let Program { version, numerics, commit } = program;
    let optional = |value: Option<f64>| value.map(|value| value.to_le_bytes().to_vec());
    let (mean, variation) = (
        best_moments.map(|moments| moments.mean),
        best_moments.map(|moments| moments.coefficient_of_variation),
    );
    let reason = ending.reason.as_ref().map(|reason| reason.as_bytes().to_vec());
    let failure = ending.failure.map(|failure| failure.name().as_bytes().to_vec());
    let numbers = [job.0, nanoseconds(*ended), *evaluations].map(u64::to_le_bytes);
    let mut fields: Vec<&[u8]> = numbers.iter().map(<[u8; 8]>::as_slice).collect();
    let numerics = numerics.to_le_bytes();
    fields.extend([ending.status.name().as_bytes(), version.as_bytes(), &numerics]);
    let commit = commit.as_ref().map(|commit| commit.as_bytes().to_vec());
    // A field of one byte tells whether an optional value is present; an absent one has no further
    // field.
    let optional =
        [failure, reason, optional(*best_cost), optional(mean), optional(variation), commit];
    for value in &optional {
        fields.push(if value.is_some() { &[1] } else { &[0] });
        fields.extend(value.as_deref());
    }
    checksum(&fields)
}

/// Returns the BLAKE3 hash of fields, each preceded by its length.
pub(super) fn checksum(fields: &[&[u8]]) -> Vec<u8> {
    let mut hasher = blake3::Hasher::new();
    for field in fields {
        hasher.update(&(field.len() as u64).to_le_bytes()).update(field);
    }
    hasher.finalize().as_bytes().to_vec()
}

/// First byte of a blob whose records are followed by columns of observables; no record begins with it.
const COLUMNS_FOLLOW: u8 = 0xFF;

/// Packs outcomes, one record after the other; with observables, as [`with_columns`] says.
pub(super) fn pack_outcomes(
    outcomes: &[Outcome],
    observables: PerObservable<Option<&[f64]>>,
) -> Vec<u8> {
    let mut packed = vec![0; outcomes.len() * OUTCOME_BYTES];
    let (records, _) = packed.as_chunks_mut::<OUTCOME_BYTES>();
    for (record, &outcome) in records.iter_mut().zip(outcomes) {
        let (code, velocity) = encode(outcome);
        record[0] = code;
        record[1..].copy_from_slice(&velocity.to_le_bytes());
    }
    with_columns(packed, observables)
}

/// Returns a blob of records. If there are observables, it begins with a byte that no record begins with,
/// and a byte with a bit for each of them, and the records are followed by the values of each observable
/// as little-endian f64.
pub(super) fn with_columns(
    records: Vec<u8>,
    observables: PerObservable<Option<&[f64]>>,
) -> Vec<u8> {
    if observables.which().is_empty() {
        return records;
    }
    let bits = observables.present().map(|(one, _)| 1 << (one as u8)).sum();
    let mut blob = vec![COLUMNS_FOLLOW, bits];
    blob.extend(records);
    for (_, values) in observables.present() {
        blob.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
    blob
}

/// Returns the records of a blob, of `RECORD` bytes each, and the observables that follow them; `None` if
/// it is damaged.
pub(super) fn without_columns<const RECORD: usize>(
    packed: &[u8],
) -> Option<(&[u8], ObservedColumns)> {
    let [COLUMNS_FOLLOW, bits, both @ ..] = packed else {
        return Some((packed, ObservedColumns::default()));
    };
    let has = PerObservable::new(|one| bits & (1 << (one as u8)) != 0);
    let row_bytes = RECORD + 8 * has.members().count();
    if *bits == 0 || *bits >= 1 << OBSERVABLES || both.len() % row_bytes != 0 {
        return None;
    }
    let count = both.len() / row_bytes;
    let (records, values) = both.split_at(count * RECORD);
    let mut values = values.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes));
    let columns = PerObservable::new(|one| has[one].then(|| values.by_ref().take(count).collect()));
    Some((records, columns))
}

/// Returns outcomes and their observables; `None` if they are damaged.
pub(super) fn unpack_outcomes(packed: &[u8]) -> Option<(Vec<Outcome>, ObservedColumns)> {
    let (packed, columns) = without_columns::<OUTCOME_BYTES>(packed)?;
    let (records, rest) = packed.as_chunks::<OUTCOME_BYTES>();
    if !rest.is_empty() {
        return None;
    }
    // With room for all of them: there may be millions.
    let mut outcomes = Vec::with_capacity(records.len());
    for [code, velocity @ ..] in records {
        outcomes.push(decode(*code, f64::from_le_bytes(*velocity))?);
    }
    let fits = |(outcome, value): (&Outcome, &f64)| match outcome {
        Ok(_) => value.is_finite(),
        Err(_) => value.to_bits() == 0,
    };
    let consistent = columns.present().all(|(_, values)| outcomes.iter().zip(values).all(fits));
    consistent.then_some((outcomes, columns))
}

pub(super) fn pack_errors(errors: EstimatedError) -> Vec<u8> {
    [errors.median, errors.largest].into_iter().flat_map(f64::to_le_bytes).collect()
}

pub(super) fn unpack_errors(packed: &[u8]) -> Option<EstimatedError> {
    let (values, rest) = packed.as_chunks::<8>();
    let &[median, largest] = values else { return None };
    let (median, largest) = (f64::from_le_bytes(median), f64::from_le_bytes(largest));
    rest.is_empty().then_some(EstimatedError { median, largest })
}

/// Packs the numbers of the bone, and all others too if any of them is searched; and then number and value of
/// the quantity by which the point is shifted, if it is.
pub(super) fn pack_point(point: Point) -> Vec<u8> {
    let of_bone = point.given().all(|(parameter, _)| parameter.of_setup().is_none());
    let count = if of_bone { BONE_PARAMETERS } else { PARAMETERS };
    let shift = point.shift().map(|Shift { quantity, value }| [f64::from(quantity as u8), value]);
    let values = point.0.into_iter().take(count).chain(shift.into_iter().flatten());
    values.flat_map(f64::to_le_bytes).collect()
}

pub(super) fn unpack(point: &[u8]) -> Option<Point> {
    let (values, rest) = point.as_chunks::<8>();
    let values: Vec<f64> = values.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let (numbers, shift) = match values.as_slice() {
        [numbers @ .., quantity, value]
            if [BONE_PARAMETERS, PARAMETERS].contains(&numbers.len()) =>
        {
            let is_one = |one: &SystematicQuantity| f64::from(*one as u8) == *quantity;
            let quantity = SystematicQuantity::ALL.into_iter().find(is_one)?;
            (numbers, Some(Shift { quantity, value: *value }))
        }
        numbers => (numbers, None),
    };
    let of_bone = || <[f64; BONE_PARAMETERS]>::try_from(numbers).map(Point::of_bone);
    let all = || <[f64; PARAMETERS]>::try_from(numbers).map(Point::new);
    let point = of_bone().or_else(|_| all()).ok().filter(|_| rest.is_empty());
    point.map(|point| point.shifted(shift))
}

/// Packs worker names, one line each: the process, a slash and the number that it drew in
/// hexadecimal, a space, the host.
pub(super) fn pack_workers(workers: &BTreeSet<WorkerName>) -> String {
    workers.iter().map(pack_worker).collect::<Vec<_>>().join("\n")
}

/// Packs one worker name, as a line.
pub(super) fn pack_worker(worker: &WorkerName) -> String {
    format!("{}/{:x} {}", worker.process(), worker.instance(), worker.host())
}

/// Returns the worker name of a line.
pub(super) fn unpack_worker(line: &str) -> Option<WorkerName> {
    let (process, host) = line.split_once(' ')?;
    let (process, drawn) = process.split_once('/')?;
    let instance = u64::from_str_radix(drawn, 16).ok()?;
    Some(WorkerName::new(host, process.parse().ok()?, instance))
}

pub(super) fn unpack_workers(packed: &str) -> Option<BTreeSet<WorkerName>> {
    packed.split('\n').filter(|line| !line.is_empty()).map(unpack_worker).collect()
}
