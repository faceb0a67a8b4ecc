//! Eight independent systems side by side.
//!
//! Lanes never interact: the bits of each are those of a scalar computation, whatever the width of
//! the processor's registers. All operations are single IEEE operations (or explicit fused
//! multiply-adds), so every instruction set gives the same bits.

use std::ops::{Add, Mul, Neg, Sub};

/// Number of lanes, the same on every processor: blocks, and decisions about a block, must not
/// depend on the machine.
pub(crate) const LANES: usize = 8;

/// Eight real numbers.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Lanes(pub(crate) [f64; LANES]);

impl Lanes {
    pub(crate) const ZERO: Self = Self([0.0; LANES]);

    #[inline(always)]
    pub(crate) fn splat(value: f64) -> Self {
        Self([value; LANES])
    }

    /// self · factor + addend, rounded once.
    #[inline(always)]
    pub(crate) fn mul_add(self, factor: Self, addend: Self) -> Self {
        let mut out = addend;
        for i in 0..LANES {
            out.0[i] = self.0[i].mul_add(factor.0[i], addend.0[i]);
        }
        out
    }

    /// 1 / self.
    #[inline(always)]
    pub(crate) fn recip(self) -> Self {
        let mut out = self;
        for value in &mut out.0 {
            *value = 1.0 / *value;
        }
        out
    }

    /// The sum of the lanes, in one fixed order.
    #[inline(always)]
    pub(crate) fn sum(self) -> f64 {
        let l = self.0;
        ((l[0] + l[4]) + (l[2] + l[6])) + ((l[1] + l[5]) + (l[3] + l[7]))
    }
}

impl Add for Lanes {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let mut out = self;
        for i in 0..LANES {
            out.0[i] = self.0[i] + other.0[i];
        }
        out
    }
}

impl Sub for Lanes {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let mut out = self;
        for i in 0..LANES {
            out.0[i] = self.0[i] - other.0[i];
        }
        out
    }
}

impl Mul for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let mut out = self;
        for i in 0..LANES {
            out.0[i] = self.0[i] * other.0[i];
        }
        out
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let mut out = self;
        for value in &mut out.0 {
            *value = -*value;
        }
        out
    }
}

/// Eight complex numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ComplexLanes {
    pub(crate) re: Lanes,
    pub(crate) im: Lanes,
}

impl ComplexLanes {
    pub(crate) const ZERO: Self = Self { re: Lanes::ZERO, im: Lanes::ZERO };
}

impl Add for ComplexLanes {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }
}

impl Sub for ComplexLanes {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { re: self.re - other.re, im: self.im - other.im }
    }
}

impl Mul for ComplexLanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            re: self.re.mul_add(other.re, -(self.im * other.im)),
            im: self.re.mul_add(other.im, self.im * other.re),
        }
    }
}

impl Neg for ComplexLanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { re: -self.re, im: -self.im }
    }
}
