//! Case files: one deterministic problem, in TOML or JSON.

mod porosity;

use std::path::Path;

use osteon_common::case::{Bone, Case};
use osteon_common::check;
use osteon_common::elasticity::{Elasticity, EngineeringConstants};
use osteon_common::field_path::element_path;
use osteon_common::limits;
use osteon_common::parameters::Parameter;
use osteon_common::plausible::PlausibleRange;
use osteon_common::porosity::{POROSITY, PorosityModel};

use crate::document::{Format, Node, Value};
use crate::document_text::DocumentText;
use crate::file_error::{Bound, ContentError, FileError, Invalid};
use crate::input_file::InputFile;
use crate::job_file;
use crate::materials::{self, Base};
use crate::reader::{Reader, Table};
use crate::setting::Setting;

pub use crate::toml_text::case as to_toml;

/// The five engineering constants as keys of `[bone]`.
const CONSTANTS: [Parameter; 5] = [
    Parameter::LongitudinalYoungModulus,
    Parameter::LongitudinalPoissonRatio,
    Parameter::LongitudinalShearModulus,
    Parameter::TransverseYoungModulus,
    Parameter::TransversePoissonRatio,
];

/// Limit of a case file's length; one with a matrix and all keys has a few kilobytes.
const BOUND: Bound = Bound { bytes: limits::CASE_FILE_BYTES_MAX, purpose: "any case file needs" };

/// Reads the case file at `path`, or standard input if that is `-`, with `settings` that replace values
/// of it; its extension determines the format.
///
/// # Errors
/// If the file cannot be read.
pub fn open(path: &Path, settings: Vec<Setting>) -> Result<InputFile, FileError> {
    InputFile::open(path, BOUND, settings)
}

/// Reads and validates the case file at `path`; its extension determines the format.
///
/// # Errors
/// If the file cannot be read, is malformed, or violates a rule; all violations are reported at
/// once.
pub fn read(path: &Path) -> Result<Case, FileError> {
    of_input(&open(path, Vec::new())?)
}

/// Validates a case file that has been opened.
///
/// # Errors
/// If it is malformed, or violates a rule; all violations are reported at once.
pub fn of_input(input: &InputFile) -> Result<Case, FileError> {
    let path = input.path().to_owned();
    let document = input.document();
    match document.tree() {
        Ok(root) if root.has("parameters") && !root.has("bone") => {
            Err(FileError::JobForCase { path })
        }
        Ok(root) => of_tree(document, &root)
            .map_err(|invalid| FileError::Content { path, content: invalid.into() }),
        Err(error) => Err(FileError::Content { path, content: error.into() }),
    }
}

/// Reads and validates the text of a case file.
///
/// # Errors
/// If the text is malformed or violates a rule; all violations are reported at once.
pub fn parse(text: &str, format: Format) -> Result<Case, ContentError> {
    let document = DocumentText::new(text, format);
    Ok(of_tree(document, &document.tree()?)?)
}

fn of_tree(document: DocumentText<'_>, root: &Node) -> Result<Case, Invalid> {
    let mut reader = Reader::default();
    let keys = ["layers", "probe", "picking", "solver", "bone"];
    let table = reader.root(root, &keys);
    if !table.is_table() {
        return Err(reader.refuse(document, root));
    }
    let setup = job_file::setup(&mut reader, &table);
    let bone = bone(&mut reader, &table);
    check::setup(&setup, &mut reader.violations);
    match bone {
        Some(bone) if reader.violations.is_empty() => Ok(Case { setup, bone }),
        _ => Err(reader.refuse(document, root)),
    }
}

/// Returns the bone, or `None` after recording the violations.
fn bone(reader: &mut Reader, root: &Table<'_>) -> Option<Bone> {
    let mut keys = vec![materials::KEY, Parameter::Density.name(), "mandel"];
    keys.extend(CONSTANTS.map(Parameter::name));
    keys.extend([POROSITY.name, PorosityModel::KEY.name]);
    let table = reader.table(root, "bone", &keys);
    if !table.is_table() {
        if !root.has("bone") {
            let message = format!(
                "is missing; it must have a material, or density and {FORMS}, or a porosity"
            );
            reader.lacks("bone", &["bone".to_owned()], message);
        }
        return None;
    }
    let model = porosity::model(reader, &table);
    let model_path = table.path(PorosityModel::KEY.name);
    if table.has(PorosityModel::KEY.name) && !table.has(POROSITY.name) {
        let cures = [table.path(POROSITY.name)];
        let message = "is given without a porosity; give bone.porosity, or leave it out";
        reader.lacks(&model_path, &cures, message);
        return None;
    }
    solid(reader, &table, &model, &model_path)
}

/// Returns the bone that the keys of `table` describe, or `None` after recording the violations. The model
/// of a porosity is the table at `model_path`.
fn solid(
    reader: &mut Reader,
    table: &Table<'_>,
    model: &PorosityModel,
    model_path: &str,
) -> Option<Bone> {
    if table.has(POROSITY.name) {
        return porosity::bone(reader, table, model, model_path);
    }
    let base = Base::read(reader, table);
    let named = table.has(materials::KEY).then_some(materials::KEY);
    let given =
        named.or_else(|| CONSTANTS.map(Parameter::name).into_iter().find(|key| table.has(key)));
    // Matrices are written by programs and may have any scale; constants are typed by people, so
    // their unit is checked.
    let density = required(reader, table, Parameter::Density, base, given.is_some());
    let elasticity = match (table.has("mandel"), given) {
        (true, None) => mandel(reader, table),
        (true, Some(other)) => {
            let cure = match other {
                materials::KEY => "leave one of them out".to_owned(),
                _ => format!("give {FORMS}, not both"),
            };
            reader
                .violations
                .add(table.path("mandel"), format!("is given together with {other}; {cure}"));
            None
        }
        (false, None) => {
            let others = ["mandel", materials::KEY, POROSITY.name];
            let cures = [&others[..], &CONSTANTS.map(Parameter::name)].concat();
            let cures: Vec<_> = cures.into_iter().map(|key| table.path(key)).collect();
            let message =
                format!("has no elasticity; give {FORMS}, or name a material, or give a porosity");
            reader.lacks("bone", &cures, message);
            None
        }
        (false, Some(_)) => from_constants(reader, table, base),
    };
    Some(Bone { density: density?, elasticity: elasticity? })
}

/// The forms in which an elasticity may be given.
const FORMS: &str = "either the five engineering constants or mandel";

/// Reads a number of `[bone]`, which only a material can stand in for, and checks its range and, if it
/// is `typed` by a person, its unit.
fn required(
    reader: &mut Reader,
    table: &Table<'_>,
    parameter: Parameter,
    base: Base,
    typed: bool,
) -> Option<f64> {
    let (key, accepted) = (parameter.name(), parameter.row().accepted);
    if !table.has(key) {
        let value = base.value(parameter);
        if value.is_none() {
            let cures = [key, materials::KEY, POROSITY.name].map(|key| table.path(key));
            let message = format!("is missing; it must be {accepted}");
            reader.lacks(&cures[0], &cures, message);
        }
        return value;
    }
    let value = reader.number(table, key)?;
    let path = table.path(key);
    if typed {
        let kind = PlausibleRange::known_of(parameter);
        check::quantity(&path, value, accepted, &kind, &mut reader.violations);
    } else {
        check::number(&path, value, accepted, &mut reader.violations);
    }
    (!reader.violations.has_at_or_below(&path)).then_some(value)
}

fn from_constants(reader: &mut Reader, table: &Table<'_>, base: Base) -> Option<Elasticity> {
    let [e_l, nu_l, g_l, e_t, nu_t] =
        CONSTANTS.map(|parameter| required(reader, table, parameter, base, true));
    if matches!(base, Base::Unknown) {
        return None;
    }
    let constants = EngineeringConstants {
        longitudinal_young_modulus: e_l?,
        longitudinal_poisson_ratio: nu_l?,
        longitudinal_shear_modulus: g_l?,
        transverse_young_modulus: e_t?,
        transverse_poisson_ratio: nu_t?,
    };
    match constants.elasticity() {
        Ok(elasticity) => Some(elasticity),
        Err(inadmissible) => {
            let message = format!("the constants are not admissible: {inadmissible}");
            reader.violations.add("bone", message);
            None
        }
    }
}

fn mandel(reader: &mut Reader, table: &Table<'_>) -> Option<Elasticity> {
    let path = table.path("mandel");
    let expected = "6 rows of 6 numbers each (Pa, Kelvin-Mandel, order 11 22 33 23 31 12)";
    let lists = reader.list(table, "mandel", expected)?;
    if lists.len() != 6 {
        let count = lists.len();
        reader.violations.add(&path, format!("has {count} rows; it must be {expected}"));
        return None;
    }
    let rows: Vec<_> = lists
        .iter()
        .enumerate()
        .map(|(index, row)| mandel_row(reader, &path, index, row))
        .collect();
    let mut matrix = [[0.0; 6]; 6];
    for (target, row) in matrix.iter_mut().zip(rows) {
        *target = row?;
    }
    match Elasticity::new(matrix) {
        Ok(elasticity) => Some(elasticity),
        Err(not_elastic) => {
            reader.violations.add(&path, not_elastic.to_string());
            None
        }
    }
}

fn mandel_row(reader: &mut Reader, mandel: &str, index: usize, row: &Node) -> Option<[f64; 6]> {
    let path = element_path(mandel, index);
    let Value::List(elements) = &row.value else {
        reader.wrong_type(path, "a row of 6 numbers (Pa)", &row.value);
        return None;
    };
    let numbers = reader.numbers(&path, elements)?;
    let count = numbers.len();
    let row = <[f64; 6]>::try_from(numbers).ok();
    if row.is_none() {
        reader.violations.add(path, format!("has {count} numbers; a row must have 6 (Pa)"));
    }
    row
}
