//! Layers, probe, picking and solver settings as messages.
//!
//! Absent fields take the `Default` of the `osteon-common` types, so that a client needs to send
//! only the fields that differ from it.

use osteon_common::case::Setup;
use osteon_common::check;
use osteon_common::layers::{Fluid, Layers};
use osteon_common::probe::{Probe, Receivers, Source};
use osteon_common::settings::{Method, Picking, SolverSettings};
use osteon_common::violations::Violations;

use crate::choice::{EXTREMUM, SOLVER_METHOD};
use crate::v1;

/// The four messages of a [`Setup`].
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
}

/// Returns the complete messages of a setup: every field is present.
pub fn to_messages(setup: &Setup) -> SetupMessages {
    SetupMessages {
        layers: layers_to_message(&setup.layers),
        probe: probe_to_message(&setup.probe),
        picking: picking_to_message(&setup.picking),
        solver: solver_to_message(&setup.solver),
    }
}

/// Returns the setup of four optional messages. Unknown enumeration values are added to
/// `violations`; numbers are not checked here.
pub fn from_messages(
    layers: Option<&v1::Layers>,
    probe: Option<&v1::Probe>,
    picking: Option<&v1::Picking>,
    solver: Option<&v1::SolverSettings>,
    violations: &mut Violations,
) -> Setup {
    Setup {
        layers: layers.map(layers_from_message).unwrap_or_default(),
        probe: probe.map(probe_from_message).unwrap_or_default(),
        picking: picking
            .map(|message| picking_from_message(message, violations))
            .unwrap_or_default(),
        solver: solver.map(|message| solver_from_message(message, violations)).unwrap_or_default(),
    }
}

/// Returns picking settings as a complete message.
pub fn picking_to_message(picking: &Picking) -> v1::Picking {
    v1::Picking { extremum: EXTREMUM.number(picking.extremum), threshold: Some(picking.threshold) }
}

/// Returns solver settings as a complete message.
pub fn solver_to_message(solver: &SolverSettings) -> v1::SolverSettings {
    let hybrid = solver.method == Method::Hybrid;
    v1::SolverSettings {
        method: SOLVER_METHOD.number(solver.method),
        refinement: Some(solver.refinement),
        element_size: hybrid.then_some(solver.element_size),
        element_order: hybrid.then_some(solver.element_order),
        time_step: solver.time_step.filter(|_| hybrid),
    }
}

/// Returns the picking settings of a message; an unknown extremum is added to `violations`.
pub fn picking_from_message(message: &v1::Picking, violations: &mut Violations) -> Picking {
    let default = Picking::default();
    Picking {
        extremum: EXTREMUM.or_default(
            message.extremum,
            default.extremum,
            "picking.extremum",
            violations,
        ),
        threshold: message.threshold.unwrap_or(default.threshold),
    }
}

/// Returns the solver settings of a message; an unknown method, and a field that the method does
/// not have, are added to `violations`.
pub fn solver_from_message(
    message: &v1::SolverSettings,
    violations: &mut Violations,
) -> SolverSettings {
    let default = SolverSettings::default();
    let method =
        SOLVER_METHOD.or_default(message.method, default.method, "solver.method", violations);
    let given = [
        message.element_size.is_some(),
        message.element_order.is_some(),
        message.time_step.is_some(),
    ];
    let refinement = message.refinement.unwrap_or(default.refinement);
    if method != Method::Hybrid {
        // If the method is unknown, it cannot be decided which fields belong to it.
        let known = !violations.touches("solver.method");
        for (key, _) in
            check::HYBRID_KEYS.into_iter().zip(given).filter(|&(_, given)| given && known)
        {
            violations.add(format!("solver.{key}"), check::of_hybrid_only(method));
        }
        return SolverSettings { method, refinement, ..default };
    }
    SolverSettings {
        method,
        refinement,
        element_size: message.element_size.unwrap_or(default.element_size),
        element_order: message.element_order.unwrap_or(default.element_order),
        time_step: message.time_step,
    }
}

fn layers_to_message(layers: &Layers) -> v1::Layers {
    let fluid = |fluid: &Fluid| v1::Fluid {
        thickness: Some(fluid.thickness),
        density: Some(fluid.density),
        sound_speed: Some(fluid.sound_speed),
    };
    v1::Layers {
        coupling: Some(fluid(&layers.coupling)),
        bone: Some(v1::BoneLayer { thickness: Some(layers.bone_thickness) }),
        marrow: Some(fluid(&layers.marrow)),
    }
}

fn layers_from_message(message: &v1::Layers) -> Layers {
    let default = Layers::default();
    let fluid = |message: Option<&v1::Fluid>, default: Fluid| {
        message.map_or(default, |message| Fluid {
            thickness: message.thickness.unwrap_or(default.thickness),
            density: message.density.unwrap_or(default.density),
            sound_speed: message.sound_speed.unwrap_or(default.sound_speed),
        })
    };
    let bone_thickness = message.bone.as_ref().and_then(|bone| bone.thickness);
    Layers {
        coupling: fluid(message.coupling.as_ref(), default.coupling),
        bone_thickness: bone_thickness.unwrap_or(default.bone_thickness),
        marrow: fluid(message.marrow.as_ref(), default.marrow),
    }
}

fn probe_to_message(probe: &Probe) -> v1::Probe {
    v1::Probe {
        center_frequency: Some(probe.center_frequency),
        amplitude: Some(probe.amplitude),
        source: Some(v1::Source { x1: Some(probe.source.x1), x3: Some(probe.source.x3) }),
        receivers: Some(v1::Receivers {
            first_x1: Some(probe.receivers.first_x1),
            pitch: Some(probe.receivers.pitch),
            count: Some(probe.receivers.count),
            x3: Some(probe.receivers.x3),
        }),
    }
}

fn probe_from_message(message: &v1::Probe) -> Probe {
    let default = Probe::default();
    Probe {
        center_frequency: message.center_frequency.unwrap_or(default.center_frequency),
        amplitude: message.amplitude.unwrap_or(default.amplitude),
        source: message.source.as_ref().map_or(default.source, |source| Source {
            x1: source.x1.unwrap_or(default.source.x1),
            x3: source.x3.unwrap_or(default.source.x3),
        }),
        receivers: message.receivers.as_ref().map_or(default.receivers, |receivers| Receivers {
            first_x1: receivers.first_x1.unwrap_or(default.receivers.first_x1),
            pitch: receivers.pitch.unwrap_or(default.receivers.pitch),
            count: receivers.count.unwrap_or(default.receivers.count),
            x3: receivers.x3.unwrap_or(default.receivers.x3),
        }),
    }
}
