//! Scalar complex numbers for the tables, with transcendental functions from `libm`.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A complex number.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Complex {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

impl Complex {
    /// re + i im.
    pub const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }

    /// The square root with a real part ≥ 0.
    pub fn sqrt(self) -> Self {
        let modulus = self.re.mul_add(self.re, self.im * self.im).sqrt();
        if modulus == 0.0 {
            return Self::default();
        }
        // The larger part first, the smaller from the product: no cancellation.
        let larger = (0.5 * (modulus + self.re.abs())).sqrt();
        let smaller = 0.5 * self.im / larger;
        if self.re >= 0.0 {
            Self::new(larger, smaller)
        } else {
            Self::new(smaller.abs(), larger.copysign(self.im))
        }
    }

    /// The exponential function.
    pub fn exp(self) -> Self {
        let modulus = libm::exp(self.re);
        let (sin, cos) = libm::sincos(self.im);
        Self::new(modulus * cos, modulus * sin)
    }

    /// self · factor.
    #[inline(always)]
    pub fn scale(self, factor: f64) -> Self {
        Self::new(self.re * factor, self.im * factor)
    }

    /// Squared modulus.
    #[inline(always)]
    pub fn norm_sqr(self) -> f64 {
        self.re.mul_add(self.re, self.im * self.im)
    }

    /// Modulus.
    #[inline(always)]
    pub fn abs(self) -> f64 {
        self.norm_sqr().sqrt()
    }

    /// Whether both parts are finite.
    pub fn is_finite(self) -> bool {
        self.re.is_finite() && self.im.is_finite()
    }
}

impl Add for Complex {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }
}

impl Sub for Complex {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, self.im - other.im)
    }
}

impl Mul for Complex {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::new(
            self.re.mul_add(other.re, -(self.im * other.im)),
            self.re.mul_add(other.im, self.im * other.re),
        )
    }
}

impl Div for Complex {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        (self * Self::new(other.re, -other.im)).scale(1.0 / other.norm_sqr())
    }
}

impl Neg for Complex {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.re, -self.im)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_square_back_and_lie_in_the_right_half_plane() {
        for z in [
            Complex::new(3.0, 4.0),
            Complex::new(-3.0, 1e-9),
            Complex::new(-3.0, -4.0),
            Complex::new(0.0, -2.0),
        ] {
            let root = z.sqrt();
            assert!(root.re >= 0.0);
            assert!((root * root - z).abs() < 1e-15 * z.abs(), "{z:?}");
        }
    }

    #[test]
    fn exponential_of_a_sum_is_a_product() {
        let (a, b) = (Complex::new(0.3, 2.0), Complex::new(-1.1, 0.7));
        assert!(((a + b).exp() - a.exp() * b.exp()).abs() < 1e-15);
    }
}
