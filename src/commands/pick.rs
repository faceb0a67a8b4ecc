//! `pick`: velocities from a probe's signals.

use std::path::Path;

use anyhow::anyhow;
use osteon_common::visible;
use osteon_files::probe_file::{self, ProbeDescription};
use osteon_signals::reading::SignalFile;
use osteon_signals::{PickedSeries, SeriesPicker, own_description, template, to_csv, to_json};

use crate::arguments::PickArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::new_files::{self, NewFile};
use crate::output;
use crate::prepared_command::Ended;
use crate::resolved::OutputFormat;

/// Picks the series of all files, writes the velocities if requested, and prints them.
pub(super) async fn pick(arguments: PickArguments) -> Ended {
    if let Some(path) = &arguments.out {
        new_files::refuse_existing(path)?;
    }
    let picked = tokio::task::spawn_blocking(move || run(&arguments));
    picked.await.map_err(CommandFailure::failed)?
}

fn run(arguments: &PickArguments) -> Ended {
    if arguments.init {
        return init(arguments);
    }
    let description = arguments.describe.as_deref().map(probe_file::read).transpose();
    let description = description.map_err(CommandFailure::bad_input)?;
    let mut picked = Vec::new();
    for path in &arguments.files {
        picked.extend(of_file(path, description.as_ref())?);
    }
    if let Some(path) = &arguments.out {
        let picking = description.as_ref().map(|description| description.setup.picking);
        write(path, to_csv(&picked, &picking.unwrap_or_default()))?;
    }
    let text = match arguments.json {
        true => {
            let picking = description.map(|description| description.setup.picking);
            to_json(&picked, picking).map_err(CommandFailure::failed)?
        }
        false => text_of_picks(&picked, arguments.out.as_deref()),
    };
    output::stdout(OutputFormat::Text).verbatim(&text).map_err(stdout_failure)?;
    let has_velocity = picked.iter().any(|one| one.pick.estimate.is_ok());
    Ok(if has_velocity { ExitStatus::Done } else { ExitStatus::RunFailed })
}

/// Picks the series of one file.
fn of_file(
    path: &Path,
    description: Option<&ProbeDescription>,
) -> Result<Vec<PickedSeries>, CommandFailure> {
    let mut file = SignalFile::open(path).map_err(CommandFailure::bad_input)?;
    let recognized = file.recognized();
    let own = match description {
        Some(given) => given.clone(),
        None if !recognized.has_positions() => {
            return Err(CommandFailure::bad_input(anyhow!(
                "{0} does not say where its receivers are; describe its probe (--describe), for which \
                 `osteon pick --init {0}` writes a first file",
                visible::path(path)
            )));
        }
        None => own_description(&recognized).map_err(|error| {
            let shown = visible::path(path);
            CommandFailure::bad_input(
                anyhow!(error).context(format!("{shown} does not describe its probe")),
            )
        })?,
    };
    let positions: Vec<f64> = own.setup.probe.receivers.positions().collect();
    let picker = SeriesPicker::new(own);
    let mut picked = Vec::new();
    let picking = |series| {
        let pick = picker.pick(&series);
        picked.push(PickedSeries { file: path.to_owned(), positions: positions.clone(), pick });
    };
    file.for_each_series(picker.description(), picking).map_err(CommandFailure::bad_input)?;
    Ok(picked)
}

/// Prints or writes a first probe file.
fn init(arguments: &PickArguments) -> Ended {
    let [path] = arguments.files.as_slice() else {
        return Err(CommandFailure::bad_input(anyhow!(
            "--init describes one FILE, and {} are given",
            arguments.files.len()
        )));
    };
    let file = SignalFile::open(path).map_err(CommandFailure::bad_input)?;
    let text = template(&file.recognized());
    let said = match &arguments.out {
        Some(out) => {
            write(out, text)?;
            let shown = visible::path(out);
            format!(
                "wrote {shown}; next:\n  set the geometry of your device in that file\n  osteon pick {} \
                 --describe {shown}\n",
                visible::path(path)
            )
        }
        None => text,
    };
    output::stdout(OutputFormat::Text).verbatim(&said).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

fn write(path: &Path, text: String) -> Result<(), CommandFailure> {
    new_files::create(&[NewFile {
        path: path.to_owned(),
        content: text.into_bytes().into(),
        secret: false,
    }])
}

/// Returns a line for each series, for people.
fn text_of_picks(picked: &[PickedSeries], out: Option<&Path>) -> String {
    let mut text = "  series  velocity (m/s)  standard error  quality  failure\n".to_owned();
    for (index, one) in picked.iter().enumerate() {
        let number = index + 1;
        text += &match &one.pick.estimate {
            Ok(found) => format!(
                "{number:8}  {:14.3}  {:14.3}  {:7.3}\n",
                found.velocity, found.standard_error, found.quality
            ),
            Err(refusal) => {
                format!(
                    "{number:8}  {:>14}  {:>14}  {:7.3}  {}\n",
                    "-",
                    "-",
                    0.0,
                    refusal.failure.name()
                )
            }
        };
        let failed = one.pick.receivers.iter().enumerate();
        for (receiver, failure) in failed.filter_map(|(r, it)| Some((r + 1, it.failure?))) {
            text += &format!("          receiver {receiver} {}\n", failure.meaning());
        }
        if let Err(refusal) = &one.pick.estimate {
            text += &format!("          {}\n", refusal.detail);
        }
    }
    if let Some(out) = out {
        text += &format!("\nvelocities in {}\n", visible::path(out));
    }
    text
}
