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
    /// Parses the identifier of a job from a user's text; `None` if it cannot be one. A job has one identifier: with
    /// a sign or with zeros in front it is not that.
    pub fn parse(text: &str) -> Option<Self> {
        let id: u64 = text.parse().ok()?;
        (id.to_string() == text).then_some(Self(id))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_has_one_identifier() {
        for (text, id) in [("1", 1), ("0", 0), ("18446744073709551615", u64::MAX)] {
            assert_eq!(JobId::parse(text), Some(JobId(id)), "{text}");
        }
        for text in ["", "01", "+1", "-1", " 1", "1 ", "1.0", "00", "18446744073709551616", "一"] {
            assert_eq!(JobId::parse(text), None, "{text}");
        }
    }
}
