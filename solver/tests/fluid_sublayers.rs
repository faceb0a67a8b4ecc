//! Sublayers of coupling and marrow: limits, symmetries, and the hybrid method as an independent solution.
//! (`dense_oracle.rs` compares pressures with dense linear algebra.)

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use osteon_common::bone::{Bone, BoneRef, Sublayer, Sublayers};
use osteon_common::case::Setup;
use osteon_common::elasticity::Elasticity;
use osteon_common::fluid_sublayers::{FluidSublayer, FluidSublayers};
use osteon_common::parameters::Point;
use osteon_common::probe::Place;
use osteon_common::realization::Ensemble;
use osteon_common::sampling::direct_arrival;
use osteon_common::settings::Method;
use osteon_solver::{Arrival, Hybrid, HybridWorkspace, Solver, Workspace};

fn draw(dispersion: f64, index: u64) -> Bone {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion]);
    Ensemble::new(&point, 37).unwrap().bone(index).unwrap()
}

/// (thickness, density, speed of sound), downwards.
fn fluids(all: &[(f64, f64, f64)]) -> FluidSublayers {
    let one =
        |&(thickness, density, sound_speed)| FluidSublayer { thickness, density, sound_speed };
    FluidSublayers::new(&all.iter().map(one).collect::<Vec<_>>()).unwrap()
}

fn arrival<'a>(setup: &Setup, bone: impl Into<BoneRef<'a>>) -> Arrival {
    Solver::new(setup).arrival(bone, &mut Workspace::default()).unwrap()
}

fn hybrid<'a>(setup: &Setup, bone: impl Into<BoneRef<'a>>) -> Arrival {
    let mut setup = setup.clone();
    setup.solver.method = Method::Hybrid;
    Hybrid::new(&setup).arrival(bone, &mut HybridWorkspace::default()).unwrap()
}

type Change = fn(&mut Setup);

/// Setups in which every part of the exact method has one fluid and a stack of it.
const CHANGES: [(&str, Change); 4] = [
    ("default", |_| ()),
    ("attenuated", |s| {
        s.layers.coupling.attenuation.quality_factor = Some(40.0);
        s.layers.marrow.attenuation.quality_factor = Some(20.0);
    }),
    ("tilted, in both directions", |s| (s.probe.tilt, s.probe.bidirectional) = (0.04, true)),
    ("near outer faces", |s| {
        s.layers.coupling.thickness = 3e-3;
        s.layers.marrow.thickness = 2e-3;
        s.probe.tilt = 0.01;
    }),
];

/// Replaces both fluids by sublayers of these shares of their thickness, each second one denser by `denser`.
fn divided(setup: &Setup, shares: &[f64], denser: f64) -> Setup {
    let mut new = setup.clone();
    for fluid in [&mut new.layers.coupling, &mut new.layers.marrow] {
        let (whole, density, speed) = (fluid.thickness, fluid.density, fluid.sound_speed);
        let each = |(i, share): (usize, &f64)| {
            let density = if i % 2 == 0 { density } else { density * (1.0 + denser) };
            (whole * share, density, speed)
        };
        let default = Setup::default().layers.coupling;
        (fluid.thickness, fluid.density, fluid.sound_speed) =
            (default.thickness, default.density, default.sound_speed);
        fluid.sublayers = fluids(&shares.iter().enumerate().map(each).collect::<Vec<_>>());
    }
    new
}

#[test]
fn equal_sublayers_are_one_fluid_to_the_bit() {
    let bone = draw(0.2, 3);
    for (name, change) in CHANGES {
        let mut setup = Setup::default();
        change(&mut setup);
        let expected = arrival(&setup, &bone);
        // Thicknesses that add up to the whole to the bit.
        for shares in [&[0.5, 0.5][..], &[0.25; 4]] {
            assert_eq!(arrival(&divided(&setup, shares, 0.0), &bone), expected, "{name}");
        }
    }
    let mut setup = Setup::default();
    setup.layers.coupling.thickness = 6e-3;
    let equal = divided(&setup, &[0.5, 0.5], 0.0);
    assert_eq!(hybrid(&equal, &bone), hybrid(&setup, &bone));
    let traces = |setup: &Setup| Solver::new(setup).traces(&bone, 8e-6, 100e-9).unwrap();
    assert_eq!(traces(&equal), traces(&setup));
}

/// The stack has formulas of its own, which tend to those of one fluid as its densities do.
#[test]
fn nearly_equal_sublayers_are_nearly_one_fluid() {
    let bone = draw(0.2, 3);
    for (name, change) in CHANGES {
        let mut setup = Setup::default();
        setup.solver.refinement = 1.5;
        change(&mut setup);
        let expected = arrival(&setup, &bone).velocity;
        for shares in [&[0.5, 0.5][..], &[0.1, 0.65, 0.15, 0.1]] {
            let changes = [1e-12, 1e-2].map(|denser| {
                arrival(&divided(&setup, shares, denser), &bone).velocity / expected - 1.0
            });
            assert!(changes[0].abs() < 1e-10, "{name}, {shares:?}: {changes:?}");
            // A percent of density reflects half a percent, which a velocity hardly hears, but does.
            assert!((1e-9..1e-3).contains(&changes[1].abs()), "{name}, {shares:?}: {changes:?}");
        }
    }
}

/// The direct wave and its reflections by the joints have a closed form in one fluid, and a sum over
/// wavenumbers of their own in a stack.
#[test]
fn traces_of_nearly_equal_sublayers_are_those_of_one_fluid() {
    let bone = draw(0.3, 5);
    for (tilt, coupling) in [(0.0, 10e-3), (0.04, 4e-3)] {
        let mut setup = Setup::default();
        setup.layers.coupling.thickness = coupling;
        setup.probe.tilt = tilt;
        let traces = |setup| Solver::new(setup).traces(&bone, 12e-6, 100e-9).unwrap().pressures;
        let expected = traces(&setup);
        let largest = expected.iter().flatten().fold(0.0, |largest: f64, p| largest.max(p.abs()));
        // The source is on a joint.
        let found = traces(&divided(
            &setup,
            &[1.0 - 2e-3 / coupling, 1e-3 / coupling, 1e-3 / coupling],
            1e-13,
        ));
        let errors = expected.iter().flatten().zip(found.iter().flatten());
        let error = errors.fold(0.0, |error: f64, (a, b)| error.max((a - b).abs())) / largest;
        // What wraps round differs: the closed form has none.
        assert!(error < 1e-4, "tilt {tilt}: {error:e}");
    }
}

/// Gel, skin, fat and muscle, and marrow of two kinds.
fn limb(setup: &mut Setup) {
    let above = [
        (4e-3, 1020.0, 1530.0),
        (1.5e-3, 1110.0, 1620.0),
        (1e-3, 930.0, 1440.0),
        (1.2e-3, 1060.0, 1570.0),
    ];
    setup.layers.coupling.sublayers = fluids(&above);
    setup.layers.marrow.sublayers = fluids(&[(3e-3, 980.0, 1450.0), (8e-3, 1050.0, 1540.0)]);
    setup.probe.source.x3 = 5e-3;
    setup.probe.receivers.x3 = 4.5e-3;
}

#[test]
fn a_thin_heavy_sublayer_vanishes() {
    let bone = draw(0.1, 2);
    let mut setup = Setup::default();
    limb(&mut setup);
    let three = &setup.layers.coupling.sublayers.as_slice()[1..];
    setup.layers.coupling.sublayers = FluidSublayers::new(three).unwrap();
    (setup.probe.source.x3, setup.probe.receivers.x3) = (3e-3, 2e-3);
    setup.solver.refinement = 1.5;
    let expected = arrival(&setup, &bone).velocity;
    let (above, below) = (setup.layers.coupling.sublayers, setup.layers.marrow.sublayers);
    for place in 0..3 {
        let changes = [1e-5, 1e-6].map(|thickness| {
            let thin = FluidSublayer { thickness, density: 1500.0, sound_speed: 1400.0 };
            let with = |of: &FluidSublayers| {
                let mut all = of.as_slice().to_vec();
                all.insert(place, thin);
                FluidSublayers::new(&all).unwrap()
            };
            let mut changed = setup.clone();
            changed.layers.coupling.sublayers = with(&above);
            changed.layers.marrow.sublayers = with(&below);
            arrival(&changed, &bone).velocity / expected - 1.0
        });
        assert!(changes[0].abs() < 1e-3, "place {place}: {changes:?}");
        assert!(changes[1].abs() < 0.2 * changes[0].abs(), "place {place}: {changes:?}");
    }
}

/// A source in one fluid and receivers in another hear each other alike.
#[test]
fn source_and_receivers_may_be_exchanged() {
    let bone = draw(0.2, 4);
    for (source, receivers) in [(5e-3, 0.6e-3), (1.2e-3, 3e-3), (2.2e-3, 2e-3)] {
        let mut setup = Setup::default();
        limb(&mut setup);
        let mut of = |(source, receivers): (f64, f64)| {
            (setup.probe.source.x3, setup.probe.receivers.x3) = (source, receivers);
            arrival(&setup, &bone)
        };
        let [one, other] = [of((source, receivers)), of((receivers, source))];
        let late =
            one.times.iter().zip(&other.times).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Rounding, amplified by the picking.
        assert!(late < 1e-14, "{source} {receivers}: {late:e} s");
    }
}

/// The time at each receiver of a tilted probe, whose receivers are in three fluids, is that of a level one
/// at its height; so is its trace, with all waves that do not meet the bone.
#[test]
fn tilted_receivers_hear_what_level_ones_do() {
    let bone = draw(0.1, 6);
    let mut setup = Setup::default();
    limb(&mut setup);
    setup.probe.tilt = 0.15;
    setup.probe.source.x3 = 2e-3;
    setup.probe.receivers.x3 = 0.5e-3;
    let level = |setup: &Setup, place: Place| {
        let mut level = setup.clone();
        level.probe.tilt = 0.0;
        level.probe.receivers.x3 = place.x3;
        level.probe.receivers.first_x1 = place.x;
        level
    };
    let places: Vec<Place> = setup.probe.places().collect();
    let traces = |setup: &Setup| Solver::new(setup).traces(&bone, 12e-6, 100e-9).unwrap().pressures;
    let of_tilted = traces(&setup);
    for r in [0, 6, 13] {
        let expected = &traces(&level(&setup, places[r]))[0];
        let largest = expected.iter().fold(0.0_f64, |largest, p| largest.max(p.abs()));
        for (found, expected) in of_tilted[r].iter().zip(expected) {
            assert!((found - expected).abs() < 2e-3 * largest, "{r}: {found} for {expected}");
        }
    }
    setup.solver.refinement = 3.0;
    let found = arrival(&setup, &bone);
    for r in [0, 6, 13] {
        let expected = arrival(&level(&setup, places[r]), &bone).times[0];
        let off = (found.times[r] - expected).abs();
        assert!(off < 3e-11, "receiver {r}: {off:e} s");
    }
}

/// Before the first wave that does not meet the bone a trace has nothing of such waves: it is the same on a
/// face without stiffness, whose response is zero then.
#[test]
fn nothing_arrives_before_the_fastest_way_through_the_fluids() {
    let mut setup = Setup::default();
    limb(&mut setup);
    // A bone that is as good as a vacuum.
    let bone = draw(0.1, 1);
    let rows = bone.elasticity.rows().map(|row| row.map(|entry| 1e-6 * entry));
    let air = Bone { density: 1e-6 * bone.density, elasticity: Elasticity::new(rows).unwrap() };
    let traces = Solver::new(&setup).traces(&air, 14e-6, 25e-9).unwrap();
    for (place, pressures) in setup.probe.places().zip(&traces.pressures) {
        let direct = direct_arrival(&setup, place);
        let largest = pressures.iter().fold(0.0_f64, |largest, p| largest.max(p.abs()));
        let before = traces.times.iter().zip(pressures).filter(|(t, _)| **t < direct - 0.1e-6);
        let early = before.fold(0.0_f64, |early, (_, p)| early.max(p.abs()));
        assert!(early < 3e-3 * largest, "{place:?}: {:e}", early / largest);
    }
}

/// Numbers in 0 … 1.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn within(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.next()
    }

    fn fluids(&mut self, thickness: f64) -> FluidSublayers {
        let count = 1 + (4.0 * self.next()) as usize;
        let shares: Vec<f64> = (0..count).map(|_| self.within(0.3, 1.0)).collect();
        let whole: f64 = shares.iter().sum();
        let all: Vec<_> = shares
            .iter()
            .map(|share| {
                (thickness * share / whole, self.within(900.0, 1200.0), self.within(1400.0, 1650.0))
            })
            .collect();
        fluids(&all)
    }

    fn setup(&mut self) -> Setup {
        let mut setup = Setup::default();
        let (above, below) = (self.within(4e-3, 10e-3), self.within(3e-3, 12e-3));
        setup.layers.coupling.sublayers = self.fluids(above);
        setup.layers.marrow.sublayers = self.fluids(below);
        setup.layers.bone_thickness = self.within(2.5e-3, 5e-3);
        setup.probe.source.x3 = self.within(0.5e-3, 3.5e-3);
        setup.probe.receivers.x3 = self.within(0.5e-3, 3.5e-3);
        setup
    }

    fn bone(&mut self, thickness: f64) -> Sublayers {
        let count = 1 + (3.0 * self.next()) as u32;
        let each = |_| Sublayer {
            thickness: thickness / f64::from(count),
            solid: draw(0.15, (1e6 * self.next()) as u64),
        };
        Sublayers::new(&(0..count).map(each).collect::<Vec<_>>()).unwrap()
    }
}

/// Returns the differences of the velocities that the exact method finds at refinement 1 and at 5 from that
/// of the hybrid one, of one random case.
fn differences(seed: u64) -> [f64; 2] {
    let mut noise = Noise(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let mut setup = noise.setup();
    let bone = noise.bone(setup.layers.bone_thickness);
    setup.layers.bone_thickness = bone.thickness();
    setup.probe.bidirectional = seed.is_multiple_of(2);
    let expected = hybrid(&setup, &bone).velocity;
    [1.0, 5.0].map(|refinement| {
        setup.solver.refinement = refinement;
        arrival(&setup, &bone).velocity / expected - 1.0
    })
}

#[test]
fn random_stacks_agree_with_the_hybrid_method() {
    for seed in 1..=4 {
        let [usual, refined] = differences(seed);
        assert!(usual.abs() < 1e-4 && refined.abs() < 1e-4, "seed {seed}: {usual:e} {refined:e}");
    }
}
