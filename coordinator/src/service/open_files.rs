//! Limit of open files of this process, and the number of connections that it allows.

use osteon_common::limits::CONNECTIONS_MAX;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use thiserror::Error;

/// Number of open files that are not connections: those of the store, standard streams and the
/// runtime.
const OTHERS: u64 = 32;
/// Fewest connections with which a coordinator is of use: a worker, and clients that come and go.
const CONNECTIONS_MIN: u64 = 4;
/// Open files for each worker of a run on this machine: its connection, its stderr, and its process.
const FILES_OF_WORKER: u64 = 3;

/// This process may not have as many open files as it needs.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "this process may have {limit} open files and needs {needed}: raise the hard limit (`ulimit -n {needed}` \
     as root; LimitNOFILE= of a systemd unit)"
)]
pub struct TooFewOpenFiles {
    /// Maximum number of open files.
    pub limit: u64,
    /// Number that is needed.
    pub needed: u64,
}

/// Makes sure that this process may have the open files of a coordinator and of the `workers` workers that it
/// starts. Without them connections would not be accepted, and nobody would be told why.
///
/// # Errors
/// If the system does not allow as many.
pub fn require_for_run(workers: u32) -> Result<(), TooFewOpenFiles> {
    require(OTHERS + CONNECTIONS_MIN + FILES_OF_WORKER * u64::from(workers))
}

/// Raises this process's limit of open files to the number that all connections need, as far as the
/// system allows, and warns if that is not enough.
///
/// # Errors
/// If it is not enough for any use.
pub fn raise_limit() -> Result<(), TooFewOpenFiles> {
    let wanted = CONNECTIONS_MAX as u64 + OTHERS;
    raise(wanted);
    require(OTHERS + CONNECTIONS_MIN)?;
    let connections = connections_max();
    if connections < CONNECTIONS_MAX {
        tracing::warn!(
            connections,
            of = CONNECTIONS_MAX,
            "fewer connections at a time than usual, for want of open files: raise the limit to \
             {wanted} (`ulimit -Hn`, LimitNOFILE= of a systemd unit)"
        );
    }
    Ok(())
}

/// Raises the limit to a number, as far as the system allows.
fn raise(wanted: u64) {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    if let Some(current) = current.filter(|current| *current < wanted) {
        let raised = maximum.map_or(wanted, |maximum| maximum.min(wanted));
        let limit = Rlimit { current: Some(raised.max(current)), maximum };
        if let Err(error) = setrlimit(Resource::Nofile, limit) {
            tracing::warn!(%error, "cannot raise the limit of open files");
        }
    }
}

fn require(needed: u64) -> Result<(), TooFewOpenFiles> {
    raise(needed);
    match getrlimit(Resource::Nofile).current {
        Some(limit) if limit < needed => Err(TooFewOpenFiles { limit, needed }),
        _ => Ok(()),
    }
}

/// Returns the maximum number of simultaneous connections: others wait until one ends.
pub(crate) fn connections_max() -> usize {
    places(getrlimit(Resource::Nofile).current)
}

/// Returns the number of connections that a limit of open files allows.
fn places(limit: Option<u64>) -> usize {
    let room = limit.map_or(usize::MAX, |limit| {
        usize::try_from(limit.saturating_sub(OTHERS)).unwrap_or(usize::MAX)
    });
    room.clamp(1, CONNECTIONS_MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connections_leave_room_for_other_files() {
        for (limit, expected) in [
            (None, CONNECTIONS_MAX),
            (Some(1 << 20), CONNECTIONS_MAX),
            (Some(64), 32),
            (Some(3), 1),
        ] {
            assert_eq!(places(limit), expected, "{limit:?}");
        }
    }
}
