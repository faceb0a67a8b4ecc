//! Explains in a sentence or two what decides how fast a job is, and what would make it faster.
//!
//! `facts.rs` collects from the state what matters; what follows from that is decided here, by a
//! function of these facts alone.

pub(crate) mod facts;

use std::time::Duration;

use osteon_proto::v1::{ExplainResponse, PaceReason};

use self::facts::{JobFacts, OldestBatch, Standing};

/// A record that has been on its way to the store for this long delays its job.
const STORE_SLOW: Duration = Duration::from_secs(1);
/// An answer that has been outstanding for this long, while nothing else of an evaluation is left,
/// delays its job.
const ANSWER_SLOW: Duration = Duration::from_secs(1);

/// Returns the explanation of these facts.
pub(crate) fn explanation(facts: &JobFacts) -> ExplainResponse {
    let reason = reason(facts);
    let waits_for_worker = reason == PaceReason::LastRealizations;
    let computes = !matches!(reason, PaceReason::Ended | PaceReason::WaitingForTurn);
    ExplainResponse {
        job: facts.job.to_string(),
        reason: reason.into(),
        text: text(reason, facts),
        slots: facts.slots,
        slots_used: facts.slots_used,
        realizations: facts.realizations,
        realizations_left: if computes { facts.lacking_realizations() } else { 0 },
        realizations_per_second: facts.rate,
        expected_s: expected_time(reason, facts).map(|time| time.as_secs_f64()),
        waiting_s: waiting_time(reason, facts).map(|time| time.as_secs_f64()),
        worker: facts.oldest.as_ref().filter(|_| waits_for_worker).map(|oldest| oldest.worker.0),
    }
}

/// Decides what delays a job most: what stops it altogether comes first.
fn reason(facts: &JobFacts) -> PaceReason {
    match facts.standing {
        Standing::Ended { .. } => return PaceReason::Ended,
        _ if facts.refusal.is_some() => return PaceReason::StoreRefuses,
        _ if facts.stopping => return PaceReason::Stopping,
        Standing::Waiting => return PaceReason::WaitingForTurn,
        Standing::Reading { .. } => return PaceReason::ReadingStore,
        Standing::Storing if facts.unanswered >= STORE_SLOW => return PaceReason::StoreSlow,
        Standing::Storing | Standing::Computing => {}
    }
    let last = facts.oldest.as_ref().is_some_and(|oldest| oldest.out >= ANSWER_SLOW);
    if facts.workers == 0 {
        PaceReason::NoWorkers
    } else if facts.disputed.is_some() {
        PaceReason::Dispute
    } else if facts.quarantined > 0 && facts.reliable == 0 {
        PaceReason::UnreliableWorkers
    } else if facts.slots == 0 {
        PaceReason::WorkersUnavailable
    } else if facts.queued == 0 && last {
        PaceReason::LastRealizations
    } else if facts.slots_of_others > facts.slots_used {
        PaceReason::OtherJobs
    } else if facts.realizations.saturating_mul(facts.parts_left) < facts.slots {
        PaceReason::FewRealizations
    } else {
        PaceReason::Computing
    }
}

/// Returns the expected time of the evaluation under way.
fn expected_time(reason: PaceReason, facts: &JobFacts) -> Option<Duration> {
    let runs = matches!(facts.standing, Standing::Computing)
        && matches!(
            reason,
            PaceReason::OtherJobs | PaceReason::FewRealizations | PaceReason::Computing
        );
    // A rate may be tiny; what does not fit into a duration is not foreseeable.
    let seconds = facts.lacking_realizations() as f64 / facts.rate;
    (runs && facts.rate > 0.0).then(|| Duration::try_from_secs_f64(seconds).ok()).flatten()
}

/// Returns for how long a job has been waiting for what delays it.
fn waiting_time(reason: PaceReason, facts: &JobFacts) -> Option<Duration> {
    match reason {
        PaceReason::StoreRefuses => facts.refusal.as_ref().map(|(_, since)| *since),
        PaceReason::WaitingForTurn | PaceReason::StoreSlow => Some(facts.unanswered),
        PaceReason::NoWorkers => Some(facts.without_workers),
        PaceReason::Dispute => facts.disputed,
        PaceReason::LastRealizations => facts.oldest.as_ref().map(|oldest| oldest.out),
        _ => None,
    }
}

fn text(reason: PaceReason, facts: &JobFacts) -> String {
    let since = waiting_time(reason, facts)
        .map_or_else(String::new, |time| format!("{} s", time.as_secs()));
    match reason {
        PaceReason::Unspecified => String::new(),
        PaceReason::Ended => match &facts.standing {
            Standing::Ended { status, reason } if reason.is_empty() => {
                format!("It has ended: {status}.")
            }
            Standing::Ended { status, reason } => format!("It has ended: {status}; {reason}"),
            _ => String::new(),
        },
        PaceReason::StoreRefuses => format!(
            "The store has refused a record for {since}: {}. The job continues when the store accepts \
             it; make room on its disk, or repair it.",
            facts.refusal.as_ref().map_or("", |(error, _)| error)
        ),
        PaceReason::Stopping => "The coordinator is shutting down. The next one on the same store \
            continues the job."
            .to_owned(),
        PaceReason::WaitingForTurn => format!(
            "It has been waiting for its turn for {since}, with {} running and {} waiting. Jobs of users \
             with the fewest running jobs begin first, of these the highest priority, then the oldest.",
            jobs(facts.running),
            facts.waiting
        ),
        PaceReason::ReadingStore => match facts.standing {
            Standing::Reading { read, stored } => format!(
                "Its stored evaluations are read again, {read} of {stored} so far; then it continues."
            ),
            _ => String::new(),
        },
        PaceReason::StoreSlow => format!(
            "A record has been on its way to the store for {since}; the search waits for it. Put the \
             store on a faster disk, a local one."
        ),
        PaceReason::NoWorkers => format!("No worker has been attached for {since}. Start workers."),
        PaceReason::Dispute => format!(
            "Two workers answered differently {since} ago, and it waits for a third one to decide. Start \
             another worker if none is free."
        ),
        PaceReason::UnreliableWorkers => format!(
            "{} over which workers were lost wait for a reliable worker, and the attached ones are not: \
             workers of their hosts were lost, or they do not answer. Start a worker on another host.",
            realizations(facts.quarantined)
        ),
        PaceReason::WorkersUnavailable => unavailable(facts),
        PaceReason::LastRealizations => facts
            .oldest
            .as_ref()
            .map_or_else(String::new, |oldest| explain_last_batches(facts, oldest)),
        PaceReason::OtherJobs => others(facts),
        PaceReason::FewRealizations => explain_few_realizations(facts),
        PaceReason::Computing => {
            format!("{} More workers make it faster.", describe_speed(reason, facts))
        }
    }
}

fn unavailable(facts: &JobFacts) -> String {
    let parts = [
        (facts.draining, "drains", "drain"),
        (facts.on_probation, "is on probation", "are on probation"),
    ];
    let parts = parts
        .into_iter()
        .filter(|(count, ..)| *count > 0)
        .map(|(count, one, many)| format!("{count} {}", if count == 1 { one } else { many }));
    format!(
        "None of the attached workers takes batches: of {}, {}. Workers on probation took batches and \
         did not answer them. Start other workers.",
        facts.workers,
        parts.collect::<Vec<_>>().join(" and ")
    )
}

fn explain_last_batches(facts: &JobFacts, oldest: &OldestBatch) -> String {
    let instead = match oldest.duplicates {
        0 if oldest.overdue => " No other worker is free to compute the same.",
        0 => "",
        1 => " Another worker computes the same; the first answer counts.",
        _ => " Others compute the same; the first answer counts.",
    };
    format!(
        "The evaluation lacks {} of {} realizations, and all are out: {} has been computing {} of them for \
         {} s.{instead}",
        facts.lacking_realizations(),
        facts.realizations,
        oldest.name,
        oldest.count,
        oldest.out.as_secs()
    )
}

fn others(facts: &JobFacts) -> String {
    let why = if facts.higher > 0 {
        let (have, are) = if facts.higher == 1 { ("has", "is") } else { ("have", "are") };
        let higher = jobs(facts.higher);
        format!("{higher} of the same user {have} a higher priority and {are} served first.")
    } else if facts.other_clients > 0 {
        format!(
            "Users share the workers evenly by computing time, and {} other user{} running jobs.",
            facts.other_clients,
            if facts.other_clients == 1 { " has" } else { "s have" }
        )
    } else {
        "Other jobs of the same user take turns with it.".to_owned()
    };
    format!(
        "{} Other jobs use {:.0} slots. {why}",
        describe_speed(PaceReason::OtherJobs, facts),
        facts.slots_of_others
    )
}

fn explain_few_realizations(facts: &JobFacts) -> String {
    let speed = describe_speed(PaceReason::FewRealizations, facts);
    if facts.is_search {
        format!(
            "{speed} A search evaluates one point after another, with {} each, fewer than slots: more workers \
             do not make it faster. Idle slots compute points that it may ask for next.",
            realizations(facts.realizations)
        )
    } else {
        format!(
            "{speed} It has {}, fewer than slots: more workers do not make it faster.",
            realizations(facts.realizations)
        )
    }
}

/// Describes at which speed a job runs.
fn describe_speed(reason: PaceReason, facts: &JobFacts) -> String {
    let left = expected_time(reason, facts).map_or_else(String::new, |time| {
        let needs = match time.as_secs_f64() {
            ..0.1 => "less than 0.1".to_owned(),
            seconds => format!("about {seconds:.1}"),
        };
        format!("; the evaluation under way needs {needs} s more")
    });
    let rate = if facts.rate > 0.0 {
        format!("{:.0} realizations per second{left}", facts.rate)
    } else {
        "nothing has been answered lately".to_owned()
    };
    match facts.standing {
        // Its slots are free for a moment.
        Standing::Storing => format!("An evaluation is being stored; {rate}."),
        _ => format!("It runs on {:.0} of {} slots: {rate}.", facts.slots_used, facts.slots),
    }
}

fn jobs(count: u64) -> String {
    if count == 1 { "1 job".to_owned() } else { format!("{count} jobs") }
}

fn realizations(count: u64) -> String {
    if count == 1 { "1 realization".to_owned() } else { format!("{count} realizations") }
}

#[cfg(test)]
mod tests;
