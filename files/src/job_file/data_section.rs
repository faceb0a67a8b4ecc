//! `[data]`: measured velocities from a CSV file or inline, in groups or not, or their moments.

use std::path::Path;

use osteon_common::case::Setup;
use osteon_common::check::{self, COUNT, DATA_FORMS};
use osteon_common::data::numbered;
use osteon_common::field_path::entry_path;
use osteon_common::fields::{Key, WholeRange};
use osteon_common::job::{Data, Group, JobKind, Measurements};
use osteon_common::known_quantities::KnownQuantities;
use osteon_common::observables::{Observable, PerObservable};
use osteon_common::origin::Origin;
use osteon_common::parameters::Parameter;

use super::{csv_format, decays, observables};
use crate::document::{Node, Value};
use crate::reader::{Reader, Table};
use crate::velocities::{self, CsvError, CsvFormat, Measured, NamedColumns};

const MOMENTS: [&str; 2] = ["mean", "coefficient_of_variation"];

/// The keys of `[data]` for a file.
const KEYS_OF_A_FILE: [Key; 12] = [
    Key {
        name: "velocities",
        meaning: "for `identify`: path of a CSV file, relative to the job file's directory, with a \
                  header and a column `velocity` in m/s (other columns, and lines that start with \
                  `#`, are ignored), or as the next eight keys say; an Excel workbook (`.xlsx`), a file packed by gzip, \
                  or a MATLAB or HDF5 file; or a list of velocities",
    },
    Key {
        name: "column",
        meaning: "name of the CSV column of velocities (default `\"velocity\"`)",
    },
    Key {
        name: "unit",
        meaning: "unit of the velocities in the file: `\"m/s\"` (default) or `\"km/s\"` or `\"mm/us\"`",
    },
    Key {
        name: "separator",
        meaning: "what separates the fields of the file: `\",\"` (default) or `\";\"` or `\"tab\"` or `\"|\"` or \
                  `\"space\"` (one or more blanks) or `\"spaces\"` (two or more); without the key, a first line \
                  such as `sep=;` is obeyed",
    },
    Key {
        name: "decimal",
        meaning: "the decimal mark of the file's numbers: `\".\"` (default) or `\",\"`; marks of thousands are \
                  read where they are unambiguous",
    },
    Key {
        name: "missing",
        meaning: "texts that stand for a missing value, such as `[\"\", \"NA\", \"-999\"]`, at most 20: a row \
                  with one of them in a column that is used is left out (default: none, every row needs a \
                  velocity)",
    },
    Key {
        name: "encoding",
        meaning: "the encoding of the file, by its name on the web, such as `\"windows-1252\"` or \
                  `\"utf-16le\"` (default: UTF-8, or what a byte order mark says)",
    },
    Key {
        name: "skip_lines",
        meaning: "number of lines above the header that are not looked at, such as an instrument writes them \
                  (default 0)",
    },
    Key {
        name: "header_line",
        meaning: "instead: the line of the header, from 1, whatever stands above it; 0 if there is no header, \
                  and then the columns are named by their numbers: `\"1\"`, `\"2\"`, …",
    },
    Key {
        name: "group",
        meaning: "name of the CSV column that holds the group name (bone, patient, site) of each \
                  velocity, or a list of up to 5 columns, whose names are joined by ` / `; at most 1000 \
                  groups, see [below](#groups-of-velocities)",
    },
    Key {
        name: "subject",
        meaning: "name of the CSV column that holds the subject (patient, specimen) of each velocity: \
                  velocities of one subject are not independent, see [below](#noise-of-the-data); at \
                  least two subjects, in each group",
    },
    Key {
        name: "error_column",
        meaning: "name of the CSV column that holds the standard error of each velocity, at least 0 and in its \
                  unit, as `osteon pick` writes it: their root mean square is the `repeatability`",
    },
];
/// Those for groups.
const KEYS_OF_GROUPS: [Key; 3] = [
    Key {
        name: "known",
        meaning: "quantities of the setup that are known of each group: the names of the CSV columns that \
                  hold their values (SI units, the same in all rows of a group), for any of \
                  `bone_thickness`, `bone_quality_factor`, `coupling_sound_speed`, `porosity`, \
                  `surface_porosity`, `marrow_porosity`; requires `group`, see [below](#groups-of-velocities)",
    },
    Key {
        name: "groups",
        meaning: "instead of a file: a table with a list of velocities for each group name, or with a \
                  table of `velocities`, `subjects`, other observables such as `decays`, and quantities that are \
                  `known` of the group",
    },
    Key {
        name: "subjects",
        meaning: "with a list of velocities: the subject of each, a whole number",
    },
];
/// Those for moments, and for noise.
const KEYS_OF_MOMENTS: [Key; 4] = [
    Key {
        name: MOMENTS[0],
        meaning: "mean of the velocities, m/s, above 0; replaces `data.velocities` and requires \
                  `data.coefficient_of_variation`",
    },
    Key {
        name: MOMENTS[1],
        meaning: "coefficient of variation of the velocities, above 0; required with `data.mean`",
    },
    Key {
        name: "count",
        meaning: "number of independent velocities behind `data.mean` and \
                  `data.coefficient_of_variation`, at least 2; without it their noise is not known",
    },
    Key {
        name: "repeatability",
        meaning: "standard deviation of repeated measurements of one place (m/s, default 0, below the \
                  standard deviation of the velocities): the instrument's own scatter, which is a part \
                  of the data's variance and not of the model's",
    },
];
/// Returns the keys of `[data]`.
pub(super) fn keys() -> Vec<Key> {
    let (columns, lists) = (observables::column_keys(), observables::list_keys());
    let of_velocities: [&[Key]; 3] = [&KEYS_OF_A_FILE, &columns, &KEYS_OF_GROUPS];
    [of_velocities.concat(), [&lists[..], &KEYS_OF_MOMENTS, &decays::KEYS].concat()].concat()
}

/// Largest number that names a subject.
const SUBJECT: WholeRange = WholeRange { min: 0, max: u32::MAX as u64 };

/// Returns the measured data, or `None` after recording the violation, and their file, if any. For
/// a propagation it is always `None`, and `[data]` is checked as far as possible without another
/// file.
pub(super) fn read(
    reader: &mut Reader,
    root: &Table<'_>,
    (directory, setup): (&Path, &Setup),
    kind: JobKind,
) -> (Option<Data>, Option<Origin>) {
    let (mut origin, mut of_errors) = (None, None);
    let mut data = given(reader, root, (kind, setup), |path, named, format| {
        let (measurements, repeatability, stands) =
            from_file(&directory.join(path), named, format)?;
        (origin, of_errors) = (Some(stands), repeatability);
        Ok(measurements)
    });
    if let Some((data, repeatability)) = data.as_mut().zip(of_errors) {
        data.repeatability = repeatability;
    }
    (data, origin)
}

/// Returns the measured data; those in a file are read by `from_file`, given its name, the named
/// columns and how it is written.
fn given(
    reader: &mut Reader,
    root: &Table<'_>,
    (kind, setup): (JobKind, &Setup),
    from_file: impl FnOnce(&str, &NamedColumns<'_>, &CsvFormat) -> Result<Measurements, Vec<CsvError>>,
) -> Option<Data> {
    let table = reader.table(root, "data", &keys().iter().map(|key| key.name).collect::<Vec<_>>());
    if !table.is_table() {
        if kind == JobKind::Identification && !root.has("data") {
            reader.lacks("data", &["data".to_owned()], check::no_data());
        }
        return None;
    }
    let [has_mean, has_variation] = MOMENTS.map(|key| table.has(key));
    let has_moments = has_mean || has_variation;
    unneeded(reader, &table, has_moments);
    let measurements = match (table.has("velocities"), table.has("groups"), has_moments) {
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
    let repeatability = reader.number(&table, "repeatability").unwrap_or(0.0);
    if table.has("repeatability") && table.has("error_column") {
        let message =
            "is the root mean square of the errors in `error_column`, too; leave one of them out";
        reader.violations.add(table.path("repeatability"), message);
    }
    let mut data =
        measurements.map(|measurements| Data { measurements, repeatability, decay_error: 0.0 });
    if let Some(data) = &mut data {
        decays::apply(reader, &table, &setup.probe, data);
    }
    if kind == JobKind::Identification {
        return data;
    }
    if let Some(data) = data {
        check::data(&data, &mut reader.violations);
    }
    None
}

/// Records keys that say nothing about data of this form.
fn unneeded(reader: &mut Reader, table: &Table<'_>, has_moments: bool) {
    let has_velocities = table.has("velocities");
    let of_a_file = OF_A_FILE.iter().map(|(key, _)| *key).chain(FORMAT_KEYS);
    for key in of_a_file.filter(|key| table.has(key)) {
        if !has_velocities {
            let message = "is about the file of velocities, and there is none; give `velocities`";
            reader.lacks(&table.path(key), &[table.path("velocities")], message);
        }
    }
    if table.has("subjects") && !has_velocities {
        let message = "has a subject for each of `velocities`, and there are none";
        reader.lacks(&table.path("subjects"), &[table.path("velocities")], message);
    }
    if !has_velocities {
        observables::unneeded(reader, table);
    }
    if table.has("count") && !has_moments {
        let message = "is the number of velocities behind `mean` and `coefficient_of_variation`, and \
                       they are not given; leave it out";
        reader.lacks(&table.path("count"), &MOMENTS.map(|key| table.path(key)), message);
    }
}

fn moments(reader: &mut Reader, table: &Table<'_>) -> Option<Measurements> {
    for key in MOMENTS.into_iter().filter(|key| !table.has(key)) {
        reader.missing(table, key, format_args!("a number above 0; {DATA_FORMS}"));
    }
    let [mean, variation] = MOMENTS.map(|key| reader.number(table, key));
    let count = reader.whole(table, "count", COUNT);
    Some(Measurements::Moments { mean: mean?, coefficient_of_variation: variation?, count })
}

/// Reads the table `groups`: a list of velocities for each name, or a table.
fn groups(reader: &mut Reader, table: &Table<'_>) -> Option<Measurements> {
    let path = table.path("groups");
    let expected = "a table with a list of velocities (m/s) for each group";
    let value = &table.get("groups")?.value;
    let Value::Table(entries) = value else {
        reader.wrong_type(path, expected, value);
        return None;
    };
    let groups: Vec<Option<Group>> =
        entries.iter().map(|(name, node)| group(reader, &path, name, node)).collect();
    groups.into_iter().collect::<Option<_>>().map(Measurements::Groups)
}

fn group(reader: &mut Reader, groups: &str, name: &str, node: &Node) -> Option<Group> {
    let path = entry_path(groups, name);
    match &node.value {
        Value::List(elements) => Some(Group::new(name, reader.numbers(&path, elements)?)),
        Value::Table(_) => {
            let mut keys = vec!["velocities", "subjects"];
            keys.extend(Observable::ALL.map(|one| one.row().plural));
            keys.extend(Parameter::OF_SETUP.map(Parameter::name));
            let table = reader.table_at(node, path, &keys);
            let expected = "a list of velocities (m/s)";
            if !table.has("velocities") {
                reader.missing(&table, "velocities", expected);
            }
            let elements = reader.list(&table, "velocities", expected);
            let subjects = subjects(reader, &table);
            let observables = observables::lists(reader, &table);
            let known = Parameter::OF_SETUP.map(|one| reader.number(&table, one.name()));
            let known = KnownQuantities::new(known);
            let velocities = reader.numbers(&table.path("velocities"), elements?)?;
            let (name, subjects, observables) = (name.to_owned(), subjects?, observables?);
            Some(Group { name, velocities, subjects, observables, known })
        }
        other => {
            let expected = "a list of velocities (m/s), or a table with velocities, subjects and other observables";
            reader.wrong_type(path, expected, other);
            None
        }
    }
}

/// Reads the list `subjects`, if there is one; `None` if it is wrong.
fn subjects(reader: &mut Reader, table: &Table<'_>) -> Option<Option<Vec<u32>>> {
    if !table.has("subjects") {
        return Some(None);
    }
    let elements =
        reader.list(table, "subjects", "a list with a whole number for each velocity")?;
    let whole = reader.whole_numbers(&table.path("subjects"), elements, SUBJECT)?;
    Some(Some(numbered(whole)))
}

/// Keys that belong to a file of velocities, and what is wrong with each beside a list.
const OF_A_FILE: [(&str, &str); 4] = [
    (
        "group",
        "names a column of a file, but velocities is a list; give the name of a CSV file, or [data.groups]",
    ),
    (
        "known",
        "names columns of a file, but velocities is a list; give the name of a CSV file, or the values in \
         [data.groups]",
    ),
    (
        "subject",
        "names a column of a file, but velocities is a list; give the name of a CSV file, or the list \
         `subjects`",
    ),
    (
        "error_column",
        "names a column of a file, but velocities is a list; give the name of a CSV file, or `repeatability`",
    ),
];
/// Keys that say how a file of velocities is written.
const FORMAT_KEYS: [&str; 8] =
    ["column", "unit", "separator", "decimal", "missing", "encoding", "skip_lines", "header_line"];
/// Keys that belong to a list of velocities, and what is wrong with each beside a file.
const OF_A_LIST: [(&str, &str); 1] = [(
    "subjects",
    "has a subject for each of a list of velocities, but velocities is a file; name its column: \
         subject = \"…\"",
)];

/// Records the first of these keys that is there; returns whether one is.
fn has_misplaced(reader: &mut Reader, table: &Table<'_>, keys: &[(&str, &str)]) -> bool {
    let Some((key, message)) = keys.iter().find(|(key, _)| table.has(key)) else { return false };
    reader.violations.add(table.path(key), *message);
    true
}

fn velocities(
    reader: &mut Reader,
    table: &Table<'_>,
    kind: JobKind,
    from_file: impl FnOnce(&str, &NamedColumns<'_>, &CsvFormat) -> Result<Measurements, Vec<CsvError>>,
) -> Option<Measurements> {
    let path = table.path("velocities");
    let group = group_columns(reader, table);
    let subject = column(reader, table, "subject");
    let error = column(reader, table, "error_column");
    let observables = PerObservable::new(|one| column(reader, table, one.name()));
    let known = known_columns(reader, table);
    let format = csv_format::read(reader, table);
    match &table.get("velocities")?.value {
        Value::List(_) if has_misplaced(reader, table, &OF_A_FILE) => None,
        Value::List(_) if observables::has_column_beside_a_list(reader, table) => None,
        Value::List(_) if FORMAT_KEYS.iter().any(|key| table.has(key)) => {
            for key in FORMAT_KEYS.into_iter().filter(|key| table.has(key)) {
                let message = "says how a file is written, but velocities is a list; leave it out";
                reader.violations.add(table.path(key), message);
            }
            None
        }
        Value::List(elements) => {
            let (subjects, observables) =
                (subjects(reader, table), observables::lists(reader, table));
            let velocities = reader.numbers(&path, elements)?;
            let (subjects, observables) = (subjects?, observables?);
            Some(Measurements::Velocities { velocities, subjects, observables })
        }
        Value::Text(_) if has_misplaced(reader, table, &OF_A_LIST) => None,
        Value::Text(_) if observables::has_list_beside_a_file(reader, table) => None,
        Value::Text(_) if table.has("known") && !table.has("group") => {
            let message = "has a value for each group, and there are no groups; name their column: group = \
                           \"…\"";
            reader.lacks(&table.path("known"), &[table.path("group")], message);
            None
        }
        Value::Text(_) if kind == JobKind::Propagation => None,
        Value::Text(name) => {
            let named = NamedColumns { group: group?, subject, error, observables, known };
            let data = from_file(name, &named, &format?);
            data.map_err(|problems| record(reader, &path, &problems)).ok()
        }
        other => {
            reader.wrong_type(path, "the name of a CSV file, or a list of numbers (m/s)", other);
            None
        }
    }
}

fn record(reader: &mut Reader, path: &str, problems: &[CsvError]) {
    for problem in problems {
        if problem.stands_for_more() {
            reader.violations.add_more(path, problem.to_string());
        } else {
            reader.violations.add(path, problem.to_string());
        }
    }
}

/// Maximum number of columns that name a group together.
pub(super) const GROUP_COLUMNS_MAX: usize = 5;

/// Returns the columns of the groups' names; `None` if the key is wrong.
fn group_columns<'a>(reader: &mut Reader, table: &Table<'a>) -> Option<Vec<&'a str>> {
    let Some(node) = table.get("group") else { return Some(Vec::new()) };
    let expected = "the name of a column of the file of velocities, or a list of 1 to 5 of them";
    match &node.value {
        Value::Text(column) => Some(vec![column]),
        Value::List(columns) if (1..=GROUP_COLUMNS_MAX).contains(&columns.len()) => {
            reader.texts(&table.path("group"), columns)
        }
        other => {
            reader.wrong_type(table.path("group"), expected, other);
            None
        }
    }
}

/// Returns the columns of quantities that are known of each group, in the order of
/// [`Parameter::OF_SETUP`].
fn known_columns<'a>(
    reader: &mut Reader,
    table: &Table<'a>,
) -> [Option<&'a str>; Parameter::OF_SETUP.len()] {
    let known = reader.table(table, "known", &Parameter::OF_SETUP.map(Parameter::name));
    Parameter::OF_SETUP.map(|parameter| column(reader, &known, parameter.name()))
}

/// Returns the name of a column.
fn column<'a>(reader: &mut Reader, table: &Table<'a>, key: &str) -> Option<&'a str> {
    match &table.get(key)?.value {
        Value::Text(column) => Some(column),
        other => {
            let expected = "the name of a column of the file of velocities";
            reader.wrong_type(table.path(key), expected, other);
            None
        }
    }
}

fn from_file(
    path: &Path,
    named: &NamedColumns<'_>,
    format: &CsvFormat,
) -> Result<(Measurements, Option<f64>, Origin), Vec<CsvError>> {
    let Measured { data: mut groups, repeatability, origin, .. } =
        velocities::read(path, named, format)?;
    let measurements = match (named.group.is_empty(), groups.pop()) {
        // Without a column of groups all velocities are in one.
        (true, Some(Group { velocities, subjects, observables, .. })) => {
            Measurements::Velocities { velocities, subjects, observables }
        }
        (_, last) => {
            groups.extend(last);
            Measurements::Groups(groups)
        }
    };
    Ok((measurements, repeatability, origin))
}
