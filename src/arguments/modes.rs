//! The arguments of `modes`.

use std::path::PathBuf;

use clap::Args;
use osteon_local::frequency_band::FrequencyBand;
use osteon_local::shapes::DEPTHS_MAX;

use super::{CaseFileArguments, length};

/// Arguments of `modes`.
#[derive(Debug, Args)]
pub(crate) struct ModesArguments {
    /// The case.
    #[command(flatten)]
    pub(crate) case: CaseFileArguments,
    /// Frequency (Hz), or START:STOP:COUNT: COUNT frequencies from START to STOP in equal steps, e.g.
    /// 1e4:2e6:200 [default: the probe's centre frequency]
    #[arg(long, value_name = "HZ")]
    pub(crate) frequencies: Option<FrequencyBand>,
    /// Compute the waves between coupling and marrow as half-spaces, with the attenuation of all
    /// layers, instead of those in a vacuum
    #[arg(long)]
    pub(crate) in_fluids: bool,
    /// Also write shapes.csv: displacements and stresses of each wave at N depths from the upper face of the
    /// bone to the lower one [default: 41]
    #[arg(long, value_name = "N", requires = "out", num_args = 0..=1, require_equals = true)]
    #[arg(default_missing_value = "41", value_parser = clap::value_parser!(u32).range(2..=DEPTHS_MAX.into()))]
    pub(crate) shapes: Option<u32>,
    /// Also write image.svg: the waves that the case's probe sees over frequency and wavenumber, from computed
    /// signals, with these waves over them
    #[arg(long, requires_all = ["out", "frequencies"])]
    pub(crate) image: bool,
    /// Number of sources beyond each of the probe's own, which tell waves apart in the image
    #[arg(long, value_name = "N", default_value = "0", requires_all = ["image", "source_pitch"])]
    #[arg(value_parser = clap::value_parser!(u32).range(..=31))]
    pub(crate) further_sources: u32,
    /// Distance between neighbouring sources (m)
    #[arg(long, value_name = "M", value_parser = length)]
    pub(crate) source_pitch: Option<f64>,
    /// Number of threads to compute on [default: all cores]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) threads: Option<u32>,
    /// Directory for modes.csv, with a row for each wave and frequency, and the figure modes.svg
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the waves as JSON
    #[arg(long)]
    pub(crate) json: bool,
}
