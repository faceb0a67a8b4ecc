//! How the figures of a group are called.

/// Returns the beginning of the names of a group's figures.
pub(crate) fn prefix(group: Option<&str>, set: usize) -> String {
    group.map_or_else(String::new, |_| format!("group-{}-", set + 1))
}

/// Returns the end of the titles of a group's figures.
pub(crate) fn suffix(group: Option<&str>) -> String {
    group.map_or_else(String::new, |name| format!(", group {name}"))
}
