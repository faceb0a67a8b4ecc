//! Rules on layers, probe, picking and solver.

use crate::accepted::{Interval, written};
use crate::bone::Sublayers;
use crate::bone_structure::BoneStructure;
use crate::case::Setup;
use crate::limits::{self, SUBLAYER_THICKNESS_MIN};
use crate::plausible::{self, short};
use crate::probe::Probe;
use crate::sampling::pair_count;
use crate::settings::Method;
use crate::setup_quantity::SetupQuantity;
use crate::violations::Violations;

use super::bone_structure::bone_structure;
use super::pulse::pulse;
use super::section::section;
use super::value::{known_wrong, quantity};

/// Records all violations of `setup`.
pub fn setup(setup: &Setup, violations: &mut Violations) {
    let (mut checked, mut default) = (setup.clone(), Setup::default());
    for ((key, declared), (_, default)) in checked.sections().into_iter().zip(default.sections()) {
        if key.name == "probe" {
            // The range of the heights is narrower than that of their keys.
            heights(setup, violations);
        }
        section(key.name, declared, default, violations);
    }
    bone_structure(&setup.structure, violations);
    thinnest_sublayer(setup, violations);
    pulse(&setup.probe, violations);
    distance(&setup.probe, violations);
    one_side(&setup.probe, violations);
    element_width(setup, violations);
    tilted(setup, violations);
    a0_in_fluids(setup, violations);
    method(setup, violations);
    sampling(setup, violations);
}

/// Checks the thickness of the sublayers where that of the bone is not theirs together: there is a random,
/// searched or known one, or a profile.
fn thinnest_sublayer(setup: &Setup, violations: &mut Violations) {
    let field = SetupQuantity::BoneThickness.mean_key();
    if known_wrong(field, violations) || violations.has_at_or_below(BoneStructure::KEY.name) {
        return;
    }
    let whole = setup.layers.bone_thickness;
    let Some(thinnest) = setup.structure.thinnest(whole) else { return };
    if !Sublayers::THICKNESS.contains(thinnest) {
        let message = format!(
            "is {}, with which the thinnest sublayer of the bone has {} m; each must have at least {} m",
            written(whole),
            short(thinnest),
            written(SUBLAYER_THICKNESS_MIN)
        );
        violations.add(field, message);
    }
}

/// Checks that source and receivers lie inside fluid 1: 0 < x3 < h1.
fn heights(setup: &Setup, violations: &mut Violations) {
    let top = setup.layers.coupling.whole_thickness();
    let accepted = if violations.has_at_or_below("layers.coupling") {
        Interval::above(0.0, "m")
    } else {
        Interval::between(0.0, top, "m, inside the coupling layer")
    };
    let (source, receivers) = (setup.probe.source.x3, setup.probe.receivers.x3);
    quantity("probe.source.x3", source, accepted, &plausible::HEIGHT, violations);
    quantity("probe.receivers.x3", receivers, accepted, &plausible::HEIGHT, violations);
}

/// Checks that the receivers are not metres away. Along the bone only differences matter, so the
/// unit is recognized by the distance.
fn distance(probe: &Probe, violations: &mut Violations) {
    const FIELD: &str = "probe.receivers.first_x1";
    if known_wrong(FIELD, violations) || known_wrong("probe.source.x1", violations) {
        return;
    }
    let (first, source) = (probe.receivers.first_x1, probe.source.x1);
    let distance = (first - source).abs();
    if !plausible::DISTANCE.is_impossible(distance) {
        return;
    }
    let (accepted, asked_for) = (Interval::finite("m"), plausible::DISTANCE.asked_for());
    let question = |value| plausible::DISTANCE.question(&[value], accepted);
    if let Some(question) = question(first) {
        violations.add(FIELD, format!("is {first:?}; {asked_for}: {question}"));
    } else if let Some(question) = question(distance) {
        let message =
            format!("is {first:?}, {distance:?} m from the source; {asked_for}: {question}");
        violations.add(FIELD, message);
    }
}

/// Checks that all receivers lie on one side of the source, at a distance, and apart from each
/// other.
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

/// Checks that no two elements overlap, and that they lie in one fluid.
fn element_width(setup: &Setup, violations: &mut Violations) {
    const FIELD: &str = "probe.element_width";
    let probe = &setup.probe;
    if violations.has_at_or_below("probe") {
        return;
    }
    if probe.element_width > 0.0 && !setup.layers.coupling.sublayers.is_empty() {
        let message = "is given together with layers.coupling.sublayers, and elements of a width are \
                       computed in one fluid alone; leave one of them out";
        return violations.add(FIELD, message);
    }
    let nearest = probe.distances().fold(probe.receivers.pitch, f64::min);
    if probe.element_width >= nearest {
        violations.add(
            FIELD,
            format!(
                "is {:?}; elements must not overlap: it must be below {nearest:?} m, the distance of the \
                 nearest two of source and receivers",
                probe.element_width
            ),
        );
    }
}

/// Checks that A0 between fluids is that of half-spaces.
fn a0_in_fluids(setup: &Setup, violations: &mut Violations) {
    let layers = &setup.layers;
    let fluids = [("coupling", layers.coupling_fluids()), ("marrow", layers.marrow_fluids())];
    for (name, fluids) in fluids {
        let count = fluids.as_slice().len();
        if setup.probe.a0_in_fluids && count > 1 {
            let message = format!(
                "is true, and layers.{name} has {count} fluids; between half-spaces of one fluid each A0 is \
                 known: leave out layers.{name}.sublayers, or set it to false"
            );
            violations.add("probe.a0_in_fluids", message);
        }
    }
}

/// Checks that a tilted probe remains inside fluid 1, and in front of its source.
fn tilted(setup: &Setup, violations: &mut Violations) {
    let probe = &setup.probe;
    let known_wrong =
        ["probe", "layers.coupling"].iter().any(|field| violations.has_at_or_below(field));
    if known_wrong || probe.tilt == 0.0 {
        return;
    }
    let top = setup.layers.coupling.whole_thickness();
    let other_side = probe.bidirectional.then(|| probe.from_other_side());
    for probe in [probe.clone()].into_iter().chain(other_side) {
        let heights = || probe.places().map(|place| place.x3).chain([probe.source.x3]);
        // Elements reach up and down by half their extent.
        let reach = 0.5 * probe.element_extent().1.abs();
        let lowest = heights().fold(f64::INFINITY, f64::min) - reach;
        let highest = heights().fold(f64::NEG_INFINITY, f64::max) + reach;
        if !(lowest > 0.0 && highest < top) {
            violations.add(
                "probe.tilt",
                format!(
                    "is {:?}; source and receivers would be {lowest:.2e} to {highest:.2e} m above the \
                     bone, and must be inside the coupling layer, 0 to {top:?} m: lower the tilt, \
                     raise probe.source.x3 and probe.receivers.x3, or enlarge \
                     layers.coupling.thickness",
                    setup.probe.tilt
                ),
            );
            return;
        }
    }
    if probe.places().any(|place| place.x <= probe.element_extent().0) {
        violations.add(
            "probe.tilt",
            format!(
                "is {:?}; a receiver would be on the other side of the source: lower the tilt, or \
                 bring probe.source.x3 and probe.receivers.x3 nearer to each other",
                probe.tilt
            ),
        );
    }
}

/// Checks that the method computes what is asked for.
fn method(setup: &Setup, violations: &mut Violations) {
    let Some((field, name)) = setup.only_exact() else { return };
    match setup.solver.method {
        Method::Exact => {}
        Method::Hybrid => violations.add(
            field,
            format!(
                "the method \"hybrid\" computes no {name}; leave it out, or set solver.method = \
                 \"exact\""
            ),
        ),
    }
}

/// Checks that the exact method's sampling of frequencies and wavenumbers stays within its limit.
fn sampling(setup: &Setup, violations: &mut Violations) {
    match setup.solver.method {
        Method::Exact => {}
        // Its solver bounds the work on each bone.
        Method::Hybrid => return,
    }
    let fields = ["layers", "probe", "picking", "solver"];
    if fields.iter().any(|field| violations.has_at_or_below(field)) {
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
