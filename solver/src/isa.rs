//! The instruction set that computes: chosen at run time, with the same bits from each.
//!
//! The kernel is one piece of code in eight lanes; it is compiled once for every instruction set.
//! Its operations are IEEE additions, multiplications, divisions and explicit fused
//! multiply-adds, whose results do not depend on how many lanes fit into a register. Without
//! hardware support a fused multiply-add is a slow but exact function call.

use crate::lanes::ComplexLanes;
use crate::medium::Medium;
use crate::plate::Plate;
use crate::response::sum_wavenumbers;
use crate::tables::{Frequency, Tables};

/// An instruction set of this machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Isa(Kind);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Baseline,
    #[cfg(target_arch = "x86_64")]
    ScalarFma,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Isa {
    /// The instruction sets that this machine offers, slowest first.
    pub fn available() -> Vec<Self> {
        #[cfg_attr(not(target_arch = "x86_64"), expect(unused_mut, reason = "only x86-64 has more"))]
        let mut sets = vec![Self(Kind::Baseline)];
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("fma") {
                sets.push(Self(Kind::ScalarFma));
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                sets.push(Self(Kind::Avx2));
                if is_x86_feature_detected!("avx512f") {
                    sets.push(Self(Kind::Avx512));
                }
            }
        }
        sets
    }

    /// The fastest instruction set that this machine offers.
    pub fn fastest() -> Self {
        Self::available().last().copied().unwrap_or(Self(Kind::Baseline))
    }

    /// Name for users.
    pub fn name(self) -> &'static str {
        match self.0 {
            Kind::Baseline => "baseline",
            #[cfg(target_arch = "x86_64")]
            Kind::ScalarFma => "fma",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => "avx512",
        }
    }

    /// See [`crate::response::sum_wavenumbers`].
    pub(crate) fn sum_wavenumbers(
        self,
        tables: &Tables,
        frequency: &Frequency,
        medium: &Medium,
        plate: &mut Plate,
        sums: &mut [ComplexLanes],
    ) {
        match self.0 {
            Kind::Baseline => sum_wavenumbers(tables, frequency, medium, plate, sums),
            // SAFETY: a value of this type exists only for an instruction set that was detected.
            #[cfg(target_arch = "x86_64")]
            Kind::ScalarFma => unsafe { scalar_fma(tables, frequency, medium, plate, sums) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { avx2(tables, frequency, medium, plate, sums) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => unsafe { avx512(tables, frequency, medium, plate, sums) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "fma")]
fn scalar_fma(
    tables: &Tables,
    frequency: &Frequency,
    medium: &Medium,
    plate: &mut Plate,
    sums: &mut [ComplexLanes],
) {
    sum_wavenumbers(tables, frequency, medium, plate, sums);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2(
    tables: &Tables,
    frequency: &Frequency,
    medium: &Medium,
    plate: &mut Plate,
    sums: &mut [ComplexLanes],
) {
    sum_wavenumbers(tables, frequency, medium, plate, sums);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
fn avx512(
    tables: &Tables,
    frequency: &Frequency,
    medium: &Medium,
    plate: &mut Plate,
    sums: &mut [ComplexLanes],
) {
    sum_wavenumbers(tables, frequency, medium, plate, sums);
}
