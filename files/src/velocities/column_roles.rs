//! Whether a column seems to hold subjects or groups, judged by its name.

/// Names of columns that seem to name the subject of each velocity.
const LIKE_SUBJECTS: [&str; 7] =
    ["subject", "subject_id", "patient", "patient_id", "specimen", "specimen_id", "id"];
/// Names of columns whose values are groups rather than subjects.
const LIKE_GROUPS: [&str; 10] = [
    "group",
    "cohort",
    "class",
    "site",
    "side",
    "sex",
    "treatment",
    "diagnosis",
    "region",
    "gruppe",
];

/// Returns whether a column seems to name subjects, given its name in lower case.
pub(crate) fn is_like_subject(name: &str) -> bool {
    LIKE_SUBJECTS.contains(&name)
}

/// Returns whether the values of a column seem to be groups, given its name in lower case.
pub(crate) fn is_like_group(name: &str) -> bool {
    LIKE_GROUPS.iter().any(|part| name.contains(part))
}
