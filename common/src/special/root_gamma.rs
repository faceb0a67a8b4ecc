//! The law of √(V/a), V gamma of shape a and scale 1: its mean and variance in closed form.

/// Shape from which the logarithm of the mean is a series in 1/a: differences of log-gamma
/// functions would lose what is left of a variance near 1/(4a).
const SERIES_SHAPE: f64 = 64.0;

/// Mean Γ(a + ½) / (Γ(a) √a), and 1 less its square, for shapes of at least 3.
pub(crate) fn root_gamma_moments(shape: f64) -> (f64, f64) {
    let ln_mean = if shape >= SERIES_SHAPE {
        ln_mean_series(shape)
    } else {
        libm::lgamma(shape + 0.5) - libm::lgamma(shape) - 0.5 * libm::log(shape)
    };
    (libm::exp(ln_mean), -libm::expm1(2.0 * ln_mean))
}

/// ln Γ(a + ½) - ln Γ(a) - ½ ln a from Stirling's series (DLMF 5.11.8); the next term is below
/// 2e-3 a⁻⁹.
fn ln_mean_series(shape: f64) -> f64 {
    let inverse = 1.0 / shape;
    let square = inverse * inverse;
    let series = (17.0 / 14_336.0_f64)
        .mul_add(-square, 1.0 / 640.0)
        .mul_add(-square, 1.0 / 192.0)
        .mul_add(-square, 1.0 / 8.0);
    -series * inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and variance by Python's `decimal` in 60 digits, from Stirling's series after shifting
    /// the shape above 60.
    #[test]
    fn moments_are_those_of_the_closed_form() {
        for (shape, mean, variance) in PINNED {
            let (found_mean, found_variance) = root_gamma_moments(shape);
            assert!((found_mean / mean - 1.0).abs() < 1e-13, "{shape}: {found_mean}");
            // Log-gamma functions of up to 200 leave some 1e-13 of a variance of 0.004 and more.
            let tolerance = if shape < SERIES_SHAPE { 1e-10 } else { 1e-14 };
            let error = (found_variance / variance - 1.0).abs();
            assert!(error < tolerance, "{shape}: {found_variance}");
        }
    }

    #[test]
    fn both_formulas_agree_where_they_meet() {
        let by_log_gamma = libm::lgamma(64.5) - libm::lgamma(64.0) - 0.5 * libm::log(64.0);
        let series = ln_mean_series(64.0);
        assert!((by_log_gamma - series).abs() < 1e-13, "{by_log_gamma} {series}");
    }

    const PINNED: [(f64, f64, f64); 8] = [
        (5.5, 0.9775593518547722, 0.04437771360127784),
        (9.875, 0.9874268748560763, 0.024988166811962687),
        (38.5, 0.9967586027103206, 0.006472287922969259),
        (63.5, 0.9980334525959002, 0.00392922749950702),
        (64.0, 0.9980488009354713, 0.0038985909512680313),
        (330.5, 0.9996218568324078, 0.00075614334292929),
        (3500.0, 0.9999642863521547, 7.14260202259638e-05),
        (70000000000.0, 0.9999999999982143, 3.5714285714221937e-12),
    ];
}
