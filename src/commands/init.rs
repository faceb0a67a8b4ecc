//! `init`: a first job file for a CSV file of velocities.

use std::path::{Path, PathBuf, absolute};

use anyhow::{Context as _, anyhow};
use osteon_common::job::JobKind;
use osteon_common::visible;
use osteon_files::document::Format;
use osteon_files::init::FirstJob;
use osteon_files::{init, job_file};

use crate::arguments::InitArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::new_files::{self, NewFile};
use crate::output;
use crate::prepared_command::Ended;
use crate::progress::say;
use crate::resolved::OutputFormat;

/// Job file without data, if no path is given.
const UNNAMED: &str = "job.toml";

/// The schema of job files, beside them.
const SCHEMA: &str = "job.schema.json";

/// Writes the job file, says what was understood, and whether the job can be run as it is.
pub(super) fn write(arguments: &InitArguments) -> Ended {
    let InitArguments { velocities, out, schema } = arguments;
    let is_printed = out.as_deref() == Some(Path::new("-"));
    let path = match (out, velocities) {
        (Some(path), _) => path.clone(),
        (None, Some(csv)) => csv.with_extension("toml"),
        (None, None) => PathBuf::from(UNNAMED),
    };
    if is_printed && *schema {
        return Err(CommandFailure::bad_input(anyhow!(
            "--schema writes a file beside the job file, so -o must name one, and not -"
        )));
    }
    if !is_printed {
        new_files::refuse_existing(&path)?;
    }
    let first = match velocities {
        Some(csv) => {
            let beside = if is_printed { Path::new(UNNAMED) } else { path.as_path() };
            let name = name_from(csv, beside).map_err(CommandFailure::bad_input)?;
            init::of_csv(csv, &name).map_err(CommandFailure::bad_input)?
        }
        None => FirstJob { text: init::without_data(), understood: Vec::new() },
    };
    let mut stdout = output::stdout(OutputFormat::Text);
    let account = velocities.as_deref().map(|csv| account(csv, &first.understood));
    // A job that cannot run because of its data is not written.
    if velocities.is_some() {
        let beside =
            if is_printed { Path::new("") } else { path.parent().unwrap_or(Path::new("")) };
        let job = job_file::parse(&first.text, Format::Toml, beside, JobKind::Identification);
        job.map_err(|error| {
            CommandFailure::bad_input(
                anyhow!(error).context("no job was written, as it could not run"),
            )
        })?;
    }
    if is_printed {
        // Beside the job, since what was taken for a velocity is always said.
        account.iter().flat_map(|account| account.lines()).for_each(say);
        stdout.verbatim(&first.text).map_err(stdout_failure)?;
        return Ok(ExitStatus::Done);
    }
    create(&path, first.text, *schema)?;
    let mut said = account.unwrap_or_default();
    let shown = visible::path(&path);
    said += &format!("wrote {shown}; next:\n");
    said += "  set the geometry of your device, and what you know of the bone, in that file\n";
    said += &format!("  osteon check {shown}\n  osteon identify {shown}\n");
    stdout.verbatim(&said).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// Writes the job file, with the schema beside it if that is asked for.
fn create(path: &Path, mut text: String, schema: bool) -> Result<(), CommandFailure> {
    let beside = path.with_file_name(SCHEMA);
    if schema {
        text.insert_str(0, &format!("#:schema {SCHEMA}\n"));
    }
    let mut files =
        vec![NewFile { path: path.to_owned(), content: text.into_bytes().into(), secret: false }];
    // One serves all jobs of a directory.
    if schema && !beside.exists() {
        let content = job_file::schema().into_bytes().into();
        files.push(NewFile { path: beside, content, secret: false });
    }
    new_files::create(&files)
}

/// Returns what was understood of a file of velocities, a sentence in each line after that with its name.
fn account(csv: &Path, understood: &[String]) -> String {
    let sentences = understood.iter().map(|sentence| format!("  {sentence}\n"));
    std::iter::once(format!("{}\n", visible::path(csv))).chain(sentences).collect()
}

/// Returns the name of a CSV file as a job file at `job` has to write it: relative to its directory if the
/// file is in it or below, and absolute otherwise.
fn name_from(csv: &Path, job: &Path) -> anyhow::Result<String> {
    let complete = |path: &Path| {
        absolute(path).with_context(|| format!("{} has no absolute path", visible::path(path)))
    };
    let (csv, job) = (complete(csv)?, complete(job)?);
    let directory = job.parent().unwrap_or(Path::new("/"));
    let name = csv.strip_prefix(directory).unwrap_or(&csv);
    let name = name.to_str().ok_or_else(|| {
        anyhow!("{} is not UTF-8; rename the file, as a job file is UTF-8", visible::path(name))
    })?;
    Ok(name.to_owned())
}
