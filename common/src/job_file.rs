//! Job files: the specification of a job, in TOML or JSON.

mod data_section;
mod priors;

use std::path::{Path, PathBuf};
use std::slice;

use crate::case::Setup;
use crate::check;
use crate::document::{self, Format};
use crate::file_error::{self, Bound, ContentError, FileError};
use crate::job::{JobKind, JobSpecification, MonteCarlo, Objective, Range, Search};
use crate::limits;
use crate::parameters::Parameter;
use crate::reader::{self, Reader, Table};
use crate::warnings::{self, Warning};

pub use crate::toml_text::job as to_toml;

/// Limit of a job file's length; it may contain measured velocities.
const BOUND: Bound = Bound {
    bytes: limits::JOB_FILE_BYTES_MAX,
    purpose: "a job with a million velocities needs; data.velocities may also name a CSV file",
};

/// Reads and validates the job file at `path`; its extension determines the format. If it names a
/// file of measured velocities, that is read too, relative to the job file, and inlined.
///
/// For a propagation, `[data]` may be left out and is not kept; no file of velocities is read.
///
/// # Errors
/// If the file cannot be read, is malformed, or violates a rule; all violations are reported at
/// once.
pub fn read(path: &Path, kind: JobKind) -> Result<JobSpecification, FileError> {
    read_with_warnings(path, kind).map(|noted| noted.specification)
}

/// A job, with warnings and notes about the file from which it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct JobWithWarnings {
    /// The job.
    pub specification: JobSpecification,
    /// Warnings about values that are allowed but unusual.
    pub warnings: Vec<Warning>,
    /// The file of its measured velocities, if they are in a separate one.
    pub velocities_file: Option<PathBuf>,
}

/// Reads a job file as [`read`] does, and also returns warnings and notes.
///
/// # Errors
/// Same as [`read`].
pub fn read_with_warnings(path: &Path, kind: JobKind) -> Result<JobWithWarnings, FileError> {
    let (text, format) = file_error::read(path, BOUND)?;
    let directory = path.parent().unwrap_or(Path::new(""));
    parse_with_warnings(&text, format, directory, kind)
        .map_err(|content| FileError::Content { path: path.to_owned(), content })
}

/// Reads and validates the text of a job file in `directory`; otherwise the same as [`read`].
///
/// # Errors
/// If the text is malformed or violates a rule; all violations are reported at once.
pub fn parse(
    text: &str,
    format: Format,
    directory: &Path,
    kind: JobKind,
) -> Result<JobSpecification, ContentError> {
    parse_with_warnings(text, format, directory, kind).map(|noted| noted.specification)
}

fn parse_with_warnings(
    text: &str,
    format: Format,
    directory: &Path,
    kind: JobKind,
) -> Result<JobWithWarnings, ContentError> {
    let root = document::parse(file_error::without_byte_order_mark(text), format)?;
    let mut reader = Reader::default();
    let keys = [
        "layers",
        "probe",
        "picking",
        "solver",
        "data",
        "parameters",
        "monte_carlo",
        "objective",
        "search",
    ];
    let table = reader.root(&root, &keys);
    if !table.is_table() {
        return Err(reader.refuse(&root).into());
    }
    let setup = setup(&mut reader, &table);
    let (data, origin) = data_section::read(&mut reader, &table, directory, kind);
    let specification = JobSpecification {
        kind,
        setup,
        data,
        parameters: parameters(&mut reader, &table),
        monte_carlo: monte_carlo(&mut reader, &table),
        objective: objective(&mut reader, &table),
        search: search(&mut reader, &table),
    };
    check::job_from(&specification, origin.as_ref(), &mut reader.violations);
    if !reader.violations.is_empty() {
        return Err(reader.refuse(&root).into());
    }
    let warnings = warnings::job_warnings_from(&specification, origin.as_ref());
    let velocities_file = origin.map(|origin| origin.path().to_owned());
    Ok(JobWithWarnings { specification, warnings, velocities_file })
}

/// Reads the sections that case and job files share.
pub(crate) fn setup(reader: &mut Reader, root: &Table<'_>) -> Setup {
    let mut setup = Setup::default();
    for (name, section) in setup.sections() {
        reader::section(reader, root, name, section);
    }
    setup
}

fn monte_carlo(reader: &mut Reader, root: &Table<'_>) -> MonteCarlo {
    let mut monte_carlo = MonteCarlo::default();
    let table = reader::section(reader, root, "monte_carlo", &mut monte_carlo);
    // If these are misspelt, the scrambles cannot be checked against them, and only the misspelling
    // is reported.
    if ["realizations", "sampling"].iter().any(|key| reader.is_misspelt(&table, key)) {
        monte_carlo.scrambles = MonteCarlo::default().scrambles;
    }
    monte_carlo
}

fn objective(reader: &mut Reader, root: &Table<'_>) -> Objective {
    let mut objective = Objective::default();
    reader::section(reader, root, "objective", &mut objective);
    objective
}

fn search(reader: &mut Reader, root: &Table<'_>) -> Search {
    let mut search = Search::default();
    let table = reader::section(reader, root, "search", &mut search);
    search.priors = priors::read(reader, &table);
    search
}

/// Returns the seven ranges. If one is missing or wrong, this is recorded, and the range has no
/// meaning.
fn parameters(reader: &mut Reader, root: &Table<'_>) -> [Range; 7] {
    let table = reader.table(root, "parameters", &Parameter::ALL.map(Parameter::name));
    if !table.is_table() {
        if !root.has("parameters") {
            let names = Parameter::ALL.map(Parameter::name).join(", ");
            let message = format!("is missing; it must have the seven tables {names}");
            reader.lacks("parameters", &["parameters".to_owned()], message);
        }
        return [UNKNOWN; 7];
    }
    Parameter::ALL.map(|parameter| range(reader, &table, parameter))
}

/// Placeholder for a range that could not be read; a violation is always recorded with it.
const UNKNOWN: Range = Range::Fixed(f64::NAN);

/// Reads a range; numbers that cannot be read are recorded and become NaN.
fn range(reader: &mut Reader, parameters: &Table<'_>, parameter: Parameter) -> Range {
    let key = parameter.name();
    let table = reader.table(parameters, key, &["start", "bounds", "fixed"]);
    let path = parameters.path(key);
    if !table.is_table() {
        if !parameters.has(key) {
            reader.lacks(&path, slice::from_ref(&path), format!("is missing; {RANGE_FORMS}"));
        }
        return UNKNOWN;
    }
    match (table.has("fixed"), table.has("start") || table.has("bounds")) {
        (true, false) => Range::Fixed(reader.number(&table, "fixed").unwrap_or(f64::NAN)),
        (false, true) => {
            if !table.has("start") {
                reader.missing(&table, "start", format_args!("within the bounds; {RANGE_FORMS}"));
            }
            if !table.has("bounds") {
                reader.missing(&table, "bounds", format_args!("[lower, upper]; {RANGE_FORMS}"));
            }
            let start = reader.number(&table, "start").unwrap_or(f64::NAN);
            let [lower, upper] = bounds(reader, &table).unwrap_or([f64::NAN; 2]);
            Range::Free { start, lower, upper }
        }
        (true, true) => {
            let message = format!("has fixed together with start or bounds; {RANGE_FORMS}");
            reader.violations.add(path, message);
            UNKNOWN
        }
        (false, false) => {
            let cures = ["fixed", "start", "bounds"].map(|key| table.path(key));
            reader.lacks(&path, &cures, format!("has no value; {RANGE_FORMS}"));
            UNKNOWN
        }
    }
}

const RANGE_FORMS: &str = "give either fixed, or start and bounds";

fn bounds(reader: &mut Reader, table: &Table<'_>) -> Option<[f64; 2]> {
    let expected = "[lower, upper]";
    let elements = reader.list(table, "bounds", expected)?;
    let path = table.path("bounds");
    let numbers = reader.numbers(&path, elements)?;
    let bounds = <[f64; 2]>::try_from(numbers).ok();
    if bounds.is_none() {
        let count = elements.len();
        reader.violations.add(path, format!("is a list of {count}; it must be {expected}"));
    }
    bounds
}
