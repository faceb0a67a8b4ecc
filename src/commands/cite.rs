//! `cite`: BibTeX of the program, of the method, and of the materials that a job or case uses.
//!
//! A file that was read knows values and no names of materials, and so does `job.toml` beside a result: a
//! material is known by its elasticity.

use std::path::Path;

use anyhow::Context as _;
use osteon_client::results_directory;
use osteon_common::bone::{Bone, CaseBone};
use osteon_common::bone_structure::MeanSolid;
use osteon_common::job::{JobKind, JobSpecification};
use osteon_common::parameters::Parameter;
use osteon_common::version::Program;
use osteon_common::visible;
use osteon_files::file_error::FileError;
use osteon_files::job_file::FilePurpose;
use osteon_files::materials::{self, Material};
use osteon_files::report::ResultFile;
use osteon_files::{case_file, job_file};

use crate::arguments::CiteArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::output;
use crate::prepared_command::Ended;
use crate::program;
use crate::resolved::OutputFormat;

/// All entries, each above an empty line. Those with the field `keywords` are the sources of the materials
/// that it lists.
const REFERENCES: &str = include_str!("cite/references.bib");

/// What stands in [`REFERENCES`] for the version of the program, and for its numerics and commit.
const PLACES: [&str; 2] = ["@VERSION@", "@BUILD@"];

/// Number of engineering constants by which a material is known although others were replaced. No two
/// materials have as many in common.
const CONSTANTS_LEAST: usize = 3;

/// Files in a directory of results.
const JOB: &str = "job.toml";
const RESULT: &str = "result.json";

/// Prints the entries.
pub(super) fn print(arguments: &CiteArguments) -> Ended {
    let cited = match &arguments.file {
        None => Cited { program: program::current(), materials: Vec::new() },
        Some(path) => Cited::by(path)?,
    };
    output::stdout(OutputFormat::Text).verbatim(&cited.bibliography()).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// What is cited besides the method.
struct Cited {
    program: Program,
    materials: Vec<&'static (&'static str, Material)>,
}

impl Cited {
    /// Returns what the results in a directory, a job or a case have to cite.
    fn by(path: &Path) -> Result<Self, CommandFailure> {
        let directory = match path.file_name().is_some_and(|name| name == RESULT) {
            true => path.parent(),
            false => path.is_dir().then_some(path),
        };
        let Some(directory) = directory else {
            let materials = materials_of(path).map_err(CommandFailure::bad_input)?;
            return Ok(Self { program: program::current(), materials });
        };
        let materials = materials_of(&directory.join(JOB)).map_err(CommandFailure::bad_input)?;
        let program = computed_by(&directory.join(RESULT))?.unwrap_or_else(program::current);
        Ok(Self { program, materials })
    }

    /// Returns the entries, those of materials with what was compared with the source.
    fn bibliography(&self) -> String {
        let Program { version, numerics, commit } = &self.program;
        let commit = commit.as_deref().unwrap_or("unknown");
        let build = format!("numerics revision {numerics}, commit {}", visible::line(commit));
        let [version_place, build_place] = PLACES;
        let entries = REFERENCES.trim_end().split("\n\n").filter_map(|entry| {
            let remarks = self.remarks(entry)?;
            let entry = entry.replace(version_place, &visible::line(version));
            Some(format!("{remarks}{}\n", entry.replace(build_place, &build)))
        });
        entries.collect::<Vec<_>>().join("\n")
    }

    /// Returns the lines above an entry; `None` if the entry is not of what is cited.
    fn remarks(&self, entry: &str) -> Option<String> {
        let Some(names) = field(entry, "keywords") else { return Some(String::new()) };
        let is_named = |name: &str| names.split(", ").any(|known| known == name);
        let of_entry = self.materials.iter().filter(|(name, _)| is_named(name));
        let lines = of_entry.map(|(name, material)| {
            format!("% {name}, compared with its source: {}\n", material.checked)
        });
        let lines: String = lines.collect();
        (!lines.is_empty()).then_some(lines)
    }
}

/// Returns the program that computed a result; `None` if there is no such file.
fn computed_by(path: &Path) -> Result<Option<Program>, CommandFailure> {
    let Some(text) = results_directory::read_named_file(path)? else { return Ok(None) };
    let result = ResultFile::from_json(&text)
        .with_context(|| format!("{} is not the result of a job", visible::path(path)));
    Ok(Some(result.map_err(CommandFailure::bad_input)?.program()))
}

/// Returns the materials of a job or case file, in the order in which they are listed.
fn materials_of(path: &Path) -> Result<Vec<&'static (&'static str, Material)>, FileError> {
    let input = job_file::open(path, Vec::new())?;
    let used: Box<dyn Fn(&Material) -> bool> = match job_file::purpose(&input)? {
        FilePurpose::Case => {
            let bone = case_file::of_input(&input)?.bone;
            Box::new(move |material| is_in_case(material, &bone))
        }
        // As a propagation, which needs no data.
        FilePurpose::Job(_) => {
            let job = job_file::of_input(&input, JobKind::Propagation)?.specification;
            Box::new(move |material| is_in_job(material, &job))
        }
    };
    Ok(materials::all().iter().filter(|(_, material)| used(material)).collect())
}

/// Returns whether the mean model of a job begins at a material, or a sublayer is made of it.
fn is_in_job(material: &Material, job: &JobSpecification) -> bool {
    let constants = Material::PARAMETERS.into_iter().filter(|one| *one != Parameter::Density);
    let same = constants.filter(|one| material.value(*one) == Some(job.range(*one).start()));
    let sublayers = job.setup.structure.sublayers.iter();
    same.count() >= CONSTANTS_LEAST
        || sublayers.map(|sublayer| &sublayer.solid).any(|solid| match solid {
            MeanSolid::Given(bone) => is_made_of(material, bone),
            MeanSolid::Porous(_) => false,
        })
}

/// Returns whether the bone of a case, or a sublayer of it, is made of a material.
fn is_in_case(material: &Material, bone: &CaseBone) -> bool {
    match bone {
        CaseBone::Homogeneous(bone) => is_made_of(material, bone),
        CaseBone::Layered(sublayers) => {
            sublayers.iter().any(|sublayer| is_made_of(material, &sublayer.solid))
        }
    }
}

/// Returns whether a solid has the elasticity of a material; its density is often another.
fn is_made_of(material: &Material, bone: &Bone) -> bool {
    material.constants().elasticity().is_ok_and(|elasticity| elasticity == bone.elasticity)
}

/// Returns the value of a field of an entry, each of which has a line of its own.
fn field<'a>(entry: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = entry.split_once(&format!("\n  {name} = {{"))?;
    let line = rest.lines().next()?;
    line.trim_end_matches(',').strip_suffix('}')
}

#[cfg(test)]
mod tests;
