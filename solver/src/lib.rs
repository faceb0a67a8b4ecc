//! Velocity of the first arriving signal of a fluid / anisotropic solid / fluid plate: the map
//! g_velo of the paper's Eq. (10). ("The paper" is Desceliers, Soize, Grimal, Talmant and Naili; see
//! `docs/physics.md`.)
//!
//! The exact method solves the layered medium for each frequency and wavenumber: the plate's
//! admittance by doubling (`plate.rs`, no roots, no branches, no degenerate solids), the fluids in
//! closed form. A cosine transform over wavenumbers and a damped Fourier series over frequencies give
//! a trigonometric polynomial in time at each receiver, and one of its extrema is picked for the whole
//! array.
//!
//! Pure: no I/O, no clock, no thread. A velocity's bits are a function of its [`Case`] alone;
//! tables shared between realizations depend only on layers, probe and solver settings.
//!
//! [`Case`]: osteon_common::case::Case

#![expect(clippy::needless_range_loop, reason = "matrix indices read as in the formulas")]

mod arrival;
pub mod check;
mod complex;
mod exact;
mod failure;
mod first_signal;
pub mod hybrid;
mod isa;
mod lanes;
mod media;
mod medium;
pub mod picking;
mod pulse;
mod quadrature;
mod solver;
mod vector;

pub use arrival::{Arrival, PassSummary, Sampled};
pub use complex::Complex;
pub use exact::guided::{
    FluidModes, GuidedWave, GuidedWaves, Mode, ModeShape, ModesError, ShapeError, ShapePoint,
};
#[cfg(feature = "measure")]
pub use exact::quantities::{admittance, fastest_wave, pressure};
#[cfg(feature = "measure")]
pub use exact::stages;
pub use exact::traces::{TraceError, Traces};
pub use failure::Failure;
pub use first_signal::{FirstSignal, ObservedRealization};
pub use hybrid::{Hybrid, HybridWorkspace};
pub use isa::{Isa, UnknownIsa};
pub use solver::{Solver, Workspace};
