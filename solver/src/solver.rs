//! Computes the velocity of one realization by the method that the setup requests.

use std::sync::Arc;

use osteon_common::bone::BoneRef;
use osteon_common::case::Setup;
use osteon_common::observables::ObservableSet;
use osteon_common::outcome::{Outcome, RealizationResult};
use osteon_common::realization::Ensemble;
use osteon_common::settings::Method;

use crate::arrival::Arrival;
use crate::exact::pass::ExactWorkspace;
use crate::exact::table_memory::TableMemory;
use crate::exact::{Exact, has_tables_of};
use crate::failure::Failure;
use crate::hybrid::{Hybrid, HybridWorkspace};
use crate::isa::Isa;

/// Solves cases of one setup; holds the tables that all its realizations share.
#[derive(Debug)]
pub struct Solver {
    setup: Setup,
    isa: Isa,
    exact: Exact,
    /// The exact method as a second source sees the bone; `None` if there is none, or if it would see the
    /// same.
    reversed: Option<Exact>,
    hybrid: Hybrid,
}

/// Scratch memory of one thread; its contents never reach a result.
#[derive(Debug, Default)]
pub struct Workspace {
    exact: ExactWorkspace,
    hybrid: HybridWorkspace,
}

impl Solver {
    /// Creates a solver for cases of `setup`, which has passed validation.
    pub fn new(setup: &Setup) -> Self {
        Self::with_isa(setup, Isa::fastest())
    }

    /// Creates a solver that computes on `isa`. The bits of its results do not depend on the instruction set.
    pub fn with_isa(setup: &Setup, isa: Isa) -> Self {
        let memory = Arc::new(TableMemory::default());
        let probe = &setup.probe;
        let reversed = (probe.bidirectional && probe.tilt != 0.0).then(|| {
            let reversed = Setup { probe: probe.from_other_side(), ..setup.clone() };
            Exact::new(&reversed, isa, &memory)
        });
        Self {
            setup: setup.clone(),
            isa,
            exact: Exact::new(setup, isa, &memory),
            reversed,
            hybrid: Hybrid::with_isa(setup, isa),
        }
    }

    /// Makes this the solver for cases of `setup`. Tables that stay the same are kept.
    pub fn change_setup(&mut self, setup: &Setup) {
        if self.setup != *setup {
            *self = self.with_setup(setup);
        }
    }

    /// Returns a solver for another setup. It shares this one's tables if the setup has the same.
    pub(crate) fn with_setup(&self, setup: &Setup) -> Self {
        self.sharing_tables(setup).unwrap_or_else(|| Self::with_isa(setup, self.isa))
    }

    /// Returns a solver for another setup that shares this one's tables; `None` if the setup has others.
    pub fn sharing_tables(&self, setup: &Setup) -> Option<Self> {
        if !has_tables_of(setup, &self.setup) {
            return None;
        }
        let reversed = self.reversed.as_ref().map(|exact| {
            exact.with_setup(&Setup { probe: setup.probe.from_other_side(), ..setup.clone() })
        });
        Some(Self {
            setup: setup.clone(),
            isa: self.isa,
            exact: self.exact.with_setup(setup),
            reversed,
            hybrid: Hybrid::with_isa(setup, self.isa),
        })
    }

    /// Returns the setup.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Returns the instruction set on which it computes.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// Computes the first arrival of one bone.
    ///
    /// ```
    /// use osteon_common::case::{Bone, Setup};
    /// use osteon_common::elasticity::EngineeringConstants;
    /// use osteon_solver::{Solver, Workspace};
    ///
    /// let constants = EngineeringConstants {
    ///     longitudinal_young_modulus: 17.717e9,
    ///     longitudinal_poisson_ratio: 0.3816,
    ///     longitudinal_shear_modulus: 4.795e9,
    ///     transverse_young_modulus: 9.8254e9,
    ///     transverse_poisson_ratio: 0.4495,
    /// };
    /// let bone = Bone { density: 1598.8, elasticity: constants.elasticity().unwrap() };
    /// let solver = Solver::new(&Setup::default());
    /// let arrival = solver.arrival(&bone, &mut Workspace::default()).unwrap();
    /// assert!((3900.0..3920.0).contains(&arrival.velocity));
    /// assert_eq!(arrival.times.len(), 14); // one for each receiver
    /// ```
    ///
    /// # Errors
    /// The failure, if the case has no velocity.
    pub fn arrival<'a>(
        &self,
        bone: impl Into<BoneRef<'a>>,
        workspace: &mut Workspace,
    ) -> Result<Arrival, Failure> {
        self.arrival_of(bone.into(), workspace)
    }

    fn arrival_of(&self, bone: BoneRef<'_>, workspace: &mut Workspace) -> Result<Arrival, Failure> {
        let found = match self.setup.solver.method {
            Method::Exact => self.exact.arrival(bone, &mut workspace.exact),
            Method::Hybrid => self.hybrid.arrival(bone, &mut workspace.hybrid),
        }?;
        if !self.setup.probe.bidirectional {
            return Ok(found);
        }
        let Some(reversed) = &self.reversed else {
            // By reciprocity a plate is the same from both sides.
            return Ok(Arrival { directions: Some([found.velocity; 2]), ..found });
        };
        match reversed.arrival(bone, &mut workspace.exact) {
            Ok(other) => Ok(found.combine(&other)),
            Err(Failure { kind, detail }) => {
                Err(Failure { kind, detail: format!("from the second source: {detail}") })
            }
        }
    }

    /// Computes the velocity of one bone, m/s, or the kind of failure: what a job keeps of an arrival.
    pub fn outcome<'a>(&self, bone: impl Into<BoneRef<'a>>, workspace: &mut Workspace) -> Outcome {
        self.arrival(bone, workspace)
            .map(|arrival| arrival.velocity)
            .map_err(|failure| failure.kind)
    }

    /// Computes the realization at `index` of `ensemble`, as a worker returns it. A bone that
    /// cannot be drawn is the failure `not_finite`. If quantities of the setup are random, the
    /// realization has tables of its own, unless only the thickness of a thick bone is random.
    pub fn realization(
        &self,
        ensemble: &Ensemble,
        index: u64,
        workspace: &mut Workspace,
    ) -> RealizationResult {
        self.realization_with(ObservableSet::NONE, ensemble, index, workspace)
    }
}
