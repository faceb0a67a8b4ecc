//! The constants by which the coordinator decides who computes what, when an answer is late, and which answers are
//! compared. None of them changes a result: they decide how soon it is there, and how soon a broken machine is
//! found.
//!
//! Each constant that affects speed was switched off in turn under `cargo xtask bench fleet`. A job then takes 1.6
//! times as long without `SHARE_DIVISOR` (30 workers, 0.1 ms realizations); with 1,000 workers 2.1 times without `BATCH_COST_S`, 1.4 to 2.4 times without `RATED_WORKERS_MIN`, and 1.4 times without
//! `MANY_WORKERS`; with groups 1.4 times without `BATCH_WORTH_S`. A search takes 1.1 to 1.3 times as long without
//! speculation. The others bound what a fault, or an event, can cost.

use std::time::Duration;

use osteon_common::limits::WORKERS_MAX;

// ---- What a worker holds, and how many realizations it gets ----

/// Batches that a worker holds at most: it computes one while the next is on its way.
pub const BATCHES_IN_FLIGHT_MAX: usize = 2;
/// Realizations for each slot in a worker's first batch of a job: enough to measure its rate, few
/// enough to be answered soon. With 1 or 16 a job takes as long.
pub(crate) const FIRST_BATCH_PER_SLOT: u32 = 4;
/// A batch holds at most this fraction (1 over the constant) of a worker's share of the remaining
/// realizations. It may hold more to give each of the worker's slots one realization, up to the share,
/// or to be worth its cost.
pub(crate) const SHARE_DIVISOR: f64 = 4.0;
/// Time that a batch costs the coordinator, s: 60 to 90 µs were measured for batches of 150 realizations.
pub(crate) const BATCH_COST_S: f64 = 1e-4;
/// Time that a batch takes its worker, s, from which on its cost does not matter: 200 times [`BATCH_COST_S`].
pub(crate) const BATCH_WORTH_S: f64 = 0.02;
/// Workers that must have computed something of a job before it is known how fast one of the others may be.
pub(crate) const RATED_WORKERS_MIN: u64 = 8;
/// With this many workers or more, one whose speed at a job is unknown holds one batch of it only: a second one, as
/// small as the first, would cost more than the moment for which the worker is idle after its answer.
pub(crate) const MANY_WORKERS: usize = 16;
/// Time of a realization, s, that is assumed before the first answer of a job.
pub(crate) const REALIZATION_USUAL_S: f64 = 1e-3;

// ---- What is learnt from answers ----

/// Weight of the newest answer in a worker's rate. Half: machines change their speed within seconds.
pub(crate) const RATE_WEIGHT: f64 = 0.5;
/// Fraction of the previous estimate of a realization's time that is kept when an answer shows a shorter one.
pub(crate) const REALIZATION_TIME_KEPT: f64 = 0.5;
/// Weight of the newest answer in the mean delay of answers.
pub(crate) const DELAY_WEIGHT: f64 = 1.0 / 16.0;
/// Longest delay of an answer that counts, s: a single answer may be later for a reason of its own.
pub(crate) const DELAY_MAX_S: f64 = 2.0;
/// Shortest computing time of a batch that a worker is believed to have needed, s.
pub(crate) const ELAPSED_MIN_S: f64 = 1e-6;
/// Longest computing time of a batch that is estimated or charged to a client, whatever the worker reports.
pub(crate) const DURATION_MAX: Duration = Duration::from_secs(86_400);

// ---- Late answers ----

/// A batch is overdue after this time at the earliest. A worker, a network or a machine may pause for a second or two
/// without being faulty.
pub(crate) const OVERDUE_MIN: Duration = Duration::from_secs(3);
/// A batch is overdue after this many times its expected time at the earliest: a machine may have other things to do,
/// and one point may take several times as long as another.
pub(crate) const OVERDUE_FACTOR: u32 = 4;
/// Duplicates that are sent on one event at most; the others follow on the next.
pub(crate) const OVERDUE_AT_ONCE_MAX: usize = 64;
/// A worker is on probation after this many consecutive batches that others answered, over at least [`OVERDUE_MIN`].
/// It holds two at a time, so a single pause is not enough.
pub(crate) const MISSED_MAX: u32 = 3;
/// A worker whose batch is overdue, and has been out for this long, is on probation too: there may be no other worker
/// to answer the batch.
pub(crate) const SILENT_MAX: Duration = Duration::from_secs(60);
/// Batches with the same indices that are out at a time. As each may take twice as long as the one before, the last
/// is sent after six minutes at the earliest.
pub(crate) const COPIES_MAX: usize = 8;
/// A batch that has taken this many times its expected time is duplicated before anything is computed speculatively.
pub(crate) const LATE_FACTOR: u32 = 2;
/// Pause without work after the first batch that a worker on probation leaves unanswered; each further one doubles it.
pub(crate) const PROBATION_PAUSE_MIN: Duration = Duration::from_secs(3);
/// Longest such pause. Every trial may delay an evaluation by some seconds, but a worker that has recovered should not
/// stay idle for long.
pub(crate) const PROBATION_PAUSE_MAX: Duration = Duration::from_secs(60);
/// Time after which a worker on probation is forgotten if it has missed nothing more.
pub(crate) const PROBATION_MEMORY: Duration = Duration::from_secs(600);

// ---- Lost workers ----

/// Crashes of workers that had answered something before that make a realization poison.
pub(crate) const CRASHES_MAX: usize = 3;
/// Losses of any kind that make a realization poison, so that retries end.
pub(crate) const LOSSES_MAX: usize = 10;
/// Losses of workers of one host in a row after which its workers receive only work that can do little harm if they
/// are lost again.
pub(crate) const LOST_IN_A_ROW_MAX: usize = 3;
/// Time for which the crashes of a host are remembered when no more come.
pub(crate) const CRASH_MEMORY: Duration = Duration::from_secs(600);
/// Attachments of a host in quick succession: as many processes as a large machine has cores may start at the same
/// moment, and once more after a restart of the coordinator.
pub(crate) const ATTACHMENT_BURST: f64 = 512.0;
/// Further attachments of a host per second.
pub(crate) const ATTACHMENTS_PER_SECOND: f64 = 8.0;

// ---- Broken machines ----

/// Hosts that are asked for their votes at most. More than half of so many agree on a wrong answer only if many machines
/// are broken in the same way.
pub(crate) const VOTERS_MAX: usize = 9;
/// Realizations of a proof at most. Many of them show a defect that is seldom seen.
pub(crate) const PROOF_MAX: u64 = 16;
/// A proof has one realization, and one more for each such number of the evaluation's, so that short jobs can pay
/// for the proofs of several hosts: nine hosts and 2,747 realizations spend 3.3 % on them, once for a setup.
pub(crate) const PROOF_DIVISOR: u64 = 300;
/// Setups whose proofs are remembered.
pub(crate) const PROVEN_SETUPS_MAX: usize = 64;
/// Workers of which it is remembered that they gave a proof.
pub(crate) const PROVEN_WORKERS_MAX: usize = 4 * WORKERS_MAX;
/// Time that an audit takes at least on a worker like the one audited, s: a hundred times [`BATCH_COST_S`]. With 1 % of
/// audits each worker is audited once a second in the mean.
pub(crate) const AUDIT_S: f64 = 0.01;
/// Workers that may be lost over one audit before it is given up.
pub(crate) const AUDIT_LOSSES_MAX: u32 = 3;
/// Settled batches that are remembered per worker, to compare late answers with.
pub(crate) const SETTLED_MAX: usize = 16;

// ---- Speculation ----

/// Points of each job at most that are computed before its search asks for one.
pub(crate) const CANDIDATES_MAX: usize = 8;
/// Evaluations with more realizations leave no worker idle for long; none of them is speculative.
pub(crate) const SPECULATIVE_REALIZATIONS_MAX: u64 = 20_000;
/// Idle workers that are looked at after an event at most: a walk over a large fleet would take longer than its
/// speculation is worth.
pub(crate) const IDLE_AT_ONCE: usize = 256;
/// Speculative batches that may be out however soon they are computed: a coordinator of few workers has time for them.
pub(crate) const SPECULATIVE_BATCHES_MIN: usize = 16;

// ---- What is saved of evaluations under way ----

/// Results are saved when they, or their evaluation, are this old.
pub(crate) const SAVE_AFTER: Duration = Duration::from_millis(1500);
/// Interval at which further results of an evaluation are saved.
pub(crate) const SAVE_EVERY: Duration = Duration::from_secs(1);
/// Results of an evaluation that are saved at once at most: nothing else happens while they are copied. The rest follows
/// at the next tick.
pub(crate) const SAVED_AT_ONCE_MAX: u64 = 1 << 18;
/// Results in a piece at most: it may be audited as a whole.
pub(crate) const PIECE_MAX: usize = 4096;
