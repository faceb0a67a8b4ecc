//! `modes`: all guided waves of a case's bone.

use std::path::Path;

use anyhow::anyhow;
use osteon_common::warnings::case_warnings;
use osteon_files::case_file;
use osteon_local::frequency_band::FrequencyBand;
use osteon_local::modes::{BandModes, BoneSurroundings};
use osteon_local::shapes::{BandShapes, BandShapesError};
use osteon_signals::{DispersionImage, ImageGrid};
use osteon_solver::Isa;

use crate::arguments::ModesArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::new_files::{self, NewFile};
use crate::output::{self, ShownModes};
use crate::prepared_command::Ended;
use crate::resolved;
use crate::warnings;
use crate::wings::dispersion_figure;

use super::wave_image::{self, modes_failure};

/// The files of the waves, of their figure, of their shapes, and of the image that an array sees.
const TABLE: &str = "modes.csv";
const FIGURE: &str = "modes.svg";
const SHAPES: &str = "shapes.csv";
const IMAGE: &str = "image.svg";

/// Computes the waves, writes their files if requested, and prints them.
pub(super) async fn modes(arguments: ModesArguments, isa: Isa, cores: u32) -> Ended {
    let ModesArguments { case, frequencies, in_fluids, shapes, threads, out, json, .. } = arguments;
    let further = (arguments.further_sources, arguments.source_pitch.unwrap_or_default());
    let input = case.open().map_err(CommandFailure::bad_input)?;
    let case = case_file::of_input(&input).map_err(CommandFailure::bad_input)?;
    warnings::say_all(&case_warnings(&case));
    if let Some(directory) = &out {
        for name in [TABLE, FIGURE, SHAPES, IMAGE] {
            new_files::refuse_existing(&directory.join(name))?;
        }
    }
    let center = FrequencyBand::single(case.setup.probe.center_frequency);
    let frequencies = frequencies.unwrap_or(center).frequencies();
    let threads = threads.unwrap_or(cores) as usize;
    let surroundings = if in_fluids { BoneSurroundings::Fluids } else { BoneSurroundings::Vacuum };
    let compute = move || -> Result<_, CommandFailure> {
        let modes = BandModes::compute(&case, surroundings, &frequencies, isa, threads);
        let modes = modes.map_err(modes_failure)?;
        let shapes = shapes.map(|depths| BandShapes::compute(&case, &modes, depths, isa, threads));
        let shapes = shapes.transpose().map_err(|error| match error {
            BandShapesError::TooMany { .. } => CommandFailure::bad_input(error),
            _ => CommandFailure::failed(error),
        })?;
        let image = match arguments.image {
            false => None,
            true => {
                let grid = ImageGrid::of_frequencies(&case.setup, frequencies);
                let mut image = DispersionImage::new(grid);
                let (description, series) = wave_image::recorded(&case, further, isa)?;
                let added = image.add(&description, &series);
                added.map_err(|failure| CommandFailure::failed(anyhow!(failure.meaning())))?;
                wave_image::svg(&image, Some(&modes), std::iter::empty())
            }
        };
        Ok((modes, shapes, image))
    };
    let computed = tokio::task::spawn_blocking(compute).await.map_err(CommandFailure::failed)?;
    let (modes, shapes, image) = computed?;
    if let Some(directory) = &out {
        write(directory, &modes, shapes.as_ref(), image)?;
    }
    let shown = ShownModes { modes: &modes, directory: out.as_deref() };
    output::stdout(resolved::format(json)).modes(&shown).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

fn write(
    directory: &Path,
    modes: &BandModes,
    shapes: Option<&BandShapes>,
    image: Option<String>,
) -> Result<(), CommandFailure> {
    new_files::directory(directory)?;
    let file = |name: &str, text: String| NewFile {
        path: directory.join(name),
        content: text.into_bytes().into(),
        secret: false,
    };
    let figure = dispersion_figure(&modes.points()).map(|svg| file(FIGURE, svg));
    let shapes = shapes.map(|shapes| file(SHAPES, shapes.to_csv()));
    let image = image.map(|svg| file(IMAGE, svg));
    let table = file(TABLE, modes.to_csv());
    let files: Vec<NewFile> =
        [table].into_iter().chain(figure).chain(shapes).chain(image).collect();
    new_files::create(&files)
}
