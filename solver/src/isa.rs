//! The instruction set for computations: chosen at run time, with the same bits from each.
//!
//! A kernel is one piece of code in eight lanes; it is compiled once for every instruction set. Its
//! operations are IEEE additions, multiplications, divisions and explicit fused multiply-adds,
//! whose results do not depend on how many lanes fit into a register. Without hardware support a
//! fused multiply-add is a slow but exact function call.

#![expect(
    unsafe_code,
    reason = "a kernel is called for an instruction set that was found to be there"
)]

use std::ffi::OsString;

use thiserror::Error;

#[cfg(target_arch = "aarch64")]
use crate::vector::Neon;
#[cfg(target_arch = "x86_64")]
use crate::vector::{Avx2, Avx512, Fma};
use crate::vector::{Scalar, Vector};

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
    #[cfg(target_arch = "aarch64")]
    Neon,
}

/// The name does not denote one of this machine's instruction sets.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "in {}: {value:?} is not an instruction set of this machine; it offers {} (unset, the fastest is used)",
    Isa::VARIABLE,
    Isa::available().into_iter().map(Isa::name).collect::<Vec<_>>().join(", ")
)]
pub struct UnknownIsa {
    /// The name given.
    pub value: OsString,
}

impl Isa {
    /// The environment variable by which users choose an instruction set.
    pub const VARIABLE: &'static str = "OSTEON_INSTRUCTION_SET";

    /// Returns the instruction set that `value` of [`Isa::VARIABLE`] names, or the fastest if it is
    /// absent or empty.
    ///
    /// # Errors
    /// If it is not one of this machine's.
    pub fn chosen(value: Option<OsString>) -> Result<Self, UnknownIsa> {
        let Some(value) = value.filter(|value| !value.is_empty()) else {
            return Ok(Self::fastest());
        };
        value.to_str().and_then(Self::named).ok_or(UnknownIsa { value })
    }

    /// Returns the instruction sets of this machine, slowest first.
    pub fn available() -> Vec<Self> {
        #[cfg_attr(
            not(any(target_arch = "x86_64", target_arch = "aarch64")),
            expect(unused_mut, reason = "other processors have no more")
        )]
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
        #[cfg(target_arch = "aarch64")]
        if std::arch::is_aarch64_feature_detected!("neon") {
            sets.push(Self(Kind::Neon));
        }
        sets
    }

    /// Returns the fastest instruction set of this machine.
    pub fn fastest() -> Self {
        Self::available().last().copied().unwrap_or(Self(Kind::Baseline))
    }

    /// Returns the instruction set of that name, if this machine has it.
    pub fn named(name: &str) -> Option<Self> {
        Self::available().into_iter().find(|isa| isa.name() == name)
    }

    /// Returns the name for users.
    pub fn name(self) -> &'static str {
        match self.0 {
            Kind::Baseline => "baseline",
            #[cfg(target_arch = "x86_64")]
            Kind::ScalarFma => "fma",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => "avx512",
            #[cfg(target_arch = "aarch64")]
            Kind::Neon => "neon",
        }
    }

    /// Runs `kernel` compiled for this instruction set.
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Kind::Baseline => kernel.run::<Scalar>(),
            // SAFETY: a value of this type exists only for an instruction set that was detected.
            #[cfg(target_arch = "x86_64")]
            Kind::ScalarFma => unsafe { scalar_fma(kernel) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => unsafe { avx2(kernel) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => unsafe { avx512(kernel) },
            // SAFETY: as above.
            #[cfg(target_arch = "aarch64")]
            Kind::Neon => unsafe { neon(kernel) },
        }
    }
}

/// A computation that is compiled once for every instruction set.
///
/// `run`, and the functions that it calls in its hot part, must be `#[inline(always)]`: only code
/// that is inlined into the functions below is compiled for their instruction set. Code that is not
/// inlined is still correct, but pays a function call for every fused multiply-add.
pub(crate) trait Kernel {
    type Output;
    fn run<V: Vector>(self) -> Self::Output;
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "fma")]
fn scalar_fma<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Fma>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx2>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
fn avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx512>()
}

#[cfg(target_arch = "aarch64")]
#[target_feature(enable = "neon")]
fn neon<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Neon>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every register type of `vector.rs` is used on some machine, and every machine uses the best
    /// one that it is certain to have.
    #[test]
    fn every_kind_of_register_is_offered() {
        let names: Vec<&str> = Isa::available().into_iter().map(Isa::name).collect();
        assert_eq!(names[0], "baseline");
        #[cfg(target_arch = "aarch64")]
        assert_eq!(names, ["baseline", "neon"]);
        let sources = (include_str!("isa.rs"), include_str!("vector.rs"));
        let registers = sources.1.split("vector!(").skip(1).map(|text| {
            let name = text.lines().find(|line| line.contains("_t, ") || line.contains("__m"));
            name.and_then(|line| line.trim().split(',').next()).unwrap()
        });
        let registers: Vec<&str> = registers.collect();
        assert_eq!(registers, ["Fma", "Avx2", "Avx512", "Neon"]);
        for register in registers {
            assert!(sources.0.contains(&format!("kernel.run::<{register}>()")), "{register}");
        }
    }

    #[test]
    fn every_set_of_this_machine_is_found_by_its_name() {
        for isa in Isa::available() {
            assert_eq!(Isa::chosen(Some(isa.name().into())), Ok(isa));
        }
        assert_eq!(Isa::chosen(None), Ok(Isa::fastest()));
        assert_eq!(Isa::chosen(Some("".into())), Ok(Isa::fastest()));
    }

    #[test]
    fn another_name_is_refused_with_those_that_there_are() {
        for name in ["sse9", "AVX2", "baseline "] {
            let text = Isa::chosen(Some(name.into())).unwrap_err().to_string();
            assert!(text.starts_with(&format!("in OSTEON_INSTRUCTION_SET: {name:?} is")), "{text}");
            for isa in Isa::available() {
                assert!(text.contains(isa.name()), "{text}");
            }
        }
    }
}
