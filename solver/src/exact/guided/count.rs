//! Counts the guided waves of one solid whose frequency is below a given one.

use super::family::{FACES, Family};
use crate::complex::Complex;
use crate::exact::factors::Symmetric;
use crate::exact::layer::Layer;
use crate::exact::plate::{AccuratePlate, Slice};
use crate::isa::Kernel;
use crate::lanes::Lanes;
use crate::medium::Medium;
use crate::vector::{ComplexVector, Vector};

/// Kernel that counts the waves of one solid below a frequency.
pub(super) struct CountWaves<'a> {
    pub(super) medium: &'a Medium,
    pub(super) plate: &'a mut AccuratePlate,
    pub(super) family: &'a Family,
    /// Wavenumber, rad/m.
    pub(super) k: f64,
    /// Frequency, rad/s.
    pub(super) omega: f64,
}

impl Kernel for CountWaves<'_> {
    type Output = Option<u64>;

    #[inline(always)]
    fn run<V: Vector>(self) -> Option<u64> {
        let Self { medium, plate, family, k, omega } = self;
        plate.prepare::<V>(medium, Complex::new(0.0, omega), (k, k));
        let Slice { mut layer, doublings, .. } = plate.thinnest(V::splat(k))?;
        // A slice is so thin that it has no wave between clamped faces.
        let mut clamped = 0_u64;
        for _ in 1..doublings {
            let joint =
                negative_pivots(&mut joint_matrix(&layer.joint()), &family.components, &[])?;
            clamped = clamped.checked_mul(2)?.checked_add(joint)?;
            layer = layer.double();
        }
        let middle = negative_pivots(&mut joint_matrix(&layer.joint()), &family.middle, &[])?;
        clamped = clamped.checked_mul(family.copies)?.checked_add(middle)?;
        let faces = negative_pivots(&mut face_matrix(&layer.double()), &family.faces, &[])?;
        clamped.checked_add(faces)
    }
}

/// An N×N array that holds a real symmetric matrix; a smaller one takes its upper left part.
pub(super) type Real<const N: usize> = [[f64; N]; N];

/// Returns the first lane of a number.
#[inline(always)]
pub(super) fn first_lane<V: Vector>(value: ComplexVector<V>) -> Complex {
    let (mut re, mut im) = (Lanes::ZERO, Lanes::ZERO);
    value.re.store(&mut re, 0);
    value.im.store(&mut im, 0);
    Complex::new(re.0[0], im.0[0])
}

/// Returns the stiffness of a joint, which is real without damping.
#[inline(always)]
pub(super) fn joint_matrix<V: Vector>(joint: &Symmetric<V>) -> Real<FACES> {
    let mut matrix = [[0.0; FACES]; FACES];
    for i in 0..3 {
        for j in 0..3 {
            matrix[i][j] = first_lane(joint[symmetric_entry(i, j)]).re;
        }
    }
    matrix
}

/// Returns the stiffness of both faces of a layer in the displacements p and q: with u = p + i q on top
/// and p - i q at the bottom, A = [`Layer::top`] and D = [`Layer::down`],
///
/// ```text
/// [ Re A - Re D, -Im A - Im D; its transpose, Re A + Re D ]
/// ```
#[inline(always)]
fn face_matrix<V: Vector>(layer: &Layer<V>) -> Real<FACES> {
    let mut matrix = [[0.0; FACES]; FACES];
    for i in 0..3 {
        for j in 0..3 {
            let top = first_lane(layer.top[3 * i + j]);
            let down = first_lane(layer.down[symmetric_entry(i, j)]);
            matrix[i][j] = top.re - down.re;
            matrix[i + 3][j + 3] = top.re + down.re;
            matrix[i][j + 3] = -(top.im + down.im);
            matrix[j + 3][i] = matrix[i][j + 3];
        }
    }
    matrix
}

/// Returns where entry (i, j) of a symmetric 3×3 matrix is stored.
#[inline(always)]
pub(super) fn symmetric_entry(i: usize, j: usize) -> usize {
    let (low, high) = if i < j { (i, j) } else { (j, i) };
    low * (5 - low) / 2 + high
}

/// Eliminates `rows` (and the same columns) of a matrix, which leaves `others` with the Schur complement.
/// Returns the number of negative pivots, which is that of the negative eigenvalues of the block of `rows`.
/// `None` if a pivot is zero or not finite.
#[inline(always)]
pub(super) fn negative_pivots<const N: usize>(
    matrix: &mut Real<N>,
    rows: &[usize],
    others: &[usize],
) -> Option<u64> {
    let (mut left, mut count) = ([0; N], rows.len());
    left[..count].copy_from_slice(rows);
    let mut negative = 0;
    while count > 0 {
        // The largest pivot first.
        let mut place = 0;
        for other in 1..count {
            let size = |place: usize| matrix[left[place]][left[place]].abs();
            if size(other) > size(place) {
                place = other;
            }
        }
        count -= 1;
        left.swap(place, count);
        let row = left[count];
        let pivot = matrix[row][row];
        if pivot == 0.0 || !pivot.is_finite() {
            return None;
        }
        negative += u64::from(pivot < 0.0);
        for &i in left[..count].iter().chain(others) {
            let factor = matrix[i][row] / pivot;
            for &j in left[..count].iter().chain(others) {
                matrix[i][j] = (-factor).mul_add(matrix[row][j], matrix[i][j]);
            }
        }
    }
    Some(negative)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pivots_have_the_signs_of_the_eigenvalues() {
        let mut matrix = [[0.0; FACES]; FACES];
        // Eigenvalues 3 and -1, and a row that is left out.
        (matrix[0][0], matrix[0][4], matrix[4][0], matrix[4][4]) = (1.0, 2.0, 2.0, 1.0);
        matrix[2][2] = -5.0;
        assert_eq!(negative_pivots(&mut matrix.clone(), &[0, 4], &[]), Some(1));
        assert_eq!(negative_pivots(&mut matrix.clone(), &[0, 2, 4], &[]), Some(2));
        assert_eq!(negative_pivots(&mut matrix.clone(), &[1], &[]), None);
        assert_eq!(symmetric_entry(2, 1), 4);
        // What remains of the other rows: -3 = 1 - 2²/1.
        assert_eq!(negative_pivots(&mut matrix, &[0], &[4]), Some(0));
        assert_eq!(matrix[4][4], -3.0);
    }
}
