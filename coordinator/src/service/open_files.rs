//! Limit of open files of this process, and the number of connections that it allows.

use osteon_common::limits::CONNECTIONS_MAX;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

/// Number of open files that are not connections: those of the store, standard streams and the
/// runtime.
const OTHERS: u64 = 32;

/// Raises this process's limit of open files to the number that all connections need, as far as the
/// system allows, and warns if that is not enough.
pub fn raise_limit() {
    let wanted = CONNECTIONS_MAX as u64 + OTHERS;
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    if let Some(current) = current.filter(|current| *current < wanted) {
        let raised = maximum.map_or(wanted, |maximum| maximum.min(wanted));
        let limit = Rlimit { current: Some(raised.max(current)), maximum };
        if let Err(error) = setrlimit(Resource::Nofile, limit) {
            tracing::warn!(%error, "cannot raise the limit of open files");
        }
    }
    let connections = connections_max();
    if connections < CONNECTIONS_MAX {
        tracing::warn!(
            connections,
            of = CONNECTIONS_MAX,
            "fewer connections at a time than usual, for want of open files: raise the limit to \
             {wanted} (`ulimit -Hn`, LimitNOFILE= of a systemd unit)"
        );
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
