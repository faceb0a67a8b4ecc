//! Settings of pooling: whether the results of groups inform each other.

use crate::fields::{Fields, Key, Section};

/// The section `[groups]` of a job file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GroupSettings {
    /// Whether the groups share a mean and a scatter.
    pub pooled: bool,
}

impl GroupSettings {
    /// Its section of a job file.
    pub const KEY: Key =
        Key { name: "groups", meaning: "whether the results of the groups of the data are pooled" };
    /// Name of the key that makes groups share a mean and a scatter.
    pub const POOLED: &str = "pooled";
}

impl Section for GroupSettings {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let meaning = "true: after each group has been identified by itself, the groups share a mean and a scatter \
                       of each quantity, so that a group of few velocities learns from the others \
                       ([searches.md](searches.md#groups-that-share-a-mean)); needs at least three groups of five \
                       velocities, or subjects, and derivatives";
        fields.boolean(Key { name: Self::POOLED, meaning }, &mut self.pooled);
    }
}
