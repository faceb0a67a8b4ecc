//! Guided waves in the signals of an array: their image over wavenumber and frequency, and phase velocities.
//!
//! The method is that of J.-G. Minonzio, M. Talmant and P. Laugier, J. Acoust. Soc. Am. 127 (2010) 2913. At each
//! frequency the spectra of all receivers and sources on one side are a matrix. Its singular vectors above a
//! threshold span the signals' space, and a wave of wavenumber k is there if the vector of its phases lies within.

mod dispersion_image;
mod phase_velocity;
mod response_matrix;
mod signal_subspace;
mod singular_vectors;
mod wave_failure;

pub use self::dispersion_image::{DispersionImage, ImageGrid};
pub use self::phase_velocity::{WaveEstimate, WaveFinder, WavePick, WaveTarget};
pub use self::wave_failure::WaveFailure;
