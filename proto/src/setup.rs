//! Layers, probe, picking and solver settings as messages.
//!
//! Absent fields take the `Default` of the `osteon-common` types, so that a client needs to send
//! only the fields that differ from it.

use osteon_common::case::Setup;
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::settings::{Picking, SolverSettings};
use osteon_common::violations::Violations;

use crate::bone_sublayers;
use crate::fields;
use crate::pulse;
use crate::v1;

/// The messages of a [`Setup`].
#[derive(Debug, Clone, PartialEq)]
pub struct SetupMessages {
    /// Field `layers`.
    pub layers: v1::Layers,
    /// Field `probe`.
    pub probe: v1::Probe,
    /// Field `picking`.
    pub picking: v1::Picking,
    /// Field `solver`.
    pub solver: v1::SolverSettings,
    /// Field `bone`; `None` without pores and sublayers.
    pub bone: Option<v1::Bone>,
}

/// Returns the complete messages of a setup: every field is present.
pub fn to_messages(setup: &Setup) -> SetupMessages {
    let mut setup = setup.clone();
    SetupMessages {
        layers: fields::to_message(&mut setup.layers),
        probe: v1::Probe {
            pulse: Some(pulse::to_message(&setup.probe.pulse)),
            ..fields::to_message(&mut setup.probe)
        },
        picking: fields::to_message(&mut setup.picking),
        solver: fields::to_message(&mut setup.solver),
        bone: setup.structure.is_given().then(|| v1::Bone {
            sublayers: bone_sublayers::to_messages(&setup.structure.sublayers),
            ..fields::to_message(&mut setup.structure)
        }),
    }
}

/// Returns the setup of five optional messages. Unknown enumeration values, and fields that the
/// solver's method does not have, are added to `violations`; numbers are not checked here.
pub fn from_messages(
    layers: Option<&v1::Layers>,
    probe: Option<&v1::Probe>,
    picking: Option<&v1::Picking>,
    solver: Option<&v1::SolverSettings>,
    bone: Option<&v1::Bone>,
    violations: &mut Violations,
) -> Setup {
    let mut setup = Setup::default();
    if let Some(message) = layers {
        fields::from_message("layers", message, &mut setup.layers, violations);
    }
    if let Some(message) = probe {
        fields::from_message("probe", message, &mut setup.probe, violations);
        let pulse = message.pulse.as_ref();
        setup.probe.pulse =
            pulse.and_then(|message| pulse::from_message(message, violations)).unwrap_or_default();
    }
    if let Some(message) = bone {
        fields::from_message("bone", message, &mut setup.structure, violations);
        bone_sublayers::from_messages(message, layers, &mut setup, violations);
    }
    setup.picking =
        picking.map_or(setup.picking, |message| picking_from_message(message, violations));
    setup.solver = solver.map_or(setup.solver, |message| solver_from_message(message, violations));
    setup
}

/// Returns random quantities as a message; `None` if nothing is random.
pub(crate) fn random_to_message(random: &RandomQuantities) -> Option<v1::RandomQuantities> {
    random.is_any().then(|| fields::to_message(&mut random.clone()))
}

/// Returns the random quantities of a message; an unknown distribution, and one without a standard
/// deviation, are added to `violations`.
pub(crate) fn random_from_message(
    message: &v1::RandomQuantities,
    violations: &mut Violations,
) -> RandomQuantities {
    let mut random = RandomQuantities::default();
    fields::from_message("random", message, &mut random, violations);
    random
}

/// Returns picking settings as a complete message.
pub fn picking_to_message(picking: &Picking) -> v1::Picking {
    fields::to_message(&mut picking.clone())
}

/// Returns solver settings as a complete message.
pub fn solver_to_message(solver: &SolverSettings) -> v1::SolverSettings {
    fields::to_message(&mut solver.clone())
}

/// Returns the picking settings of a message; an unknown extremum is added to `violations`.
pub fn picking_from_message(message: &v1::Picking, violations: &mut Violations) -> Picking {
    let mut picking = Picking::default();
    fields::from_message("picking", message, &mut picking, violations);
    picking
}

/// Returns the solver settings of a message; an unknown method, and a field that the method does
/// not have, are added to `violations`.
pub fn solver_from_message(
    message: &v1::SolverSettings,
    violations: &mut Violations,
) -> SolverSettings {
    let mut solver = SolverSettings::default();
    fields::from_message("solver", message, &mut solver, violations);
    solver
}
