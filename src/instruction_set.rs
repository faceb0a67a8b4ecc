//! The instruction set that computes: the fastest of this machine, unless the environment names one.

use std::ffi::OsString;

use anyhow::anyhow;
use osteon_solver::Isa;

use crate::ending::Failure;

/// Where the environment names the instruction set.
pub(crate) const VARIABLE: &str = "OSTEON_INSTRUCTION_SET";

/// The instruction set that `value` of [`VARIABLE`] names; without one, or with an empty one, the
/// fastest.
///
/// # Errors
/// Bad input when it is not one of this machine's.
pub(crate) fn named(value: Option<OsString>) -> Result<Isa, Failure> {
    let Some(value) = value.filter(|value| !value.is_empty()) else {
        return Ok(Isa::fastest());
    };
    value.to_str().and_then(Isa::named).ok_or_else(|| {
        let offered: Vec<&str> = Isa::available().into_iter().map(Isa::name).collect();
        Failure::bad_input(anyhow!(
            "in {VARIABLE}: {value:?} is not an instruction set of this machine; it offers {} (unset, the \
             fastest is used)",
            offered.join(", ")
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_of_this_machine_is_found_by_its_name() {
        for isa in Isa::available() {
            assert_eq!(named(Some(isa.name().into())).unwrap(), isa);
        }
        assert_eq!(named(None).unwrap(), Isa::fastest());
        assert_eq!(named(Some("".into())).unwrap(), Isa::fastest());
    }

    #[test]
    fn another_name_is_refused_with_those_that_there_are() {
        for name in ["sse9", "AVX2", "baseline "] {
            let failure = named(Some(name.into())).unwrap_err();
            assert_eq!(failure.exit_code(), 2);
            let text = failure.to_string();
            assert!(text.starts_with(&format!("in OSTEON_INSTRUCTION_SET: {name:?} is")), "{text}");
            for isa in Isa::available() {
                assert!(text.contains(isa.name()), "{text}");
            }
        }
    }
}
