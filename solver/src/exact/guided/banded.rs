//! Systems of equations with a banded complex matrix.

use crate::complex::Complex;

/// A square matrix whose entries are zero farther than `half` from the diagonal.
pub(super) struct BandedMatrix {
    size: usize,
    half: usize,
    /// By columns. Above the band there is room for what exchanging rows moves there.
    entries: Vec<Complex>,
}

impl BandedMatrix {
    /// Returns the matrix of zeros.
    pub(super) fn zeros(size: usize, half: usize) -> Self {
        Self { size, half, entries: vec![Complex::default(); size * (3 * half + 1)] }
    }

    /// Sets an entry within the band.
    #[inline(always)]
    pub(super) fn set(&mut self, row: usize, column: usize, value: Complex) {
        let place = self.place(row, column);
        self.entries[place] = value;
    }

    /// Replaces right sides by their solutions, by elimination with the largest pivot of each column. A pivot
    /// of zero is replaced by rounding, so that a singular matrix has a solution, a very large one.
    #[inline(always)]
    pub(super) fn solve<const N: usize>(mut self, sides: &mut [Vec<Complex>; N]) {
        let largest =
            self.entries.iter().fold(0.0, |max: f64, entry| max.max(entry.norm_sqr())).sqrt();
        for column in 0..self.size {
            let last = (column + self.half).min(self.size - 1);
            let mut best = column;
            for row in column + 1..=last {
                if self.at(row, column).norm_sqr() > self.at(best, column).norm_sqr() {
                    best = row;
                }
            }
            let end = (column + 2 * self.half).min(self.size - 1);
            if best != column {
                for other in column..=end {
                    let (one, two) = (self.place(best, other), self.place(column, other));
                    self.entries.swap(one, two);
                }
                for side in &mut *sides {
                    side.swap(best, column);
                }
            }
            if self.at(column, column).norm_sqr() == 0.0 {
                self.set(column, column, Complex::new(f64::EPSILON * largest, 0.0));
            }
            let pivot = self.at(column, column);
            for row in column + 1..=last {
                let factor = self.at(row, column) / pivot;
                for other in column + 1..=end {
                    let value = self.at(row, other) - factor * self.at(column, other);
                    self.set(row, other, value);
                }
                for side in &mut *sides {
                    side[row] = side[row] - factor * side[column];
                }
            }
        }
        for side in sides {
            self.substitute(side);
        }
    }

    /// Solves the upper triangle that elimination leaves.
    #[inline(always)]
    fn substitute(&self, side: &mut [Complex]) {
        for row in (0..self.size).rev() {
            let end = (row + 2 * self.half).min(self.size - 1);
            let mut value = side[row];
            for column in row + 1..=end {
                value = value - self.at(row, column) * side[column];
            }
            side[row] = value / self.at(row, row);
        }
    }

    #[inline(always)]
    fn at(&self, row: usize, column: usize) -> Complex {
        self.entries[self.place(row, column)]
    }

    #[inline(always)]
    fn place(&self, row: usize, column: usize) -> usize {
        column * (3 * self.half + 1) + row + 2 * self.half - column
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solutions_fulfil_their_equations() {
        let (size, half) = (23, 3_usize);
        // The diagonal is small, so that rows are exchanged.
        let entry = |row: usize, column: usize| {
            let (x, y) = (row as f64, column as f64);
            let weight = if row == column { 1e-3 } else { 1.0 };
            Complex::new(libm::sin(3.0 * x + 7.0 * y), libm::cos(x * y)).scale(weight)
        };
        let mut matrix = BandedMatrix::zeros(size, half);
        for row in 0..size {
            for column in row.saturating_sub(half)..=(row + half).min(size - 1) {
                matrix.set(row, column, entry(row, column));
            }
        }
        let side = |row: usize| Complex::new(1.0, row as f64);
        let mut sides = [(0..size).map(side).collect::<Vec<_>>()];
        matrix.solve(&mut sides);
        for row in 0..size {
            let columns = row.saturating_sub(half)..=(row + half).min(size - 1);
            let sum = columns.fold(Complex::default(), |sum, column| {
                sum + entry(row, column) * sides[0][column]
            });
            assert!((sum - side(row)).abs() < 1e-11, "{row}: {sum:?}");
        }
    }
}
