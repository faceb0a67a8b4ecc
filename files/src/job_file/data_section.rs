//! `[data]`: measured velocities from a CSV file or inline, in groups or not, or their moments.

use std::path::Path;

use osteon_common::check::{self, DATA_FORMS};
use osteon_common::field_path::entry_path;
use osteon_common::fields::Key;
use osteon_common::job::{Data, Group, JobKind};
use osteon_common::origin::Origin;

use crate::document::Value;
use crate::reader::{Reader, Table};
use crate::velocities::{self, Measured};

const MOMENTS: [&str; 2] = ["mean", "coefficient_of_variation"];

/// The keys of `[data]`.
pub(super) const KEYS: [Key; 5] = [
    Key {
        name: "velocities",
        meaning: "for `identify`: path of a CSV file, relative to the job file's directory, with a \
                  header and a column `velocity` in m/s (other columns, and lines that start with \
                  `#`, are ignored); or a list of velocities",
    },
    Key {
        name: "group",
        meaning: "name of the CSV column that holds the group name (bone, patient, site) of each \
                  velocity; at most 1000 groups, see [below](#groups-of-velocities)",
    },
    Key {
        name: "groups",
        meaning: "instead of a file: a table with a list of velocities for each group name",
    },
    Key {
        name: MOMENTS[0],
        meaning: "mean of the velocities, m/s, above 0; replaces `data.velocities` and requires \
                  `data.coefficient_of_variation`",
    },
    Key {
        name: MOMENTS[1],
        meaning: "coefficient of variation of the velocities, above 0; required with `data.mean`",
    },
];

/// Returns the measured data, or `None` after recording the violation, and their file, if any. For
/// a propagation it is always `None`, and `[data]` is checked as far as possible without another
/// file.
pub(super) fn read(
    reader: &mut Reader,
    root: &Table<'_>,
    directory: &Path,
    kind: JobKind,
) -> (Option<Data>, Option<Origin>) {
    let mut origin = None;
    let data = given(reader, root, kind, |path, column| {
        let (data, stands) = from_file(&directory.join(path), column)?;
        origin = Some(stands);
        Ok(data)
    });
    (data, origin)
}

/// Returns the measured data; those in a file are read by `from_file`, given its name and the
/// column of groups.
fn given(
    reader: &mut Reader,
    root: &Table<'_>,
    kind: JobKind,
    from_file: impl FnOnce(&str, Option<&str>) -> Result<Data, Vec<velocities::CsvError>>,
) -> Option<Data> {
    let table = reader.table(root, "data", &KEYS.map(|key| key.name));
    if !table.is_table() {
        if kind == JobKind::Identification && !root.has("data") {
            reader.lacks("data", &["data".to_owned()], check::no_data());
        }
        return None;
    }
    let [has_mean, has_variation] = MOMENTS.map(|key| table.has(key));
    let has_moments = has_mean || has_variation;
    if table.has("group") && !table.has("velocities") {
        let message =
            "names a column of the file of velocities, and there is none; give `velocities`";
        reader.lacks(&table.path("group"), &[table.path("velocities")], message);
    }
    let data = match (table.has("velocities"), table.has("groups"), has_moments) {
        (true, false, false) => velocities(reader, &table, kind, from_file),
        (false, true, false) => groups(reader, &table),
        (false, false, true) => moments(reader, &table),
        (false, false, false) => {
            let cures = ["velocities", "groups", MOMENTS[0], MOMENTS[1]];
            let cures = cures.map(|key| table.path(key));
            reader.lacks("data", &cures, format!("has no velocities; {DATA_FORMS}"));
            None
        }
        (velocities, groups, _) => {
            let both = match (velocities, groups) {
                (true, true) => "velocities and groups",
                (true, false) => "velocities and moments",
                _ => "groups and moments",
            };
            reader.violations.add("data", format!("has {both}; {DATA_FORMS}"));
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

/// Reads the table `groups`: a list of velocities for each name.
fn groups(reader: &mut Reader, table: &Table<'_>) -> Option<Data> {
    let path = table.path("groups");
    let expected = "a table with a list of velocities (m/s) for each group";
    let value = &table.get("groups")?.value;
    let Value::Table(entries) = value else {
        reader.wrong_type(path, expected, value);
        return None;
    };
    let mut groups = Vec::new();
    let mut complete = true;
    for (name, node) in entries {
        let path = entry_path(&path, name);
        let velocities = match &node.value {
            Value::List(elements) => reader.numbers(&path, elements),
            other => {
                reader.wrong_type(path, "a list of velocities (m/s)", other);
                None
            }
        };
        complete &= velocities.is_some();
        if let Some(velocities) = velocities {
            groups.push(Group { name: name.clone(), velocities });
        }
    }
    complete.then_some(Data::Groups(groups))
}

fn velocities(
    reader: &mut Reader,
    table: &Table<'_>,
    kind: JobKind,
    from_file: impl FnOnce(&str, Option<&str>) -> Result<Data, Vec<velocities::CsvError>>,
) -> Option<Data> {
    let path = table.path("velocities");
    let column = column(reader, table);
    match &table.get("velocities")?.value {
        Value::List(_) if table.has("group") => {
            let message = "names a column of a file, but velocities is a list; \
                           give the name of a CSV file, or [data.groups]";
            reader.violations.add(table.path("group"), message);
            None
        }
        Value::List(elements) => reader.numbers(&path, elements).map(Data::Velocities),
        Value::Text(_) if kind == JobKind::Propagation => None,
        Value::Text(name) => match from_file(name, column) {
            Ok(data) => Some(data),
            Err(problems) => {
                for problem in problems {
                    if problem.stands_for_more() {
                        reader.violations.add_more(&path, problem.to_string());
                    } else {
                        reader.violations.add(&path, problem.to_string());
                    }
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

/// Returns the name of the column of groups.
fn column<'a>(reader: &mut Reader, table: &Table<'a>) -> Option<&'a str> {
    match &table.get("group")?.value {
        Value::Text(column) => Some(column),
        other => {
            let expected = "the name of a column of the file of velocities";
            reader.wrong_type(table.path("group"), expected, other);
            None
        }
    }
}

fn from_file(
    path: &Path,
    column: Option<&str>,
) -> Result<(Data, Origin), Vec<velocities::CsvError>> {
    Ok(match column {
        Some(column) => {
            let Measured { data, origin } = velocities::read_groups(path, column)?;
            (Data::Groups(data), origin)
        }
        None => {
            let Measured { data, origin } = velocities::read(path)?;
            (Data::Velocities(data), origin)
        }
    })
}
