//! The arguments of `pick`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `pick`.
#[derive(Debug, Args)]
pub(crate) struct PickArguments {
    /// Files of signals: CSV with the column time (s) and a column for each receiver, headed by its x1 (m), as
    /// `osteon simulate --out` writes them; or arrays of NumPy (.npy, .npz), MATLAB (.mat), HDF5 or SimSonic
    /// (.rcv2D)
    #[arg(value_name = "FILE", required = true)]
    pub(crate) files: Vec<PathBuf>,
    /// Probe file (TOML or JSON): probe, layers and picking as in a case file, and signals [default: the
    /// receivers of the file's header, and otherwise the defaults of a case file]
    #[arg(long, value_name = "PROBE.toml")]
    pub(crate) describe: Option<PathBuf>,
    /// Write a first probe file for FILE to the path of --out, or print it, and pick nothing
    #[arg(long, conflicts_with_all = ["describe", "json"])]
    pub(crate) init: bool,
    /// New file of the velocities (CSV)
    #[arg(long, short, value_name = "velocities.csv")]
    pub(crate) out: Option<PathBuf>,
    /// New file of the image of guided waves over frequency and wavenumber (SVG), in the mean over all series,
    /// with the waves that were found
    #[arg(long, value_name = "image.svg", conflicts_with = "init")]
    pub(crate) image: Option<PathBuf>,
    /// Draw the waves of the bone of this case over the image
    #[arg(long, value_name = "CASE.toml", requires = "image")]
    pub(crate) model: Option<PathBuf>,
    /// Of the model, draw the waves between coupling and marrow as half-spaces instead of those in a vacuum
    #[arg(long, requires = "model")]
    pub(crate) in_fluids: bool,
    /// Print velocities and times as JSON
    #[arg(long)]
    pub(crate) json: bool,
}
