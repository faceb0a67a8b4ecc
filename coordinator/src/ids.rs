//! Identifiers, each of its own type so that none is taken for another.

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
    /// A job; grows, survives restarts, never used twice in one store.
    JobId
}
id! {
    /// One stay of a worker, that is one stream; grows, unique for the life of the coordinator.
    WorkerId
}
id! {
    /// A lease; grows with every attachment.
    LeaseId
}
id! {
    /// A batch; grows, unique for the life of the coordinator.
    BatchId
}
id! {
    /// A request that waits for its answer.
    Token
}

impl JobId {
    /// The job that a user's text names, if it can be one.
    pub fn parse(text: &str) -> Option<Self> {
        text.parse().ok().map(Self)
    }
}
