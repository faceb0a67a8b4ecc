//! Matrices of one element, split for functions that are even and odd about its middle.
//!
//! An element is symmetric: its matrices map even functions to even ones and odd to odd, or, those
//! of a first derivative, even to odd and odd to even. In this form half of a matrix is zero.
//!
//! Of n values the even part is s_i = x_i + x_(n-1-i), which for the middle node of an odd n is
//! twice its value; the odd part is d_i = x_i - x_(n-1-i). The values follow from both parts as
//! x_i = (s_i + d_i)/2 and x_(n-1-i) = (s_i - d_i)/2.

/// Maximum number of nodes in the even part: half of the 13 of degree 12, rounded up.
pub(super) const HALF: usize = 7;

/// Entry of column j and row i at `[j][i]`.
pub(super) type Half = [[f64; HALF]; HALF];

/// A matrix of an element, split into parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Halves {
    /// Its effect on the even part.
    pub(super) of_even: Half,
    /// Its effect on the odd part.
    pub(super) of_odd: Half,
}

impl Halves {
    /// Creates the matrix of `count` rows and columns with `entry(i, j)`, which is symmetric or
    /// antisymmetric about the middle.
    pub(super) fn new(count: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let mut halves = Self { of_even: [[0.0; HALF]; HALF], of_odd: [[0.0; HALF]; HALF] };
        for i in 0..count.div_ceil(2) {
            for j in 0..count / 2 {
                let mirrored = entry(i, count - 1 - j);
                halves.of_even[j][i] = entry(i, j) + mirrored;
                halves.of_odd[j][i] = entry(i, j) - mirrored;
            }
            if count % 2 == 1 {
                halves.of_even[count / 2][i] = entry(i, count / 2);
            }
        }
        halves
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::element::Element;
    use super::*;

    /// Returns the parts of `x`.
    fn parts(x: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let n = x.len();
        let even = (0..n.div_ceil(2)).map(|i| x[i] + x[n - 1 - i]).collect();
        let odd = (0..n / 2).map(|i| x[i] - x[n - 1 - i]).collect();
        (even, odd)
    }

    fn times(half: &Half, x: &[f64], rows: usize) -> Vec<f64> {
        (0..rows).map(|i| x.iter().enumerate().map(|(j, x)| half[j][i] * x).sum()).collect()
    }

    fn check(found: &[f64], expected: &[f64], what: &str) {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-11 * (1.0 + expected.abs()), "{what}");
        }
    }

    #[test]
    fn parts_of_a_product_are_products_of_parts() {
        for order in 2..=12 {
            let element = Element::new(order);
            let n = element.count();
            let x: Vec<f64> = (0..n).map(|i| libm::sin(3.7 * i as f64 + 0.4)).collect();
            let first = |i: usize, j: usize| element.derivative[i][j];
            let second =
                |i: usize, j: usize| (0..n).map(|m| first(i, m) * first(m, j)).sum::<f64>();
            let product = |entry: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
                (0..n).map(|i| (0..n).map(|j| entry(i, j) * x[j]).sum()).collect()
            };
            let (even, odd) = parts(&x);
            let halves = Halves::new(n, first);
            let (even_out, odd_out) = parts(&product(&first));
            check(&times(&halves.of_odd, &odd, even_out.len()), &even_out, "D, odd to even");
            check(&times(&halves.of_even, &even, odd_out.len()), &odd_out, "D, even to odd");
            let halves = Halves::new(n, second);
            let (even_out, odd_out) = parts(&product(&second));
            check(&times(&halves.of_even, &even, even_out.len()), &even_out, "D D, even");
            check(&times(&halves.of_odd, &odd, odd_out.len()), &odd_out, "D D, odd");
        }
    }
}
