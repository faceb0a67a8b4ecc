//! `pick`: velocities from a probe's signals.

use std::path::Path;

use anyhow::anyhow;
use osteon_common::case::Case;
use osteon_common::visible;
use osteon_files::case_file;
use osteon_files::probe_file::{self, ProbeDescription};
use osteon_local::modes::BoneSurroundings;
use osteon_signals::reading::SignalFile;
use osteon_signals::{
    DispersionImage, ImageGrid, PickedSeries, SeriesPicker, SignalSeries, WaveFailure, WaveFinder,
    WavePick, own_description, template, to_csv, to_json,
};
use osteon_solver::Isa;

use crate::arguments::PickArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::new_files::{self, NewFile};
use crate::output;
use crate::prepared_command::Ended;
use crate::resolved::OutputFormat;

use super::wave_image;

/// Picks the series of all files, writes the velocities if requested, and prints them.
pub(super) async fn pick(arguments: PickArguments, isa: Isa, cores: u32) -> Ended {
    for path in arguments.out.iter().chain(&arguments.image) {
        new_files::refuse_existing(path)?;
    }
    let picked = tokio::task::spawn_blocking(move || run(&arguments, (isa, cores as usize)));
    picked.await.map_err(CommandFailure::failed)?
}

fn run(arguments: &PickArguments, computing: (Isa, usize)) -> Ended {
    if arguments.init {
        return init(arguments);
    }
    let description = arguments.describe.as_deref().map(probe_file::read).transpose();
    let description = description.map_err(CommandFailure::bad_input)?;
    let model = arguments.model.as_deref().map(case_file::read).transpose();
    let model = model.map_err(CommandFailure::bad_input)?;
    let mut image = SeriesImage { is_wanted: arguments.image.is_some(), ..SeriesImage::default() };
    let mut picked = Vec::new();
    for path in &arguments.files {
        picked.extend(of_file(path, description.as_ref(), &mut image)?);
    }
    if let Some(path) = &arguments.out {
        let own = description.clone().unwrap_or_default();
        let picking = own.setup.picking;
        let finder = WaveFinder::new(own);
        write(path, to_csv(&picked, finder.targets(), &picking))?;
    }
    if let Some(path) = &arguments.image
        && let Some(svg) = image.svg(arguments, model.as_ref(), &picked, computing)?
    {
        write(path, svg)?;
    }
    let text = match arguments.json {
        true => {
            let picking = description.map(|description| description.setup.picking);
            to_json(&picked, picking).map_err(CommandFailure::failed)?
        }
        false => text_of_picks(&picked, arguments.out.as_deref()),
    };
    output::stdout(OutputFormat::Text).verbatim(&text).map_err(stdout_failure)?;
    let is_found = |one: &PickedSeries| {
        one.pick.estimate.is_ok() || one.waves.iter().any(|wave| wave.estimate.is_ok())
    };
    Ok(if picked.iter().any(is_found) { ExitStatus::Done } else { ExitStatus::RunFailed })
}

/// The image of all series.
#[derive(Debug, Default)]
struct SeriesImage {
    is_wanted: bool,
    image: Option<DispersionImage>,
    /// Why a series is not in it.
    failure: Option<WaveFailure>,
}

impl SeriesImage {
    fn add(&mut self, description: &ProbeDescription, series: &SignalSeries) {
        if !self.is_wanted {
            return;
        }
        let new = || DispersionImage::new(ImageGrid::usual(&description.setup));
        let image = self.image.get_or_insert_with(new);
        self.failure = image.add(description, series).err().or(self.failure);
    }

    fn svg(
        &self,
        arguments: &PickArguments,
        model: Option<&Case>,
        picked: &[PickedSeries],
        computing: (Isa, usize),
    ) -> Result<Option<String>, CommandFailure> {
        let seen = self.image.as_ref().filter(|image| image.values().is_some());
        let Some(image) = seen else {
            let reason = self.failure.map_or("there are none", WaveFailure::meaning);
            return Err(CommandFailure::failed(anyhow!(
                "no series can be shown as an image: {reason}"
            )));
        };
        let surroundings =
            if arguments.in_fluids { BoneSurroundings::Fluids } else { BoneSurroundings::Vacuum };
        let modes = model.map(|case| wave_image::model(case, surroundings, image, computing));
        let found = picked.iter().map(|one| one.waves.as_slice());
        Ok(wave_image::svg(image, modes.transpose()?.as_ref(), found))
    }
}

/// Picks the series of one file.
fn of_file(
    path: &Path,
    description: Option<&ProbeDescription>,
    image: &mut SeriesImage,
) -> Result<Vec<PickedSeries>, CommandFailure> {
    let mut file = SignalFile::open(path).map_err(CommandFailure::bad_input)?;
    let own = match description {
        Some(given) => given.clone(),
        None => described_by_itself(path, &file)?,
    };
    let positions: Vec<f64> = own.setup.probe.receivers.positions().collect();
    let (picker, finder) = (SeriesPicker::new(own.clone()), WaveFinder::new(own));
    let mut picked = Vec::new();
    let picking = |series| {
        image.add(picker.description(), &series);
        let (pick, waves) = (picker.pick(&series), finder.find(&series));
        let positions = positions.clone();
        picked.push(PickedSeries { file: path.to_owned(), positions, pick, waves });
    };
    file.for_each_series(picker.description(), picking).map_err(CommandFailure::bad_input)?;
    Ok(picked)
}

/// Returns the description of the probe that a file gives of itself.
fn described_by_itself(path: &Path, file: &SignalFile) -> Result<ProbeDescription, CommandFailure> {
    let (recognized, shown) = (file.recognized(), visible::path(path));
    if !recognized.has_positions() {
        return Err(CommandFailure::bad_input(anyhow!(
            "{shown} does not say where its receivers are; describe its probe (--describe), for which \
             `osteon pick --init {shown}` writes a first file"
        )));
    }
    own_description(&recognized).map_err(|error| {
        let context = format!("{shown} does not describe its probe");
        CommandFailure::bad_input(anyhow!(error).context(context))
    })
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
        text += &one.waves.iter().map(text_of_wave).collect::<String>();
    }
    if let Some(out) = out {
        text += &format!("\nvelocities in {}\n", visible::path(out));
    }
    text
}

fn text_of_wave(pick: &WavePick) -> String {
    let (name, megahertz) = (pick.target.wave.row().short, pick.target.frequency / 1e6);
    let found = match &pick.estimate {
        Ok(found) => format!("{:.1} ± {:.1} m/s", found.phase_velocity, found.standard_error),
        Err(failure) => failure.meaning().to_owned(),
    };
    format!("          {name} at {megahertz} MHz: {found}\n")
}
