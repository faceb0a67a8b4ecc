//! A small batch with a known digest: whether this machine computes the bits that all others do.

use std::path::Path;
use std::time::Instant;

use osteon_common::digest::PathDigest;
use osteon_common::job::JobKind;
use osteon_files::document::Format;
use osteon_files::job_file;
use osteon_solver::{Isa, Solver, Workspace};

use super::Diagnosis;

const CHECK: &str = "numerics";

/// The bones of the batch: the paper's optimum.
const JOB: &str = "\
[parameters]
density = { fixed = 1598.8 }
longitudinal_young_modulus = { fixed = 17.717e9 }
longitudinal_poisson_ratio = { fixed = 0.3816 }
longitudinal_shear_modulus = { fixed = 4.795e9 }
transverse_young_modulus = { fixed = 9.8254e9 }
transverse_poisson_ratio = { fixed = 0.4495 }
dispersion = { fixed = 0.1029 }
[monte_carlo]
realizations = 16
seed = 1
";

/// Digest of the batch. It changes with the numerics revision, and with nothing else.
const DIGEST: &str = "6b0b24c9897e6813f6a2f6a82640a61071f0cb486d0ab6ab36b7264437e51233";

/// Digits of a digest that are shown.
const SHOWN: usize = 16;

/// Computes the batch on every instruction set of this machine.
pub(super) fn examine(used: Isa) -> Diagnosis {
    let mut time = None;
    for isa in Isa::available() {
        let begun = Instant::now();
        let digest = match digest(isa) {
            Ok(digest) => digest,
            Err(error) => return Diagnosis::problem(CHECK, error, "please report this"),
        };
        if digest != DIGEST {
            return Diagnosis::problem(
                CHECK,
                format!(
                    "on {} the digest is {}, and must be {}",
                    isa.name(),
                    shown(&digest),
                    shown(DIGEST)
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
        format!("digest {} as expected, on every instruction set{time}", shown(DIGEST)),
    )
}

fn shown(digest: &str) -> &str {
    digest.get(..SHOWN).unwrap_or(digest)
}

/// Returns the digest of the batch.
fn digest(isa: Isa) -> Result<String, String> {
    let specification = job_file::parse(JOB, Format::Toml, Path::new(""), JobKind::Propagation)
        .map_err(|error| error.to_string())?;
    let point = specification.start();
    let ensemble = specification.ensemble(&point).map_err(|error| error.to_string())?;
    let solver = Solver::with_isa(&specification.setup, isa);
    let mut workspace = Workspace::default();
    let outcomes: Vec<_> = (0..specification.monte_carlo.realizations)
        .map(|index| solver.realization(&ensemble, index, &mut workspace).outcome)
        .collect();
    let mut digest = PathDigest::new();
    digest.add_evaluation(&point, &outcomes);
    Ok(digest.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Fitness;

    /// After a change of the numerics revision the new digest belongs here.
    #[test]
    fn the_digest_is_that_of_this_numerics_revision() {
        for isa in Isa::available() {
            assert_eq!(digest(isa).unwrap(), DIGEST, "{}", isa.name());
        }
        assert_eq!(examine(Isa::fastest()).verdict, Fitness::Good);
    }
}
