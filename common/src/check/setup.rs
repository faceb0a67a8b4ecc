//! Rules on layers, probe, picking and solver.

use crate::accepted::{Interval, WholeRange};
use crate::case::Setup;
use crate::layers::{Fluid, Layers};
use crate::limits;
use crate::probe::Probe;
use crate::sampling::pair_count;
use crate::settings::Method;
use crate::violations::Violations;

use super::{known_wrong, number, whole};

/// Range of `probe.receivers.count`.
pub(crate) const RECEIVERS: WholeRange =
    WholeRange::new(limits::RECEIVERS_MIN as u64, limits::RECEIVERS_MAX as u64);

/// Records everything that is wrong with `setup`.
pub fn setup(setup: &Setup, violations: &mut Violations) {
    layers(&setup.layers, violations);
    probe(&setup.probe, violations);
    heights(setup, violations);
    one_side(&setup.probe, violations);
    number(
        "picking.threshold",
        setup.picking.threshold,
        Interval::between(0.0, 1.0, ""),
        violations,
    );
    super::solver::solver(&setup.solver, violations);
    sampling(setup, violations);
}

fn layers(layers: &Layers, violations: &mut Violations) {
    fluid("layers.coupling", &layers.coupling, violations);
    number("layers.bone.thickness", layers.bone_thickness, Interval::above(0.0, "m"), violations);
    fluid("layers.marrow", &layers.marrow, violations);
}

fn fluid(path: &str, fluid: &Fluid, violations: &mut Violations) {
    for (key, value, unit) in [
        ("thickness", fluid.thickness, "m"),
        ("density", fluid.density, "kg/m³"),
        ("sound_speed", fluid.sound_speed, "m/s"),
    ] {
        number(&format!("{path}.{key}"), value, Interval::above(0.0, unit), violations);
    }
}

fn probe(probe: &Probe, violations: &mut Violations) {
    let (source, receivers) = (&probe.source, &probe.receivers);
    let above_zero = |unit| Interval::above(0.0, unit);
    number("probe.center_frequency", probe.center_frequency, above_zero("Hz"), violations);
    number("probe.amplitude", probe.amplitude, above_zero("N"), violations);
    number("probe.source.x1", source.x1, Interval::finite("m"), violations);
    number("probe.receivers.first_x1", receivers.first_x1, Interval::finite("m"), violations);
    number("probe.receivers.pitch", receivers.pitch, above_zero("m"), violations);
    whole("probe.receivers.count", receivers.count.into(), RECEIVERS, violations);
}

/// Source and receivers lie inside fluid 1: 0 < x3 < h1.
fn heights(setup: &Setup, violations: &mut Violations) {
    let top = setup.layers.coupling.thickness;
    let accepted = if known_wrong("layers.coupling.thickness", violations) {
        Interval::above(0.0, "m")
    } else {
        Interval::between(0.0, top, "m, inside the coupling layer")
    };
    number("probe.source.x3", setup.probe.source.x3, accepted, violations);
    number("probe.receivers.x3", setup.probe.receivers.x3, accepted, violations);
}

/// All receivers lie on one side of the source, at a distance, and apart from each other.
fn one_side(probe: &Probe, violations: &mut Violations) {
    let receivers = &probe.receivers;
    let fields = ["receivers.first_x1", "receivers.pitch", "receivers.count", "source.x1"];
    if fields.iter().any(|field| known_wrong(&format!("probe.{field}"), violations)) {
        return;
    }
    let (first, last) = (receivers.x1(0), receivers.x1(receivers.count - 1));
    let span = format!("receivers lie from x1 = {first:?} to {last:?} m");
    let mut neighbours = receivers.positions().zip(receivers.positions().skip(1));
    if !last.is_finite() || neighbours.any(|(x1, next)| x1 >= next) {
        violations.add(
            "probe.receivers.pitch",
            format!("is {:?}; {span}, where neighbours cannot be told apart", receivers.pitch),
        );
        return;
    }
    let source = probe.source.x1;
    if first <= source && last >= source {
        violations.add(
            "probe.receivers.first_x1",
            format!("{span}, the source at {source:?} m; all receivers must lie on one side of it"),
        );
    }
}

/// The exact method's sampling of frequencies and wavenumbers stays within its bound.
fn sampling(setup: &Setup, violations: &mut Violations) {
    if setup.solver.method != Method::Exact {
        return;
    }
    let fields = ["layers", "probe", "picking", "solver"];
    if fields.iter().any(|field| violations.touches(field)) {
        return;
    }
    let pairs = pair_count(setup);
    let max = limits::SAMPLING_PAIRS_MAX;
    if pairs.is_nan() || pairs > max {
        violations.add(
            "solver",
            format!(
                "layers, probe and refinement ask for {pairs:.1e} (frequency, wavenumber) pairs per \
                 realization; at most {max:e} are accepted: lower solver.refinement or \
                 probe.center_frequency, or bring receivers and source nearer to each other"
            ),
        );
    }
}
