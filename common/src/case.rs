//! One deterministic problem: layers, probe, criterion, solver, and one bone.

use crate::bone::CaseBone;
use crate::bone_structure::BoneStructure;
use crate::fields::{Key, Section};
use crate::layers::Layers;
use crate::probe::Probe;
use crate::settings::{Picking, SolverSettings};

pub use crate::bone::Bone;

/// Everything but the bone's material: the part that all realizations of a job share, and the only
/// part on which a solver's shared tables may depend.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Setup {
    /// The stack of layers.
    pub layers: Layers,
    /// Source, receivers, pulse.
    pub probe: Probe,
    /// The criterion of the first arriving signal.
    pub picking: Picking,
    /// Settings of the wave solver.
    pub solver: SolverSettings,
    /// Pores or sublayers of the bone, if this is the setup of a job. A solver is given a bone and ignores
    /// them.
    pub structure: BoneStructure,
}

impl Setup {
    /// Returns each section with its key, in the order of a canonical file, except `bone`, whose
    /// keys differ between a job file and a case file.
    pub fn sections(&mut self) -> [(Key, &mut dyn Section); 4] {
        [
            (Key { name: "layers", meaning: "the three layers" }, &mut self.layers),
            (Key { name: "probe", meaning: "source, receivers, pulse" }, &mut self.probe),
            (
                Key { name: "picking", meaning: "criterion of the first arriving signal" },
                &mut self.picking,
            ),
            (Key { name: "solver", meaning: "settings of the wave solver" }, &mut self.solver),
        ]
    }

    /// Returns path and name of what only the exact method computes, if the setup has any of it.
    pub fn only_exact(&self) -> Option<(&'static str, &'static str)> {
        let attenuated = self.layers.attenuated().map(|field| (field, "attenuation"));
        let tilted = (self.probe.tilt != 0.0).then_some(("probe.tilt", "tilt"));
        attenuated.or(tilted)
    }
}

/// One case. A velocity's bits are a function of the case alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Layers, probe, picking and solver.
    pub setup: Setup,
    /// The bone. If it has sublayers, the setup's thickness of the bone is that of all together.
    pub bone: CaseBone,
}
