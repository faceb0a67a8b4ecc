//! Job files: the specification of a job, in TOML or JSON.

mod csv_format;
mod data_section;
pub(crate) mod decays;
mod key_tables;
mod observables;
mod parameters;
mod posterior;
mod priors;
mod purpose;
mod schema;

use std::path::{Path, PathBuf};

use osteon_common::bone_structure::BoneStructure;
use osteon_common::case::Setup;
use osteon_common::check;
use osteon_common::fields::Section;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{
    JobKind, JobSpecification, MonteCarlo, Objective, Omitted, PosteriorSettings, Search,
};
use osteon_common::limits;
use osteon_common::pulse::PulseForm;
use osteon_common::systematic::Systematic;
use osteon_common::warnings::{self, Warning};

use crate::document::{Format, Node};
use crate::document_text::DocumentText;
use crate::file_error::{ContentError, FileError, Invalid, SizeLimit};
use crate::input_file::InputFile;
use crate::reader::{self, Reader, Table};
use crate::setting::Setting;
use crate::{bone_structure, pulse};

pub use self::key_tables::{job_table, porosity_table, setup_table};
pub use self::purpose::{FilePurpose, purpose};
pub use self::schema::schema;
pub use crate::toml_text::job as to_toml;

/// Limit of a job file's length; it may contain measured velocities.
const SIZE_LIMIT: SizeLimit = SizeLimit {
    bytes: limits::JOB_FILE_BYTES_MAX,
    suffices_for: "a job with a million velocities needs; data.velocities may also name a CSV file",
};

/// Reads and validates the job file at `path`; its extension determines the format. If it names a
/// file of measured velocities, that is read too, relative to the job file, and inlined.
///
/// For a propagation, `[data]` may be left out and is not kept, nor is `[posterior]`; no file of
/// velocities is read.
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

/// Reads the job file at `path`, or standard input if that is `-`, with `settings` that replace values of
/// it; its extension determines the format.
///
/// # Errors
/// If the file cannot be read.
pub fn open(path: &Path, settings: Vec<Setting>) -> Result<InputFile, FileError> {
    InputFile::open(path, SIZE_LIMIT, settings)
}

/// Reads a job file as [`read`] does, and also returns warnings and notes.
///
/// # Errors
/// Same as [`read`].
pub fn read_with_warnings(path: &Path, kind: JobKind) -> Result<JobWithWarnings, FileError> {
    of_input(&open(path, Vec::new())?, kind)
}

/// Validates a job file that has been opened.
///
/// # Errors
/// If it is malformed, describes a case, or violates a rule; all violations are reported at once.
pub fn of_input(input: &InputFile, kind: JobKind) -> Result<JobWithWarnings, FileError> {
    let path = || input.path().to_owned();
    let content = |content| FileError::Content { path: path(), content };
    let document = input.document();
    let root = document.tree().map_err(|error| content(error.into()))?;
    if purpose::of_tree(&root) == FilePurpose::Case {
        return Err(FileError::CaseForJob { path: path() });
    }
    let read = of_tree(document, &root, input.directory(), kind);
    read.map_err(|invalid| content(invalid.into()))
}

/// Reads and validates the text of a job file in `directory`; otherwise the same as [`read`].
///
/// ```
/// use std::path::Path;
///
/// use osteon_common::job::JobKind;
/// use osteon_files::document::Format;
/// use osteon_files::job_file;
///
/// let text = "[monte_carlo]\nrealisations = 100";
/// let refused = job_file::parse(text, Format::Toml, Path::new(""), JobKind::Propagation);
/// let message = refused.unwrap_err().to_string();
/// assert!(message.contains("monte_carlo.realisations: unknown key; did you mean `realizations`?"));
/// ```
///
/// # Errors
/// If the text is malformed or violates a rule; all violations are reported at once.
pub fn parse(
    text: &str,
    format: Format,
    directory: &Path,
    kind: JobKind,
) -> Result<JobSpecification, ContentError> {
    let document = DocumentText::new(text, format);
    let noted = of_tree(document, &document.tree()?, directory, kind)?;
    Ok(noted.specification)
}

fn of_tree(
    document: DocumentText<'_>,
    root: &Node,
    directory: &Path,
    kind: JobKind,
) -> Result<JobWithWarnings, Invalid> {
    let mut reader = Reader::default();
    let keys = [
        "layers",
        "probe",
        "picking",
        "solver",
        BoneStructure::KEY.name,
        "data",
        "parameters",
        "random",
        Systematic::KEY.name,
        GroupSettings::KEY.name,
        "monte_carlo",
        "objective",
        "search",
        PosteriorSettings::KEY.name,
    ];
    let table = reader.root(root, &keys);
    if !table.is_table() {
        return Err(reader.refuse(document, root));
    }
    let mut setup = setup(&mut reader, &table, directory);
    let thickness = &mut setup.layers.bone_thickness;
    setup.structure = bone_structure::of_job(&mut reader, &table, thickness);
    let (data, origin) = data_section::read(&mut reader, &table, (directory, &setup), kind);
    let posterior = posterior::read(&mut reader, &table);
    let (objective, objective_omitted) = objective(&mut reader, &table);
    let (search, cost_tolerance_omitted) = search(&mut reader, &table);
    let specification = JobSpecification {
        kind,
        setup: setup.clone(),
        data,
        parameters: parameters::read(&mut reader, &table, &setup),
        random: section(&mut reader, &table, "random"),
        systematic: section(&mut reader, &table, Systematic::KEY.name),
        groups: section(&mut reader, &table, GroupSettings::KEY.name),
        monte_carlo: monte_carlo(&mut reader, &table),
        objective,
        search,
        posterior: posterior.filter(|_| kind == JobKind::Identification),
    };
    let specification = specification.with_implied(Omitted {
        objective: objective_omitted,
        cost_tolerance: cost_tolerance_omitted,
    });
    check::job_from(&specification, origin.as_ref(), &mut reader.violations);
    if let Some(unused) = posterior.filter(|_| kind == JobKind::Propagation) {
        check::posterior(&specification, &unused, &mut reader.violations);
    }
    if !reader.violations.is_empty() {
        return Err(reader.refuse(document, root));
    }
    let warnings = warnings::job_warnings_from(&specification, origin.as_ref());
    let velocities_file = origin.map(|origin| origin.path().to_owned());
    Ok(JobWithWarnings { specification, warnings, velocities_file })
}

/// Reads the sections that case and job files share.
///
/// Names of files are relative to `directory`.
pub(crate) fn setup(reader: &mut Reader, root: &Table<'_>, directory: &Path) -> Setup {
    let mut setup = Setup::default();
    let mut form = PulseForm::default();
    for (key, section) in setup.sections() {
        let table = reader::section(reader, root, key.name, section);
        if key.name == "probe" {
            form = pulse::read(reader, &table, directory);
        }
    }
    setup.probe.pulse = form;
    setup
}

fn section<S: Section + Default>(reader: &mut Reader, root: &Table<'_>, name: &str) -> S {
    let mut read = S::default();
    reader::section(reader, root, name, &mut read);
    read
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

/// Reads the objective, and returns whether its kind is left out.
fn objective(reader: &mut Reader, root: &Table<'_>) -> (Objective, bool) {
    let mut objective = Objective::default();
    let table = reader::section(reader, root, "objective", &mut objective);
    (objective, !table.has("kind"))
}

/// Reads the search, and returns whether its cost tolerance is left out.
fn search(reader: &mut Reader, root: &Table<'_>) -> (Search, bool) {
    let mut search = Search::default();
    let table = reader::section(reader, root, "search", &mut search);
    search.priors = priors::read(reader, &table);
    (search, !table.has("cost_tolerance"))
}
