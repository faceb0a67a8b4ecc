//! Identifications in this process, on all cores.

use std::collections::BTreeMap;
use std::convert::Infallible;

use osteon_common::case::Setup;
use osteon_common::job::{JobSpecification, MonteCarlo};
use osteon_common::outcome::{Outcome, RealizationResult};
use osteon_common::parameters::{Point, PointBits};
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::realization::{Ensemble, PointError};
use osteon_search::{CompletedJob, IdentifyError, Realizations};
use osteon_solver::{Isa, Solver};

use crate::draws::{observed_realizations, solve_realizations};

/// Cache of the realizations at the points at which several identifications begin, by the bits of
/// the point.
pub(crate) type RealizationCache = BTreeMap<PointBits, Vec<RealizationResult>>;

/// Layers and probe, and how they differ from realization to realization.
#[derive(Debug, Clone, Default)]
pub(crate) struct Surroundings {
    /// The setup, with the means.
    pub(crate) setup: Setup,
    /// The scatter about them.
    pub(crate) random: RandomQuantities,
}

impl Surroundings {
    /// Returns the velocities of independent realizations at a point, without those that fail.
    ///
    /// # Errors
    /// If the point has no ensemble.
    pub(crate) fn velocities(
        &self,
        point: &Point,
        count: u64,
        seed: u64,
        isa: Isa,
    ) -> Result<Vec<f64>, PointError> {
        let drawn = MonteCarlo { realizations: count, seed, ..MonteCarlo::default() };
        Ok(self.outcomes(point, &drawn, isa)?.into_iter().filter_map(Outcome::ok).collect())
    }

    fn outcomes(
        &self,
        point: &Point,
        monte_carlo: &MonteCarlo,
        isa: Isa,
    ) -> Result<Vec<Outcome>, PointError> {
        let ensemble = Ensemble::drawn(point, monte_carlo.germs())?.with_random(self.random);
        let solver = Solver::with_isa(&self.setup, isa);
        let solved = solve_realizations(&solver, &ensemble, monte_carlo.realizations);
        Ok(solved.into_iter().map(|one| one.outcome).collect())
    }
}

/// Computes the outcomes of every realization at a point of the paper's geometry, in index order.
///
/// # Errors
/// If the point has no ensemble.
pub(crate) fn outcomes(
    point: &Point,
    monte_carlo: &MonteCarlo,
    isa: Isa,
) -> Result<Vec<Outcome>, PointError> {
    Surroundings::default().outcomes(point, monte_carlo, isa)
}

/// Returns the velocities of independent realizations at a point of the paper's geometry, without
/// those that fail.
///
/// # Errors
/// If the point has no ensemble.
pub(crate) fn velocities(
    point: &Point,
    count: u64,
    seed: u64,
    isa: Isa,
) -> Result<Vec<f64>, PointError> {
    Surroundings::default().velocities(point, count, seed, isa)
}

/// Runs an identification to its end. The realizations at its first point are taken from `known`,
/// or stored there.
///
/// # Errors
/// If the specification violates rules.
pub(crate) fn identify(
    specification: &JobSpecification,
    known: &mut RealizationCache,
    isa: Isa,
) -> Result<CompletedJob, IdentifyError<Infallible>> {
    let mut solver = Solver::with_isa(&specification.setup, isa);
    let mut begun = false;
    osteon_search::identify(specification, |realizations| {
        let bits = realizations.point.bits();
        let is_first = !std::mem::replace(&mut begun, true);
        if let Some(found) = known.get(&bits) {
            return Ok(found.clone());
        }
        solver.change_setup(&realizations.point.setup(&specification.setup));
        let Realizations { ensemble, count, observables, .. } = &realizations;
        let found = observed_realizations(&solver, *observables, ensemble, *count);
        if is_first {
            known.insert(bits, found.clone());
        }
        Ok(found)
    })
}
