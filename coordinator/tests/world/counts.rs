//! Counts of the events that schedules have provoked.

use std::time::Duration;

/// Number of occurrences of each kind of event.
#[derive(Debug, Default)]
pub(crate) struct Counts {
    pub(crate) lost: u64,
    pub(crate) revoked: u64,
    pub(crate) closed: u64,
    pub(crate) late: u64,
    pub(crate) restarts: u64,
    pub(crate) refusals: u64,
    /// Clean stops of the coordinator.
    pub(crate) stops: u64,
    /// Jobs that were cancelled before their end.
    pub(crate) cancelled: u64,
    /// Jobs that failed because two answers differed.
    pub(crate) exposed: u64,
    /// Outages of the store, in which every write failed.
    pub(crate) outages: u64,
    /// Batches all of whose realizations had been answered before.
    pub(crate) checked: u64,
    /// Wrong answers.
    pub(crate) lies: u64,
    /// Hosts banned.
    pub(crate) banned: u64,
    /// Ended jobs that were computed again because of a ban.
    pub(crate) rechecked: u64,
    /// Stored evaluations that were replaced by others.
    pub(crate) replaced: u64,
    /// Stored evaluations that were computed again and found the same.
    pub(crate) confirmed: u64,
    /// Restarts with banned workers in the store.
    pub(crate) remembered: u64,
    /// Jobs that ended correctly although there were wrong answers in them.
    pub(crate) repaired: u64,
    /// Evaluations of other groups and starts that were complete when their search asked for them.
    pub(crate) prepared: u64,
    /// Records of results of incomplete evaluations.
    pub(crate) saved: u64,
    /// Points on the path of a search that were computed speculatively.
    pub(crate) ahead: u64,
    /// Points that were computed speculatively and are not on the path of their search.
    pub(crate) dropped: u64,
    /// Deleted jobs.
    pub(crate) pruned: u64,
    /// Stored evaluations that were damaged.
    pub(crate) damaged: u64,
    /// Pauses of the coordinator.
    pub(crate) pauses: u64,
    /// Losses of workers on a node where they are lost over everything they get.
    pub(crate) bad_deaths: u64,
    /// Batches that a worker with heartbeats never answered.
    pub(crate) ignored: u64,
    /// Longest simulated time of a schedule without a bad node.
    pub(crate) longest: Duration,
}

impl Counts {
    pub(crate) fn add(&mut self, other: &Self) {
        self.lost += other.lost;
        self.revoked += other.revoked;
        self.closed += other.closed;
        self.late += other.late;
        self.restarts += other.restarts;
        self.refusals += other.refusals;
        self.stops += other.stops;
        self.cancelled += other.cancelled;
        self.exposed += other.exposed;
        self.outages += other.outages;
        self.checked += other.checked;
        self.lies += other.lies;
        self.banned += other.banned;
        self.rechecked += other.rechecked;
        self.replaced += other.replaced;
        self.confirmed += other.confirmed;
        self.remembered += other.remembered;
        self.repaired += other.repaired;
        self.prepared += other.prepared;
        self.saved += other.saved;
        self.ahead += other.ahead;
        self.dropped += other.dropped;
        self.pruned += other.pruned;
        self.bad_deaths += other.bad_deaths;
        self.ignored += other.ignored;
        self.longest = self.longest.max(other.longest);
        self.pauses += other.pauses;
        self.damaged += other.damaged;
    }
}
