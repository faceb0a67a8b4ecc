//! Quantile functions of the standard normal and of the gamma law, on `libm` alone: the same bits
//! on every platform.
//!
//! They transform uniform germs into the entries of the random matrix by the inverse distribution
//! function, so that a realization is a continuous function of the parameters of its law.

mod chi_square;
mod gamma;
mod normal;
mod root_gamma;

pub(crate) use chi_square::chi_square_quantile;
pub use gamma::GammaQuantile;
pub use normal::{normal_probability, standard_normal_quantile};
pub(crate) use root_gamma::root_gamma_moments;
