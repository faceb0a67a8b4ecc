//! What both benchmark programs measure with.

pub(crate) mod draws;
pub(crate) mod machine;
pub(crate) mod peak;
