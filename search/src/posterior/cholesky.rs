//! Cholesky factors that grow by rows, in a fixed order of operations: the libraries for it choose
//! their order by processor, and results must not depend on that.

/// Lower triangular factor L of a symmetric positive definite matrix L Lᵀ.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Cholesky {
    rows: Vec<Vec<f64>>,
}

impl Cholesky {
    /// Appends a row of the matrix, up to and with the diagonal, if the square of the new pivot is
    /// above `square_min`, at least 0; returns whether it is.
    pub(super) fn push(&mut self, row: &[f64], square_min: f64) -> bool {
        let Some((&diagonal, others)) = row.split_last() else { return false };
        let mut new = self.solve_lower(others);
        let pivot = diagonal - dot(&new, &new);
        if !(pivot > square_min && pivot.is_finite()) {
            return false;
        }
        new.push(pivot.sqrt());
        self.rows.push(new);
        true
    }

    /// Returns L⁻¹ b.
    pub(super) fn solve_lower(&self, b: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = Vec::with_capacity(b.len() + 1);
        for (row, b) in self.rows.iter().zip(b) {
            let k = x.len();
            let rest = b - dot(&row[..k], &x);
            x.push(rest / row[k]);
        }
        x
    }

    /// Returns (L Lᵀ)⁻¹ b.
    pub(super) fn solve(&self, b: &[f64]) -> Vec<f64> {
        let mut x = self.solve_lower(b);
        for k in (0..x.len()).rev() {
            let solved = x[k] / self.rows[k][k];
            x[k] = solved;
            x[..k].iter_mut().zip(&self.rows[k]).for_each(|(x, l)| *x -= l * solved);
        }
        x
    }

    /// Returns L x.
    pub(super) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| dot(row, &x[..row.len()])).collect()
    }

    /// Returns half the logarithm of the determinant.
    pub(super) fn half_log_determinant(&self) -> f64 {
        self.rows.iter().enumerate().map(|(k, row)| libm::log(row[k])).sum()
    }
}

/// Returns the sum of products, in four interleaved parts.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0_f64; 4];
    let (a4, a_rest) = a.as_chunks::<4>();
    let (b4, b_rest) = b.as_chunks::<4>();
    for (a, b) in a4.iter().zip(b4) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    let mut sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
    for (a, b) in a_rest.iter().zip(b_rest) {
        sum += a * b;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_solve_their_matrix() {
        let matrix = [[4.0, 2.0, 0.6], [2.0, 5.0, 1.0], [0.6, 1.0, 3.0]];
        let mut factor = Cholesky::default();
        for (k, row) in matrix.iter().enumerate() {
            assert!(factor.push(&row[..=k], 0.0));
        }
        let x = factor.solve(&[1.0, 2.0, 3.0]);
        for (row, b) in matrix.iter().zip([1.0, 2.0, 3.0]) {
            assert!((dot(row, &x) - b).abs() < 1e-12);
        }
        // The determinant of the matrix is 44.6.
        assert!((2.0 * factor.half_log_determinant() - libm::log(44.6)).abs() < 1e-12);
        assert!(!factor.push(&[4.0, 2.0, 0.6, 0.1], 0.0), "not positive definite");
    }

    #[test]
    fn sums_of_products_are_complete() {
        let a: Vec<f64> = (1..=7).map(f64::from).collect();
        assert_eq!(dot(&a, &a), 140.0);
    }
}
