//! Identifiers, each of its own type so that they cannot be confused.

use std::fmt;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u64);

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

id! {
    /// A job; increases, survives restarts, never used twice in one store.
    JobId
}
id! {
    /// One stay of a worker, that is, one stream; increases, unique within a run of the
    /// coordinator.
    WorkerId
}
id! {
    /// A lease; increases with every attachment.
    LeaseId
}
id! {
    /// A batch; increases, unique within a run of the coordinator.
    BatchId
}
id! {
    /// A request of a client that waits for its reply.
    ReplyId
}

impl JobId {
    /// Parses the identifier of a job from a user's text; `None` if it cannot be one.
    pub fn parse(text: &str) -> Option<Self> {
        text.parse().ok().map(Self)
    }
}
