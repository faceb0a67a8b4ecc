//! Small dense complex matrices, and determinants that may be beyond the range of a number.

use crate::complex::Complex;

/// A 3×3 matrix, by rows.
pub(super) type ComplexMatrix3 = [[Complex; 3]; 3];

/// The matrix of zeros.
pub(super) const ZERO: ComplexMatrix3 = [[Complex::new(0.0, 0.0); 3]; 3];
/// The unit matrix.
pub(super) const UNIT: ComplexMatrix3 = {
    let mut unit = ZERO;
    unit[0][0] = Complex::new(1.0, 0.0);
    unit[1][1] = unit[0][0];
    unit[2][2] = unit[0][0];
    unit
};

/// A complex number times a power of two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scaled {
    /// Its modulus is near one, or zero.
    mantissa: Complex,
    exponent: i32,
}

impl Scaled {
    pub(super) fn new(value: Complex) -> Self {
        Self { mantissa: value, exponent: 0 }.normal()
    }

    fn normal(self) -> Self {
        let (_, exponent) = libm::frexp(self.mantissa.re.abs().max(self.mantissa.im.abs()));
        let [re, im] =
            [self.mantissa.re, self.mantissa.im].map(|part| libm::ldexp(part, -exponent));
        Self { mantissa: Complex::new(re, im), exponent: self.exponent.saturating_add(exponent) }
    }

    pub(super) fn times(self, other: Self) -> Self {
        let exponent = self.exponent.saturating_add(other.exponent);
        Self { mantissa: self.mantissa * other.mantissa, exponent }.normal()
    }

    /// Returns self / `other` as a number.
    pub(super) fn over(self, other: Self) -> Complex {
        let ratio = self.mantissa / other.mantissa;
        let exponent = self.exponent.saturating_sub(other.exponent);
        Complex::new(libm::ldexp(ratio.re, exponent), libm::ldexp(ratio.im, exponent))
    }
}

/// Returns a - b c.
#[inline(always)]
pub(super) fn minus_product(
    a: &ComplexMatrix3,
    b: &ComplexMatrix3,
    c: &ComplexMatrix3,
) -> ComplexMatrix3 {
    let mut result = *a;
    for i in 0..3 {
        for j in 0..3 {
            for m in 0..3 {
                result[i][j] = result[i][j] - b[i][m] * c[m][j];
            }
        }
    }
    result
}

/// Returns b c.
#[inline(always)]
pub(super) fn product(b: &ComplexMatrix3, c: &ComplexMatrix3) -> ComplexMatrix3 {
    let mut result = ZERO;
    for i in 0..3 {
        for j in 0..3 {
            for m in 0..3 {
                result[i][j] = result[i][j] + b[i][m] * c[m][j];
            }
        }
    }
    result
}

/// Returns the inverse by cofactors.
#[inline(always)]
pub(super) fn inverse(a: &ComplexMatrix3) -> ComplexMatrix3 {
    let mut cofactors = ZERO;
    for i in 0..3 {
        for j in 0..3 {
            let (r, s) = ((i + 1) % 3, (i + 2) % 3);
            let (p, q) = ((j + 1) % 3, (j + 2) % 3);
            cofactors[i][j] = a[r][p] * a[s][q] - a[r][q] * a[s][p];
        }
    }
    let mut determinant = Complex::default();
    for j in 0..3 {
        determinant = determinant + a[0][j] * cofactors[0][j];
    }
    let mut result = ZERO;
    for i in 0..3 {
        for j in 0..3 {
            result[j][i] = cofactors[i][j] / determinant;
        }
    }
    result
}

/// Returns the determinant of these rows and columns of a matrix, by elimination with the largest pivot of each
/// column.
#[inline(always)]
pub(super) fn determinant<const N: usize>(matrix: &[[Complex; N]; N], rows: &[usize]) -> Scaled {
    let mut a = [[Complex::default(); N]; N];
    for (i, &row) in rows.iter().enumerate() {
        for (j, &column) in rows.iter().enumerate() {
            a[i][j] = matrix[row][column];
        }
    }
    let mut product = Scaled::new(Complex::new(1.0, 0.0));
    for column in 0..rows.len() {
        let mut largest = column;
        for row in column + 1..rows.len() {
            if a[row][column].norm_sqr() > a[largest][column].norm_sqr() {
                largest = row;
            }
        }
        let mut pivot = a[largest][column];
        if largest != column {
            a.swap(largest, column);
            pivot = -pivot;
        }
        product = product.times(Scaled::new(pivot));
        pivot = a[column][column];
        if pivot.norm_sqr() == 0.0 {
            return product;
        }
        for row in column + 1..rows.len() {
            let factor = a[row][column] / pivot;
            for other in column..rows.len() {
                a[row][other] = a[row][other] - factor * a[column][other];
            }
        }
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix without symmetry.
    fn matrix() -> ComplexMatrix3 {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let (x, y) = (i as f64, j as f64);
                Complex::new(1.0 / (1.0 + x + 2.0 * y), 0.3 * x - 0.2 * y * y)
            })
        })
    }

    #[test]
    fn a_matrix_times_its_inverse_is_the_unit_matrix() {
        let nothing = minus_product(&UNIT, &matrix(), &inverse(&matrix()));
        assert!(nothing.iter().flatten().all(|entry| entry.abs() < 1e-14), "{nothing:?}");
    }

    #[test]
    fn determinants_are_multiplied_beyond_the_range_of_numbers() {
        let mut both = [[Complex::default(); 6]; 6];
        let (one, other) = (matrix(), inverse(&matrix()));
        for i in 0..3 {
            for j in 0..3 {
                both[2 * i][2 * j] = one[i][j].scale(1e150);
                both[2 * i + 1][2 * j + 1] = other[i][j].scale(1e150);
            }
        }
        let unit = Scaled::new(Complex::new(1e150, 0.0));
        let large = [unit; 5].into_iter().fold(unit, Scaled::times);
        let check = |found: Complex, expected: Complex| {
            assert!((found - expected).abs() < 1e-13, "{found:?}, {expected:?}");
        };
        check(determinant(&both, &[0, 1, 2, 3, 4, 5]).over(large), Complex::new(1.0, 0.0));
        // Of two rows: a d - b c.
        let expected = one[0][0] * one[2][2] - one[0][2] * one[2][0];
        check(determinant(&one, &[0, 2]).over(Scaled::new(Complex::new(1.0, 0.0))), expected);
    }
}
