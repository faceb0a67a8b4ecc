//! The arguments of commands for single realizations of a job.

use std::path::PathBuf;

use clap::Args;
use osteon_local::design::MeasurementPlan;

use super::{JobFileArguments, length, positive};

/// Arguments of `draw`.
#[derive(Debug, Args)]
pub(crate) struct DrawArguments {
    /// The job.
    #[command(flatten)]
    pub(crate) job: JobFileArguments,
    /// Index of the realization, from 0
    #[arg(long, value_name = "I")]
    pub(crate) index: u64,
    /// The point.
    #[command(flatten)]
    pub(crate) place: PlaceArguments,
}

/// Point of a job whose realizations are meant.
#[derive(Debug, Args)]
pub(crate) struct PlaceArguments {
    /// Use the best point of DIR/result.json instead of the job's fixed and start values
    #[arg(long, value_name = "DIR")]
    pub(crate) at: Option<PathBuf>,
    /// With --at, use the best point of this group of the data
    #[arg(long, value_name = "NAME", requires = "at")]
    pub(crate) group: Option<String>,
}

/// Arguments of `observe`.
#[derive(Debug, Args)]
pub(crate) struct ObserveArguments {
    /// The job.
    #[command(flatten)]
    pub(crate) job: JobFileArguments,
    /// The point.
    #[command(flatten)]
    pub(crate) place: PlaceArguments,
    /// Number of threads to compute on [default: all cores]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) threads: Option<u32>,
    /// New CSV file with one row for each realization
    #[arg(long, short, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Print the summary as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `synthesize`.
#[derive(Debug, Args)]
pub(crate) struct SynthesizeArguments {
    /// The job.
    #[command(flatten)]
    pub(crate) job: JobFileArguments,
    /// Number of measurements, each of a bone of its own, drawn by the job's law and seed (and none of the job's
    /// own realizations)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) series: u64,
    /// Level of the noise below the peak of the first packet, which is that of the mean bone, in the mean over
    /// the receivers (dB) [default: no noise]
    #[arg(long, value_name = "D", value_parser = level)]
    pub(crate) noise_db: Option<f64>,
    /// Standard deviation of the receivers' gains (dB). A receiver has the same gain in all measurements
    #[arg(long, value_name = "G", default_value = "0", value_parser = level)]
    pub(crate) gain_db: f64,
    /// Probability that a receiver records nothing in a measurement
    #[arg(long, value_name = "F", default_value = "0", value_parser = probability)]
    pub(crate) dropouts: f64,
    /// Largest pressure that is recorded, in peaks of the first packet [default: larger than any]
    #[arg(long, value_name = "R", value_parser = ratio)]
    pub(crate) full_scale: Option<f64>,
    /// Time between samples (seconds) [default: a fiftieth of the period of the centre frequency]
    #[arg(long, value_name = "S", value_parser = positive)]
    pub(crate) time_step: Option<f64>,
    /// Time of the last sample (seconds) [default: some periods after the first signal, before guided waves end]
    #[arg(long, value_name = "S", value_parser = positive)]
    pub(crate) duration: Option<f64>,
    /// Number of sources beyond each of the probe's own, which tell guided waves apart
    #[arg(long, value_name = "N", default_value = "0", requires = "source_pitch")]
    #[arg(value_parser = clap::value_parser!(u32).range(..=31))]
    pub(crate) further_sources: u32,
    /// Distance between neighbouring sources (m)
    #[arg(long, value_name = "M", value_parser = length)]
    pub(crate) source_pitch: Option<f64>,
    /// The point.
    #[command(flatten)]
    pub(crate) place: PlaceArguments,
    /// Number of threads to compute on [default: all cores]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) threads: Option<u32>,
    /// Directory for the signals (signals.npy), their description (probe.toml) and the model's velocities
    /// (truth.csv)
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
}

/// Arguments of `design`.
#[derive(Debug, Args)]
pub(crate) struct DesignArguments {
    /// The job.
    #[command(flatten)]
    pub(crate) job: JobFileArguments,
    /// Design about the best point of DIR/result.json instead of the job's fixed and start values
    #[arg(long, value_name = "DIR")]
    pub(crate) at: Option<PathBuf>,
    /// The group of the data that is meant, if the job has several
    #[arg(long, value_name = "NAME")]
    pub(crate) group: Option<String>,
    /// Rank all measurements for this quantity: bulk_velocity, or a parameter that the job searches
    /// [default: the best three for each]
    #[arg(long = "for", value_name = "NAME")]
    pub(crate) wanted: Vec<String>,
    /// Compare this measurement, instead of the usual ones: a0_velocity=1%, density=2% or density=30 (in its
    /// unit), velocities=1000, both_directions, frequency=0.5e6, height=4e-3, and likewise other observables,
    /// parameters and uncertain quantities of the setup; commas join what is measured together
    #[arg(long, value_name = "NAME=ACCURACY")]
    pub(crate) with: Vec<MeasurementPlan>,
    /// Number of velocities [default: that of the data, 100 of a job without data]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(5..=1_000_000_000))]
    pub(crate) velocities: Option<u64>,
    /// Number of threads to compute on [default: all cores]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) threads: Option<u32>,
    /// Print the design as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

fn level(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (0.0..=200.0).contains(&number) => Ok(number),
        _ => Err("it must be a number from 0 to 200 (dB)".to_owned()),
    }
}

fn probability(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (0.0..=0.5).contains(&number) => Ok(number),
        _ => Err("it must be a number from 0 to 0.5".to_owned()),
    }
}

fn ratio(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number <= 1e6 => Ok(number),
        _ => Err("it must be a number above 0 and at most 1e6".to_owned()),
    }
}
