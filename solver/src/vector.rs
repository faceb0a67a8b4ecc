//! Registers: several independent real numbers that are processed side by side.
//!
//! A kernel is written once, generic over [`Vector`], and compiled for each width. Lanes never
//! interact and every operation is one IEEE operation or one explicit fused multiply-add, so the
//! bits of each lane are those of a scalar computation, whatever the width.

#![expect(
    unsafe_code,
    reason = "registers are the processor's own, with instructions that the compiler does not choose by itself"
)]

use crate::lanes::{ComplexLanes, LANES, Lanes};

/// A register of `WIDTH` numbers; `WIDTH` divides [`LANES`].
pub(crate) trait Vector: Copy {
    /// Numbers in a register.
    const WIDTH: usize;

    /// The same number in every lane.
    fn splat(value: f64) -> Self;

    /// Part `part` of eight numbers: those from `part` · `WIDTH` on.
    fn load(lanes: &Lanes, part: usize) -> Self;

    /// Writes the numbers that [`Vector::load`] reads.
    fn store(self, lanes: &mut Lanes, part: usize);

    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn neg(self) -> Self;

    /// 1 / self.
    fn recip(self) -> Self;

    fn sqrt(self) -> Self;

    /// self · factor + addend, rounded once.
    fn mul_add(self, factor: Self, addend: Self) -> Self;

    /// self · factor - subtrahend, rounded once.
    fn mul_sub(self, factor: Self, subtrahend: Self) -> Self;

    /// minuend - self · factor, rounded once.
    fn mul_sub_from(self, factor: Self, minuend: Self) -> Self;

    /// Parts of eight numbers.
    const PARTS: usize = LANES / Self::WIDTH;
}

/// One number, for processors without a known vector extension.
#[derive(Clone, Copy)]
pub(crate) struct Scalar(f64);

impl Vector for Scalar {
    const WIDTH: usize = 1;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(value)
    }

    #[inline(always)]
    fn load(lanes: &Lanes, part: usize) -> Self {
        Self(lanes.0[part])
    }

    #[inline(always)]
    fn store(self, lanes: &mut Lanes, part: usize) {
        lanes.0[part] = self.0;
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }

    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }

    #[inline(always)]
    fn recip(self) -> Self {
        Self(1.0 / self.0)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(self.0.mul_add(factor.0, addend.0))
    }

    #[inline(always)]
    fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
        Self(self.0.mul_add(factor.0, -subtrahend.0))
    }

    #[inline(always)]
    fn mul_sub_from(self, factor: Self, minuend: Self) -> Self {
        Self((-self.0).mul_add(factor.0, minuend.0))
    }
}

/// Implements [`Vector`] by the intrinsics of one instruction set.
macro_rules! vector {
    ($(#[$doc:meta])* $name:ident, $register:ty, $width:expr, $splat:path, $load:path, $store:path,
     $add:path, $sub:path, $mul:path, $div:path, $sqrt:path, $mul_add:path, $mul_sub:path, $mul_sub_from:path) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        pub(crate) struct $name($register);

        // SAFETY, for every intrinsic below: values of this type are only created and used inside
        // kernels that `Isa::run` compiles for, and starts on, a processor that was detected to
        // have the instruction set. Loads and stores stay inside the eight numbers: `part` is below
        // `PARTS`, which is asserted.
        impl Vector for $name {
            const WIDTH: usize = $width;

            #[inline(always)]
            fn splat(value: f64) -> Self {
                // SAFETY: see above.
                Self(unsafe { $splat(value) })
            }

            #[inline(always)]
            fn load(lanes: &Lanes, part: usize) -> Self {
                assert!(part < Self::PARTS);
                // SAFETY: see above.
                Self(unsafe { $load(lanes.0.as_ptr().add(part * $width)) })
            }

            #[inline(always)]
            fn store(self, lanes: &mut Lanes, part: usize) {
                assert!(part < Self::PARTS);
                // SAFETY: see above.
                unsafe { $store(lanes.0.as_mut_ptr().add(part * $width), self.0) }
            }

            #[inline(always)]
            fn add(self, other: Self) -> Self {
                // SAFETY: see above.
                Self(unsafe { $add(self.0, other.0) })
            }

            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                // SAFETY: see above.
                Self(unsafe { $sub(self.0, other.0) })
            }

            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                // SAFETY: see above.
                Self(unsafe { $mul(self.0, other.0) })
            }

            #[inline(always)]
            fn neg(self) -> Self {
                // SAFETY: see above. Subtraction from -0 only changes the sign.
                Self(unsafe { $sub($splat(-0.0), self.0) })
            }

            #[inline(always)]
            fn recip(self) -> Self {
                // SAFETY: see above.
                Self(unsafe { $div($splat(1.0), self.0) })
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: see above.
                Self(unsafe { $sqrt(self.0) })
            }

            #[inline(always)]
            fn mul_add(self, factor: Self, addend: Self) -> Self {
                // SAFETY: see above.
                Self(unsafe { $mul_add(self.0, factor.0, addend.0) })
            }

            #[inline(always)]
            fn mul_sub(self, factor: Self, subtrahend: Self) -> Self {
                // SAFETY: see above.
                Self(unsafe { $mul_sub(self.0, factor.0, subtrahend.0) })
            }

            #[inline(always)]
            fn mul_sub_from(self, factor: Self, minuend: Self) -> Self {
                // SAFETY: see above.
                Self(unsafe { $mul_sub_from(self.0, factor.0, minuend.0) })
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{Lanes, Vector};

    vector!(
        /// Two numbers, with fused multiply-adds.
        Fma, __m128d, 2, _mm_set1_pd, _mm_loadu_pd, _mm_storeu_pd, _mm_add_pd, _mm_sub_pd, _mm_mul_pd, _mm_div_pd, _mm_sqrt_pd,
        _mm_fmadd_pd, _mm_fmsub_pd, _mm_fnmadd_pd
    );

    vector!(
        /// Four numbers.
        Avx2, __m256d, 4, _mm256_set1_pd, _mm256_loadu_pd, _mm256_storeu_pd, _mm256_add_pd, _mm256_sub_pd,
        _mm256_mul_pd, _mm256_div_pd, _mm256_sqrt_pd, _mm256_fmadd_pd, _mm256_fmsub_pd, _mm256_fnmadd_pd
    );

    vector!(
        /// Eight numbers.
        Avx512, __m512d, 8, _mm512_set1_pd, _mm512_loadu_pd, _mm512_storeu_pd, _mm512_add_pd, _mm512_sub_pd,
        _mm512_mul_pd, _mm512_div_pd, _mm512_sqrt_pd, _mm512_fmadd_pd, _mm512_fmsub_pd, _mm512_fnmadd_pd
    );
}

#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{Avx2, Avx512, Fma};

#[cfg(target_arch = "aarch64")]
mod aarch64 {
    use std::arch::aarch64::*;

    use super::{Lanes, Vector};

    vector!(
        /// Two numbers.
        Neon, float64x2_t, 2, vdupq_n_f64, vld1q_f64, vst1q_f64, vaddq_f64, vsubq_f64, vmulq_f64, vdivq_f64, vsqrtq_f64,
        mul_add, mul_sub, mul_sub_from
    );

    // The intrinsics take the addend first.

    #[inline(always)]
    unsafe fn mul_add(a: float64x2_t, b: float64x2_t, addend: float64x2_t) -> float64x2_t {
        // SAFETY: that of the caller.
        unsafe { vfmaq_f64(addend, a, b) }
    }

    #[inline(always)]
    unsafe fn mul_sub(a: float64x2_t, b: float64x2_t, subtrahend: float64x2_t) -> float64x2_t {
        // SAFETY: that of the caller.
        unsafe { vfmaq_f64(vnegq_f64(subtrahend), a, b) }
    }

    #[inline(always)]
    unsafe fn mul_sub_from(a: float64x2_t, b: float64x2_t, minuend: float64x2_t) -> float64x2_t {
        // SAFETY: that of the caller.
        unsafe { vfmsq_f64(minuend, a, b) }
    }
}

#[cfg(target_arch = "aarch64")]
pub(crate) use aarch64::Neon;

/// Complex numbers side by side.
#[derive(Clone, Copy)]
pub(crate) struct ComplexVector<V> {
    pub(crate) re: V,
    pub(crate) im: V,
}

impl<V: Vector> ComplexVector<V> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self { re: V::splat(0.0), im: V::splat(0.0) }
    }

    /// Part `part` of eight numbers.
    #[inline(always)]
    pub(crate) fn load(lanes: &ComplexLanes, part: usize) -> Self {
        Self { re: V::load(&lanes.re, part), im: V::load(&lanes.im, part) }
    }

    /// Writes the numbers that [`ComplexVector::load`] reads.
    #[inline(always)]
    pub(crate) fn store(self, lanes: &mut ComplexLanes, part: usize) {
        self.re.store(&mut lanes.re, part);
        self.im.store(&mut lanes.im, part);
    }

    #[inline(always)]
    pub(crate) fn add(self, other: Self) -> Self {
        Self { re: self.re.add(other.re), im: self.im.add(other.im) }
    }

    #[inline(always)]
    pub(crate) fn sub(self, other: Self) -> Self {
        Self { re: self.re.sub(other.re), im: self.im.sub(other.im) }
    }

    #[inline(always)]
    pub(crate) fn neg(self) -> Self {
        Self { re: self.re.neg(), im: self.im.neg() }
    }

    /// self · factor, `factor` real.
    #[inline(always)]
    pub(crate) fn scale(self, factor: V) -> Self {
        Self { re: self.re.mul(factor), im: self.im.mul(factor) }
    }

    #[inline(always)]
    pub(crate) fn mul(self, other: Self) -> Self {
        Self {
            re: self.re.mul_sub(other.re, self.im.mul(other.im)),
            im: self.re.mul_add(other.im, self.im.mul(other.re)),
        }
    }

    /// self · factor + addend.
    #[inline(always)]
    pub(crate) fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self {
            re: self.im.mul_sub_from(factor.im, self.re.mul_add(factor.re, addend.re)),
            im: self.im.mul_add(factor.re, self.re.mul_add(factor.im, addend.im)),
        }
    }

    /// minuend - self · factor.
    #[inline(always)]
    pub(crate) fn mul_sub_from(self, factor: Self, minuend: Self) -> Self {
        Self {
            re: self.im.mul_add(factor.im, self.re.mul_sub_from(factor.re, minuend.re)),
            im: self.im.mul_sub_from(factor.re, self.re.mul_sub_from(factor.im, minuend.im)),
        }
    }

    /// 1 / self.
    #[inline(always)]
    pub(crate) fn recip(self) -> Self {
        let scale = self.re.mul_add(self.re, self.im.mul(self.im)).recip();
        Self { re: self.re.mul(scale), im: self.im.mul(scale.neg()) }
    }
}
