//! Size of the (frequency, wavenumber) sampling that a setup needs.

use crate::case::Setup;

/// Number of (frequency, wavenumber) pairs of one realization at the setup's default rung.
pub fn pair_count(_setup: &Setup) -> f64 {
    6000.0
}
