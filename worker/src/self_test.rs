//! A small batch with a known digest: whether this machine computes the bits that all others do.

use osteon_common::case::Setup;
use osteon_common::digest::PathDigest;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{JobKind, JobSpecification, MonteCarlo, Objective, Range, Search};
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::systematic::Systematic;
use osteon_solver::{Isa, Solver, Workspace};

/// Number of realizations of the batch.
const REALIZATIONS: u64 = 16;

/// Digest of the batch. It changes with the numerics revision, and with nothing else.
pub const KNOWN_DIGEST: &str = "6b0b24c9897e6813f6a2f6a82640a61071f0cb486d0ab6ab36b7264437e51233";

/// Returns the digest of the batch as this machine computes it on an instruction set: bones around the
/// optimum of the paper, at the default setup. `None` if their mean elasticity is not one, which it is.
pub fn known_batch_digest(isa: Isa) -> Option<String> {
    let specification = specification();
    let point = specification.start();
    let ensemble = specification.ensemble(&point).ok()?;
    let solver = Solver::with_isa(&specification.setup, isa);
    let mut workspace = Workspace::default();
    let outcomes: Vec<_> = (0..REALIZATIONS)
        .map(|index| solver.realization(&ensemble, index, &mut workspace).outcome)
        .collect();
    let mut digest = PathDigest::new();
    digest.add_evaluation(&point, &outcomes);
    Some(digest.finish())
}

fn specification() -> JobSpecification {
    JobSpecification {
        kind: JobKind::Propagation,
        setup: Setup::default(),
        data: None,
        parameters: Range::of_bone(
            [1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029].map(Range::Fixed),
        ),
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo { realizations: REALIZATIONS, seed: 1, ..MonteCarlo::default() },
        objective: Objective::default(),
        search: Search::default(),
        posterior: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After a change of the numerics revision the new digest belongs here.
    #[test]
    fn the_digest_is_that_of_this_numerics_revision() {
        for isa in Isa::available() {
            assert_eq!(known_batch_digest(isa).as_deref(), Some(KNOWN_DIGEST), "{}", isa.name());
        }
    }
}
