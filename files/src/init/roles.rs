//! Which columns hold groups and subjects.

use std::collections::BTreeSet;

use osteon_common::limits;

use crate::velocities::{NamedColumns, VelocityTable, is_like_group, is_like_subject};

/// Fewest velocities of a group, on average, for a search of its own.
const OF_A_GROUP_MIN: usize = 5;
/// The columns of groups, subjects and standard errors, if there are any.
#[derive(Debug)]
pub(super) struct Roles {
    pub(super) group: Option<NameColumn>,
    pub(super) subject: Option<NameColumn>,
    /// Name of the column of standard errors.
    pub(super) error: Option<String>,
}

/// A column of names that repeat.
#[derive(Debug, Clone)]
pub(super) struct NameColumn {
    pub(super) name: String,
    /// Number of different names.
    different: usize,
    /// Number of rows with a velocity.
    rows: usize,
    /// Whether its name is one of groups.
    is_group: bool,
}

impl Roles {
    /// Returns the columns' roles.
    pub(super) fn from_table(table: &VelocityTable) -> Self {
        let columns = named_columns(table);
        let first = |is_group| columns.iter().find(|column| column.is_group == is_group).cloned();
        let (group, subject) = match (first(true), first(false)) {
            // The velocities of a subject are a set of their own if there are enough.
            (None, Some(subject)) if subject.rows >= OF_A_GROUP_MIN * subject.different => {
                (Some(subject), None)
            }
            both => both,
        };
        Self { group, subject, error: error_column(table) }
    }

    /// Returns the columns as a job names them.
    pub(super) fn named(&self) -> NamedColumns<'_> {
        NamedColumns {
            group: self.group.iter().map(|column| column.name.as_str()).collect(),
            subject: self.subject.as_ref().map(|column| column.name.as_str()),
            error: self.error.as_deref(),
            ..NamedColumns::default()
        }
    }

    /// Says what was found.
    pub(super) fn described(&self) -> Vec<String> {
        let mut said = Vec::new();
        if let Some(NameColumn { name, different, .. }) = &self.group {
            said.push(format!("{different} groups in the column {name:?}: a search for each"));
        }
        if let Some(NameColumn { name, different, .. }) = &self.subject {
            said.push(format!(
                "{different} subjects in the column {name:?}, with several velocities each: their noise is \
                 that of whole subjects"
            ));
        }
        if let Some(name) = &self.error {
            said.push(format!(
                "standard errors in the column {name:?}: their part of the scatter is not that of the bones"
            ));
        }
        said
    }
}

/// Returns the name of the only column of standard errors.
fn error_column(table: &VelocityTable) -> Option<String> {
    let is_one = |name: &&String| name.to_lowercase().replace('_', " ") == "standard error";
    let mut found = table.names().iter().filter(is_one);
    found.next().filter(|_| found.next().is_none()).cloned()
}

/// Returns the columns that have names which repeat, and seem to name groups or subjects.
fn named_columns(table: &VelocityTable) -> Vec<NameColumn> {
    let mut columns: Vec<(usize, bool, BTreeSet<String>)> = Vec::new();
    for (place, name) in table.names().iter().enumerate() {
        let lower = name.to_lowercase();
        let is_once = table.names().iter().filter(|other| *other == name).count() == 1;
        if place != table.place() && is_once && (is_like_group(&lower) || is_like_subject(&lower)) {
            columns.push((place, is_like_group(&lower), BTreeSet::new()));
        }
    }
    let mut rows = 0;
    for mut row in table.rows() {
        let is_missing = row.get(table.place()).is_none_or(|cell| table.missing().contains(cell));
        // A row without a velocity is left out, and may have no name.
        if is_missing {
            continue;
        }
        rows += 1;
        for (place, _, names) in &mut columns {
            if names.len() <= limits::GROUPS_MAX {
                names.insert(row.get_mut(*place).map(std::mem::take).unwrap_or_default());
            }
        }
    }
    let column = |(place, is_group, different): (usize, bool, BTreeSet<String>)| {
        let repeats = different.len() < rows && different.len() > 1;
        let is_named = !different.contains("") && different.len() <= limits::GROUPS_MAX;
        (repeats && is_named).then(|| NameColumn {
            name: table.names()[place].clone(),
            different: different.len(),
            rows,
            is_group,
        })
    };
    columns.into_iter().filter_map(column).collect()
}
