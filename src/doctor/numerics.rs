//! A small batch with a known digest: whether this machine computes the bits that all others do.

use std::time::Instant;

use osteon_solver::Isa;
use osteon_worker::{KNOWN_DIGEST, known_batch_digest};

use super::Diagnosis;

const CHECK: &str = "numerics";

/// Digits of a digest that are shown.
const SHOWN: usize = 16;

/// Computes the batch on every instruction set of this machine.
pub(super) fn examine(used: Isa) -> Diagnosis {
    let mut time = None;
    for isa in Isa::available() {
        let begun = Instant::now();
        let Some(digest) = known_batch_digest(isa) else {
            return Diagnosis::problem(CHECK, "the known batch is refused", "please report this");
        };
        if digest != KNOWN_DIGEST {
            return Diagnosis::problem(
                CHECK,
                format!(
                    "on {} the digest is {}, and must be {}",
                    isa.name(),
                    shown(&digest),
                    shown(KNOWN_DIGEST)
                ),
                "do not compute on this machine: its results differ from those of others; test its memory \
                 and processor, and report this if they are sound",
            );
        }
        if isa.name() == used.name() {
            time = Some(begun.elapsed().as_secs_f64());
        }
    }
    let time = time.map(|time| format!(", {:.0} ms", 1e3 * time)).unwrap_or_default();
    Diagnosis::good(
        CHECK,
        format!("digest {} as expected, on every instruction set{time}", shown(KNOWN_DIGEST)),
    )
}

fn shown(digest: &str) -> &str {
    digest.get(..SHOWN).unwrap_or(digest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Fitness;

    #[test]
    fn this_machine_computes_rightly() {
        assert_eq!(examine(Isa::fastest()).verdict, Fitness::Good);
    }
}
