//! The keys of `[data]` for observables besides the velocity: the name of a column of each, or a list.

use osteon_common::fields::Key;
use osteon_common::observables::{Observable, PerObservable};

use crate::reader::{Reader, Table};

/// Returns the keys that name the column of each observable.
pub(super) fn column_keys() -> [Key; Observable::ALL.len()] {
    Observable::ALL.map(|one| Key { name: one.name(), meaning: one.row().of_column })
}

/// Returns the keys that list the values of each observable.
pub(super) fn list_keys() -> [Key; Observable::ALL.len()] {
    Observable::ALL.map(|one| Key { name: one.row().plural, meaning: one.row().of_list })
}

/// Reads the lists of observables that there are; `None` if one is wrong.
pub(super) fn lists(
    reader: &mut Reader,
    table: &Table<'_>,
) -> Option<PerObservable<Option<Vec<f64>>>> {
    let mut is_wrong = false;
    let lists = PerObservable::new(|one| {
        let key = one.row().plural;
        if !table.has(key) {
            return None;
        }
        let expected = format!("a list with a number ({}) for each velocity", one.row().unit);
        let elements = reader.list(table, key, &expected);
        let numbers = elements.and_then(|elements| reader.numbers(&table.path(key), elements));
        is_wrong |= numbers.is_none();
        numbers
    });
    (!is_wrong).then_some(lists)
}

/// Records the first key that names a column beside a list of velocities; returns whether there is one.
pub(super) fn has_column_beside_a_list(reader: &mut Reader, table: &Table<'_>) -> bool {
    has_misplaced(reader, table, |one| {
        let message = format!(
            "names a column of a file, but velocities is a list; give the name of a CSV file, or the list \
             `{}`",
            one.row().plural
        );
        (one.name(), message)
    })
}

/// Records the first list beside a file of velocities; returns whether there is one.
pub(super) fn has_list_beside_a_file(reader: &mut Reader, table: &Table<'_>) -> bool {
    has_misplaced(reader, table, |one| {
        let message = format!(
            "has a value for each of a list of velocities, but velocities is a file; name its column: {} = \
             \"…\"",
            one.name()
        );
        (one.row().plural, message)
    })
}

fn has_misplaced(
    reader: &mut Reader,
    table: &Table<'_>,
    key_and_message: impl Fn(Observable) -> (&'static str, String),
) -> bool {
    let mut misplaced = Observable::ALL.into_iter().map(key_and_message);
    let Some((key, message)) = misplaced.find(|(key, _)| table.has(key)) else { return false };
    reader.violations.add(table.path(key), message);
    true
}

/// Records the keys that say nothing without velocities.
pub(super) fn unneeded(reader: &mut Reader, table: &Table<'_>) {
    for one in Observable::ALL {
        let about_a_file = "is about the file of velocities, and there is none; give `velocities`";
        let of_each = "has a value for each of `velocities`, and there are none";
        for (key, message) in [(one.name(), about_a_file), (one.row().plural, of_each)] {
            if table.has(key) {
                reader.lacks(&table.path(key), &[table.path("velocities")], message);
            }
        }
    }
}
