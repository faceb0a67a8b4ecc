//! `[data]`: measured velocities from a CSV file or inline, or their moments.

use std::path::Path;

use crate::check::{self, DATA_FORMS};
use crate::document::Value;
use crate::job::{Data, JobKind};
use crate::reader::{Reader, Table};
use crate::velocities;

const MOMENTS: [&str; 2] = ["mean", "coefficient_of_variation"];

/// The measured data, or `None` with the reason recorded; always `None` for a propagation, whose
/// `[data]` is checked as far as that needs no other file.
pub(super) fn read(
    reader: &mut Reader,
    root: &Table<'_>,
    directory: &Path,
    kind: JobKind,
) -> Option<Data> {
    let table = reader.table(root, "data", &["velocities", MOMENTS[0], MOMENTS[1]]);
    if !table.is_table() {
        if kind == JobKind::Identification && !root.has("data") {
            reader.lacks("data", &["data".to_owned()], check::no_data());
        }
        return None;
    }
    let [has_mean, has_variation] = MOMENTS.map(|key| table.has(key));
    let data = match (table.has("velocities"), has_mean || has_variation) {
        (true, false) => velocities(reader, &table, directory, kind),
        (false, true) => moments(reader, &table),
        (true, true) => {
            reader.violations.add("data", format!("has velocities and moments; {DATA_FORMS}"));
            None
        }
        (false, false) => {
            let cures = ["velocities", MOMENTS[0], MOMENTS[1]].map(|key| table.path(key));
            reader.lacks("data", &cures, format!("has no velocities; {DATA_FORMS}"));
            None
        }
    };
    if kind == JobKind::Identification {
        return data;
    }
    if let Some(data) = data {
        check::data(&data, &mut reader.violations);
    }
    None
}

fn moments(reader: &mut Reader, table: &Table<'_>) -> Option<Data> {
    for key in MOMENTS.into_iter().filter(|key| !table.has(key)) {
        reader.missing(table, key, format_args!("a number above 0; {DATA_FORMS}"));
    }
    let [mean, variation] = MOMENTS.map(|key| reader.number(table, key));
    Some(Data::Moments { mean: mean?, coefficient_of_variation: variation? })
}

fn velocities(
    reader: &mut Reader,
    table: &Table<'_>,
    directory: &Path,
    kind: JobKind,
) -> Option<Data> {
    let path = table.path("velocities");
    match &table.get("velocities")?.value {
        Value::List(elements) => reader.numbers(&path, elements).map(Data::Velocities),
        Value::Text(_) if kind == JobKind::Propagation => None,
        Value::Text(name) => match velocities::read(&directory.join(name)) {
            Ok(velocities) => Some(Data::Velocities(velocities)),
            Err(problems) => {
                for problem in problems {
                    reader.violations.add(&path, problem.to_string());
                }
                None
            }
        },
        other => {
            reader.wrong_type(path, "the name of a CSV file, or a list of numbers (m/s)", other);
            None
        }
    }
}
