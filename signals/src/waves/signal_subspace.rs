//! The space of an array's signals at one frequency, and how much of a plane wave lies within.

use osteon_solver::Complex;

use super::response_matrix::ResponseMatrix;
use super::singular_vectors::{SingularVector, product, singular_vectors};

/// Singular values of noise alone are smaller than this multiple of what they are in the mean for many receivers
/// and sources, σ (√N + √M), but in one of a thousand matrices.
const NOISE_EDGE: f64 = 1.2;

/// A singular value within this many standard deviations of the noise about the threshold may be on either side.
const DOUBT: f64 = 4.0;

/// The space that the waves at one frequency span.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SignalSubspace {
    /// Places of the receivers, m.
    positions: Vec<f64>,
    /// Its vectors, with their singular values.
    vectors: Vec<SingularVector>,
    /// A space that differs by one vector, which might be that of the waves as well.
    other: Option<Vec<SingularVector>>,
    /// Standard deviation of the noise of an element of the matrix.
    noise: f64,
}

/// The squared length of a plane wave's part in the space, and its derivatives with respect to the wavenumber.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NormShape {
    pub(super) value: f64,
    pub(super) slope: f64,
    pub(super) curvature: f64,
}

impl SignalSubspace {
    /// Finds the space: that of the singular vectors above noise whose values are at least `threshold` times the
    /// largest.
    pub(super) fn new(positions: &[f64], response: ResponseMatrix, threshold: f64) -> Self {
        let sources = response.columns.len();
        let mut vectors = singular_vectors(response.columns);
        let noise = response.noise.unwrap_or(0.0);
        let size = (positions.len() as f64).sqrt() + (sources as f64).sqrt();
        let largest = vectors.first().map_or(0.0, |one| one.value);
        let least = (threshold * largest).max(NOISE_EDGE * noise * size);
        let kept = vectors.iter().filter(|one| one.value >= least).count();
        let is_doubtful = |place: usize| {
            let value = vectors.get(place).map(|one| one.value);
            value.is_some_and(|value| (value - least).abs() < DOUBT * noise)
        };
        let other = match kept {
            _ if is_doubtful(kept) => Some(kept + 1),
            2.. if is_doubtful(kept - 1) => Some(kept - 1),
            _ => None,
        };
        let other = other.map(|count| vectors[..count].to_vec());
        vectors.truncate(kept);
        // With the places near 0, their products with wavenumbers are small and exact.
        let from = positions.first().copied().unwrap_or_default();
        let positions = positions.iter().map(|place| place - from).collect();
        Self { positions, vectors, other, noise }
    }

    /// Returns a space with one vector more or less, if noise decides which is that of the waves.
    pub(super) fn other_choice(&self) -> Option<Self> {
        let vectors = self.other.clone()?;
        Some(Self { positions: self.positions.clone(), vectors, other: None, noise: self.noise })
    }

    /// Returns whether it has no wave.
    pub(super) fn is_empty(&self) -> bool {
        self.vectors.is_empty()
    }

    /// Returns the squared length, 0 to 1, of the part of a plane wave of wavenumber `k`, rad/m, that lies within.
    pub(super) fn norm(&self, k: f64) -> f64 {
        let wave = self.plane_wave(k);
        self.vectors.iter().map(|one| product(&one.left, &wave).norm_sqr()).sum()
    }

    /// Returns the same with its derivatives.
    pub(super) fn shape(&self, k: f64) -> NormShape {
        let wave = self.plane_wave(k);
        let first = self.derived(&wave);
        let second = self.derived(&first);
        let mut shape = NormShape { value: 0.0, slope: 0.0, curvature: 0.0 };
        for one in &self.vectors {
            let [part, slope, bend] = [&wave, &first, &second].map(|it| product(&one.left, it));
            shape.value += part.norm_sqr();
            shape.slope += 2.0 * real_product(part, slope);
            shape.curvature += 2.0 * (slope.norm_sqr() + real_product(part, bend));
        }
        shape
    }

    /// Returns the standard error that the noise gives the wavenumber of a maximum at `k`, rad/m.
    ///
    /// Noise E turns the space to first order by δP = P⊥ E R⁺ and its adjoint, R⁺ being the pseudoinverse of the
    /// kept part of the matrix. The maximum moves by minus the change of the slope, which is linear in E, divided
    /// by the curvature.
    pub(super) fn standard_error(&self, k: f64) -> f64 {
        let wave = self.plane_wave(k);
        let slope = self.derived(&wave);
        let [(wave_out, wave_back), (slope_out, slope_back)] =
            [&wave, &slope].map(|vector| self.outside_and_back(vector));
        let square = |one: &[Complex]| product(one, one).re;
        let cross = product(&slope_out, &wave_out) * product(&slope_back, &wave_back);
        let sum: f64 = square(&slope_out) * square(&wave_back)
            + square(&wave_out) * square(&slope_back)
            + 2.0 * cross.re;
        self.noise * (2.0 * sum.max(0.0)).sqrt() / self.shape(k).curvature.abs()
    }

    /// Returns the part of a vector that is not in the space, and what the pseudoinverse makes of it, by its
    /// coordinates along the right singular vectors.
    fn outside_and_back(&self, vector: &[Complex]) -> (Vec<Complex>, Vec<Complex>) {
        let parts: Vec<Complex> =
            self.vectors.iter().map(|one| product(&one.left, vector)).collect();
        let mut outside = vector.to_vec();
        for (one, part) in self.vectors.iter().zip(&parts) {
            for (z, left) in outside.iter_mut().zip(&one.left) {
                *z = *z - *left * *part;
            }
        }
        let back = self.vectors.iter().zip(&parts).map(|(one, part)| part.scale(1.0 / one.value));
        (outside, back.collect())
    }

    /// Returns the phases of a wave at the receivers, exp(-ikx), with the length 1.
    fn plane_wave(&self, k: f64) -> Vec<Complex> {
        let size = 1.0 / (self.positions.len() as f64).sqrt();
        let phase = |place: &f64| {
            let (sin, cos) = libm::sincos(-k * place);
            Complex::new(size * cos, size * sin)
        };
        self.positions.iter().map(phase).collect()
    }

    /// Returns the derivative of a vector of phases with respect to the wavenumber.
    fn derived(&self, wave: &[Complex]) -> Vec<Complex> {
        let turned = |(place, z): (&f64, &Complex)| Complex::new(place * z.im, -place * z.re);
        self.positions.iter().zip(wave).map(turned).collect()
    }
}

/// Returns the real part of the product of a number's conjugate with another.
fn real_product(one: Complex, other: Complex) -> f64 {
    one.re.mul_add(other.re, one.im * other.im)
}
