//! From a probe's signals to velocities.
//!
//! [`reading`] takes signals from files, [`SeriesPicker`] finds the velocity of the first arriving signal of
//! each series, with a standard error, a quality and a typed failure. Which extremum is the first decides the
//! function that the solver uses for computed pressures (`osteon_solver::picking::array_rank`), so that model
//! and measurement follow one rule.
//!
//! The picking is a pure function: its bits depend on the signals and the probe alone.

#![forbid(unsafe_code)]

mod array_decision;
mod array_geometry;
mod array_signals;
mod band_filter;
mod consensus;
mod direction;
mod dot;
mod first_signal;
mod interpolation;
mod moveout_fit;
mod pick_failure;
mod picked_series;
pub mod reading;
mod reading_error;
mod receiver_pick;
mod receiver_signal;
mod series_pick;
mod stacked;
mod template;
mod waves;

pub use array_decision::PickRefusal;
pub use array_signals::{ArraySignals, SignalSeries};
pub use direction::VelocityEstimate;
pub use first_signal::FirstSignalEstimate;
pub use pick_failure::PickFailure;
pub use picked_series::{PickedSeries, to_csv, to_json};
pub use reading_error::{SignalFault, SignalFileError};
pub use receiver_pick::{MeasuredValue, ReceiverPick};
pub use series_pick::{SeriesPick, SeriesPicker};
pub use template::{own_description, template};
pub use waves::{
    DispersionImage, ImageGrid, WaveEstimate, WaveFailure, WaveFinder, WavePick, WaveTarget,
};
