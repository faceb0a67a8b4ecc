//! The covariance of unknown parameters after measurements that depend on them linearly.

/// The covariance of unknowns, each in units of the standard deviation that it has before all measurements.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Knowledge {
    covariance: Vec<Vec<f64>>,
}

impl Knowledge {
    /// Creates that of independent unknowns before any measurement.
    pub(super) fn prior(unknowns: usize) -> Self {
        let row = |i: usize| (0..unknowns).map(|j| f64::from(u8::from(i == j))).collect();
        Self { covariance: (0..unknowns).map(row).collect() }
    }

    /// Takes up a measurement with an error of this variance, of a number whose derivatives by the unknowns are
    /// these (R. E. Kalman, J. Basic Eng. 82 (1960)).
    pub(super) fn measure(&mut self, derivatives: &[f64], variance: f64) {
        let moved = self.product(derivatives);
        let whole = dot(derivatives, &moved) + variance;
        for (row, own) in self.covariance.iter_mut().zip(&moved) {
            row.iter_mut().zip(&moved).for_each(|(entry, other)| *entry -= own * other / whole);
        }
    }

    /// Takes up several measurements whose errors have this covariance. A measurement whose error follows from those
    /// before it is left out, since it tells nothing that they do not.
    pub(super) fn measure_together(&mut self, derivatives: &[Vec<f64>], covariance: &[Vec<f64>]) {
        // Rows of the inverse of the Cholesky factor make the errors independent, with variance 1.
        let mut factor: Vec<Vec<f64>> = Vec::new();
        let mut whitened: Vec<Vec<f64>> = Vec::new();
        for (derivatives, errors) in derivatives.iter().zip(covariance) {
            let mut row: Vec<f64> = Vec::new();
            for (k, earlier) in factor.iter().enumerate() {
                row.push((errors[k] - dot(&row, &earlier[..k])) / earlier[k]);
            }
            let own = errors[factor.len()];
            let left = own - dot(&row, &row);
            if left <= NEGLIGIBLE * own {
                return;
            }
            let diagonal = left.sqrt();
            let mut rest = derivatives.clone();
            for (by, earlier) in row.iter().zip(&whitened) {
                rest.iter_mut().zip(earlier).for_each(|(entry, known)| *entry -= by * known);
            }
            rest.iter_mut().for_each(|entry| *entry /= diagonal);
            self.measure(&rest, 1.0);
            row.push(diagonal);
            factor.push(row);
            whitened.push(rest);
        }
    }

    /// Returns the standard deviation of a number with these derivatives.
    pub(super) fn deviation(&self, derivatives: &[f64]) -> f64 {
        dot(derivatives, &self.product(derivatives)).max(0.0).sqrt()
    }

    fn product(&self, derivatives: &[f64]) -> Vec<f64> {
        self.covariance.iter().map(|row| dot(row, derivatives)).collect()
    }
}

/// Part of an error's variance below which it follows from others.
const NEGLIGIBLE: f64 = 1e-12;

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-12, "{found} instead of {expected}");
    }

    #[test]
    fn a_measurement_halves_a_variance_that_is_its_own() {
        let mut known = Knowledge::prior(2);
        known.measure(&[1.0, 0.0], 1.0);
        check(known.deviation(&[1.0, 0.0]), 0.5_f64.sqrt());
        check(known.deviation(&[0.0, 1.0]), 1.0);
    }

    /// A sum is known, its terms are not.
    #[test]
    fn what_is_measured_together_stays_together() {
        let mut known = Knowledge::prior(2);
        known.measure(&[1.0, 1.0], 1e-9);
        assert!(known.deviation(&[1.0, 1.0]) < 1e-4);
        assert!((known.deviation(&[1.0, 0.0]) - 0.5_f64.sqrt()).abs() < 1e-9);
    }

    /// With a common error of two measurements their difference is known better than either.
    #[test]
    fn common_errors_cancel() {
        let mut known = Knowledge::prior(2);
        let covariance = [vec![1.01, 1.0], vec![1.0, 1.01]];
        known.measure_together(&[vec![1.0, 0.0], vec![0.0, 1.0]], &covariance);
        // By the inverse of prior and noise together: (I + C⁻¹)⁻¹ = C (C + I)⁻¹, along both diagonals.
        for (sign, noise) in [(1.0, 2.01), (-1.0, 0.01_f64)] {
            let along = [0.5_f64.sqrt(), sign * 0.5_f64.sqrt()];
            check(known.deviation(&along), (noise / (1.0 + noise)).sqrt());
        }
    }

    #[test]
    fn a_repeated_measurement_tells_nothing_more() {
        let mut once = Knowledge::prior(1);
        once.measure(&[1.0], 0.5);
        let mut twice = Knowledge::prior(1);
        twice.measure_together(&[vec![1.0], vec![1.0]], &[vec![0.5, 0.5], vec![0.5, 0.5]]);
        check(twice.deviation(&[1.0]), once.deviation(&[1.0]));
    }
}
