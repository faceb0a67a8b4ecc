//! Doubts about results: a host that computed a part of an ended job was banned later. Such a job can be
//! computed again without the answers of that host.

use osteon_common::results::Integrity;

use crate::store::DoubtRecord;

/// The doubts about a job.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Doubts {
    /// Numbers of the bans, each with the digest of the result before the job was computed again; `None`
    /// if it was not.
    bans: Vec<(u64, Option<String>)>,
    /// Digest of the result.
    digest: Option<String>,
}

impl Doubts {
    /// Adds what is stored of a doubt.
    pub(crate) fn add(&mut self, record: DoubtRecord) {
        self.bans.retain(|(ban, _)| *ban != record.ban);
        self.bans.push((record.ban, record.digest));
    }

    /// Returns whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.bans.is_empty()
    }

    /// Returns whether the job has not been computed again since a ban.
    pub(crate) fn is_open(&self) -> bool {
        self.bans.iter().any(|(_, before)| before.is_none())
    }

    /// Notes the digest of the result that the job has.
    pub(crate) fn set_digest(&mut self, digest: String) {
        self.digest = Some(digest);
    }

    /// Notes that the job is computed again: open doubts keep the digest of its present result.
    pub(crate) fn reopen(&mut self) {
        let before = self.digest.take().unwrap_or_default();
        for (_, digest) in self.bans.iter_mut().filter(|(_, digest)| digest.is_none()) {
            *digest = Some(before.clone());
        }
    }

    /// Describes the doubts in a sentence; empty if there are none. `host_of` returns the host of a ban.
    pub(crate) fn statement(&self, host_of: impl Fn(u64) -> Option<String>) -> String {
        let digest = self.digest.as_deref().unwrap_or_default();
        self.integrity(host_of).map_or_else(String::new, |it| it.statement(digest))
    }

    /// Returns what a result says about the doubts; `None` if there are none.
    pub(crate) fn integrity(&self, host_of: impl Fn(u64) -> Option<String>) -> Option<Integrity> {
        let (open, settled): (Vec<_>, Vec<_>) =
            self.bans.iter().partition(|(_, before)| before.is_none());
        let concerned = if open.is_empty() { settled } else { open };
        let mut banned_hosts: Vec<String> =
            concerned.iter().filter_map(|(ban, _)| host_of(*ban)).collect();
        banned_hosts.sort_unstable();
        banned_hosts.dedup();
        let (_, earlier_digest) = concerned.last()?;
        Some(Integrity { banned_hosts, earlier_digest: (*earlier_digest).clone() })
    }
}
