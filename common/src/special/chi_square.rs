//! Quantiles of the χ² law.

use super::gamma::GammaQuantile;

/// Shape of the gamma law from which its quantile function is accurate.
const SHAPE_MIN: f64 = 3.0;
/// Halvings of an interval of logarithms, which end at rounding error.
const HALVINGS: usize = 64;
/// Most terms of the series; fewer than 100 are needed for these shapes.
const TERMS_MAX: u32 = 400;

/// Returns the quantile at `u`, 0 < u < 1, of the χ² law with `freedom` degrees of freedom, above 0
/// and not necessarily whole; right to 1e-12.
pub(crate) fn chi_square_quantile(freedom: f64, u: f64) -> f64 {
    let shape = 0.5 * freedom;
    if shape >= SHAPE_MIN {
        return 2.0 * GammaQuantile::new(shape).quantile(u);
    }
    let scale = libm::lgamma(shape);
    let (mut lower, mut upper) = (libm::log(1e-300), libm::log(1e3));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (lower + upper);
        let x = libm::exp(middle);
        let probability = libm::exp(shape * middle - x - scale) * series(shape, x);
        if probability < u {
            lower = middle;
        } else {
            upper = middle;
        }
    }
    2.0 * libm::exp(0.5 * (lower + upper))
}

/// Returns P(a, x) Γ(a) eˣ / xᵃ by its series of positive terms, DLMF 8.11.4.
fn series(shape: f64, x: f64) -> f64 {
    let (mut term, mut sum) = (1.0 / shape, 1.0 / shape);
    for k in 1..=TERMS_MAX {
        term *= x / (shape + f64::from(k));
        sum += term;
        if term < 1e-17 * sum {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::special::standard_normal_quantile;

    /// With one degree of freedom it is the square of a normal quantile, with two a logarithm.
    #[test]
    fn quantiles_are_right_for_few_degrees_of_freedom() {
        for u in [0.025, 0.3, 0.5, 0.975] {
            let z = standard_normal_quantile(0.5 * (1.0 + u));
            let found = [chi_square_quantile(1.0, u), chi_square_quantile(2.0, u)];
            let expected = [z * z, -2.0 * libm::log1p(-u)];
            for (found, expected) in found.into_iter().zip(expected) {
                assert!((found / expected - 1.0).abs() < 1e-10, "{u}: {found}, {expected}");
            }
        }
    }

    /// Compares with tables (M. Abramowitz and I. A. Stegun 1964, Table 26.8), and both sides of the
    /// change of method.
    #[test]
    fn quantiles_are_those_of_tables() {
        for (freedom, u, expected) in [
            (4.0, 0.025, 0.484_419),
            (4.0, 0.975, 11.1433),
            (9.0, 0.025, 2.70039),
            (9.0, 0.975, 19.0228),
            (49.0, 0.975, 70.2224),
        ] {
            let found = chi_square_quantile(freedom, u);
            assert!((found / expected - 1.0).abs() < 5e-6, "{freedom} {u}: {found}");
        }
        for u in [0.025, 0.975] {
            let [below, above] = [6.0 - 1e-9, 6.0].map(|freedom| chi_square_quantile(freedom, u));
            assert!((below / above - 1.0).abs() < 2e-9, "{below} {above}");
        }
    }
}
