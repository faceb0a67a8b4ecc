//! Bones of sublayers: limits, symmetries, and what must not depend on the way in which a bone is described.
//! (`dense_oracle.rs` compares their admittance with dense linear algebra.)

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use osteon_common::bone::{Bone, BoneRef, Sublayer, Sublayers};
use osteon_common::case::Setup;
use osteon_common::elasticity::{Elasticity, EngineeringConstants};
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_solver::{Arrival, GuidedWaves, Solver, Workspace};

fn draw(dispersion: f64, index: u64) -> Bone {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion]);
    Ensemble::new(&point, 31).unwrap().bone(index).unwrap()
}

/// The mean elasticity of the paper's optimum, with all moduli multiplied by `factor`.
fn optimum(factor: f64) -> Bone {
    let constants = EngineeringConstants {
        longitudinal_young_modulus: factor * 17.717e9,
        longitudinal_poisson_ratio: 0.3816,
        longitudinal_shear_modulus: factor * 4.795e9,
        transverse_young_modulus: factor * 9.8254e9,
        transverse_poisson_ratio: 0.4495,
    };
    Bone { density: 1598.8, elasticity: constants.elasticity().unwrap() }
}

/// The same bone but for the last bits of its density: its sublayers are not merged.
fn nearly(bone: &Bone, bits: u64) -> Bone {
    Bone { density: f64::from_bits(bone.density.to_bits() + bits), ..*bone }
}

fn stack(all: &[(f64, Bone)]) -> Sublayers {
    let all: Vec<_> = all.iter().map(|&(thickness, solid)| Sublayer { thickness, solid }).collect();
    Sublayers::new(&all).unwrap()
}

/// `count` sublayers of one bone, of which no two neighbours are equal to the bit.
fn divided(bone: &Bone, thickness: f64, count: u64) -> Sublayers {
    let each = |i| (thickness / count as f64, nearly(bone, i % 2));
    stack(&(0..count).map(each).collect::<Vec<_>>())
}

fn arrival<'a>(setup: &Setup, bone: impl Into<BoneRef<'a>>) -> Arrival {
    Solver::new(setup).arrival(bone, &mut Workspace::default()).unwrap()
}

/// Returns the setup with the thickness of these sublayers.
fn with_thickness(setup: &Setup, sublayers: &Sublayers) -> Setup {
    let mut setup = setup.clone();
    setup.layers.bone_thickness = sublayers.thickness();
    setup
}

fn velocity(setup: &Setup, sublayers: &Sublayers) -> f64 {
    arrival(&with_thickness(setup, sublayers), sublayers).velocity
}

#[test]
fn equal_sublayers_are_one_plate_to_the_bit() {
    let bone = draw(0.2, 3);
    let plate = arrival(&Setup::default(), &bone);
    // Thicknesses that add up to 4 mm to the bit.
    for thicknesses in [&[4e-3][..], &[2e-3; 2], &[1e-3; 4], &[1e-3, 2.5e-3, 0.5e-3]] {
        let equal: Vec<_> = thicknesses.iter().map(|&thickness| (thickness, bone)).collect();
        let (equal, count) = (stack(&equal), equal.len());
        assert_eq!(equal.thickness(), 4e-3);
        assert_eq!(arrival(&Setup::default(), &equal), plate, "{count}");
    }
}

type Change = fn(&mut Setup);

/// Setups in which every part of the exact method has a plate and a stack of the same solid.
const CHANGES: [(&str, Change); 4] = [
    ("default", |_| ()),
    ("attenuated", |s| s.layers.bone_attenuation.quality_factor = Some(15.0)),
    ("tilted, in both directions", |s| (s.probe.tilt, s.probe.bidirectional) = (0.02, true)),
    ("thin coupling and marrow", |s| {
        (s.layers.coupling.thickness, s.layers.marrow.thickness) = (3e-3, 2e-3);
    }),
];

/// Slices of a sublayer are thinner than those of the plate where waves are long. At refinement 1 the
/// remainder of their series, 3e-7, differs; above it only roundings do.
#[test]
fn sublayers_of_one_solid_have_the_velocity_of_a_plate() {
    let bone = draw(0.2, 3);
    for (refinement, limit) in [(1.0, 1e-6), (1.5, 1e-12)] {
        for (name, change) in CHANGES {
            let mut setup = Setup::default();
            setup.solver.refinement = refinement;
            change(&mut setup);
            let plate = arrival(&setup, &bone);
            let errors = [2, 3, 8].map(|count| {
                let found = arrival(&setup, &divided(&bone, 4e-3, count));
                (found.velocity / plate.velocity - 1.0).abs()
            });
            assert!(errors.iter().all(|error| *error < limit), "{name}: {errors:?}");
        }
    }
}

#[test]
fn sublayers_of_one_solid_have_the_traces_of_a_plate() {
    let bone = draw(0.3, 5);
    let solver = Solver::new(&Setup::default());
    let plate = solver.traces(&bone, 12e-6, 100e-9).unwrap().pressures;
    let largest = plate.iter().flatten().fold(0.0, |largest: f64, p| largest.max(p.abs()));
    for count in [3, 16] {
        let sublayers = divided(&bone, 4e-3, count);
        let found = solver.traces(&sublayers, 12e-6, 100e-9).unwrap().pressures;
        let errors = plate.iter().flatten().zip(found.iter().flatten());
        let error = errors.fold(0.0, |error: f64, (a, b)| error.max((a - b).abs())) / largest;
        assert!(error < 1e-10, "{count} sublayers: {error:e}");
    }
}

#[test]
fn sublayers_of_one_solid_have_the_guided_waves_of_a_plate() {
    let check = |bone: &Bone, counts: &[u64]| {
        let solver = Solver::new(&Setup::default());
        let numbers = |waves: GuidedWaves| {
            let [a0, s0] = [waves.a0.unwrap(), waves.s0.unwrap()];
            [a0.phase_velocity, s0.phase_velocity, a0.group_velocity, s0.group_velocity]
        };
        let plate = numbers(solver.guided_waves(bone));
        for &count in counts {
            let found = numbers(solver.guided_waves(&divided(bone, 4e-3, count)));
            for (place, (found, plate)) in found.into_iter().zip(plate).enumerate() {
                let error = (found / plate - 1.0).abs();
                // Rounding, which a difference quotient of 1e-4 amplifies for group velocities.
                let limit = if place < 2 { 1e-11 } else { 1e-7 };
                assert!(error < limit, "{count} sublayers, number {place}: {error:e}");
            }
        }
    };
    check(&draw(0.2, 3), &[2, 3, 8]);
    // An odd number is the same from both faces, and has the plate's families of waves.
    check(&optimum(1.0), &[3, 5]);
}

/// Changes the sign of the entries with an odd number of indices `axis`, from 0.
fn mirrored(bone: &Bone, axis: usize) -> Bone {
    const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)];
    let odd = |i: usize| (PAIRS[i].0 == axis) != (PAIRS[i].1 == axis);
    let given = bone.elasticity.rows();
    let sign = |i, j| if odd(i) == odd(j) { 1.0 } else { -1.0 };
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| sign(i, j) * given[i][j]));
    Bone { elasticity: Elasticity::new(rows).unwrap(), ..*bone }
}

#[test]
fn the_mirrored_stack_sends_the_same_wave() {
    let mut setup = Setup::default();
    // Above refinement 1 the series of a slice is summed to rounding.
    setup.solver.refinement = 1.5;
    let of = |change: &dyn Fn(&Bone) -> Bone| {
        let bones = [(1e-3, draw(0.3, 1)), (2.2e-3, draw(0.3, 2)), (0.8e-3, draw(0.3, 6))];
        arrival(&setup, &stack(&bones.map(|(thickness, bone)| (thickness, change(&bone)))))
    };
    let given = of(&|bone| *bone);
    for axis in [0, 1] {
        let found = of(&|bone| mirrored(bone, axis));
        let delays = given.times.iter().zip(&found.times).map(|(a, b)| (a - b).abs());
        let delay = delays.fold(0.0, f64::max);
        // Rounding of Y, amplified by the picking.
        assert!(delay < 1e-13, "across x{}: {delay:e} s", axis + 1);
    }
}

/// The change of the velocity by a sublayer falls with its thickness, wherever it is.
#[test]
fn a_thin_stiff_sublayer_vanishes() {
    let mut setup = Setup::default();
    setup.solver.refinement = 1.5;
    let (bone, stiff) = (draw(0.1, 2), optimum(3.0));
    let plate = velocity(&setup, &stack(&[(4e-3, bone)]));
    for place in 0..3 {
        let changes = [1e-5, 1e-6].map(|thickness| {
            let mut sublayers = vec![(1.5e-3, bone), (2.5e-3, bone)];
            sublayers.insert(place, (thickness, stiff));
            velocity(&setup, &stack(&sublayers)) / plate - 1.0
        });
        assert!(changes[0].abs() < 1e-2, "place {place}: {changes:?}");
        assert!(changes[1].abs() < 0.2 * changes[0].abs(), "place {place}: {changes:?}");
    }
}

/// Six sublayers whose stiffness falls from the skin to the marrow, or rises, about that of the optimum.
#[test]
fn a_gradient_moves_the_velocity_to_the_stiffer_side() {
    let of = |slope: f64| {
        let each = |i: i32| (4e-3 / 6.0, optimum(1.0 + slope * (f64::from(i) / 2.5 - 1.0)));
        velocity(&Setup::default(), &stack(&(0..6).map(each).collect::<Vec<_>>()))
    };
    let mean = of(0.0);
    // The first wave travels where it is fastest, and weakly so if that is far from the skin.
    let (stiff_skin, stiff_marrow) = (of(-0.2), of(0.2));
    assert!(stiff_skin > 1.02 * mean, "{stiff_skin} against {mean} m/s");
    assert!(stiff_skin > stiff_marrow, "{stiff_skin} against {stiff_marrow} m/s");
    // √1.2 is the ratio of the stiffest sublayer's speeds.
    assert!(stiff_skin < 1.2_f64.sqrt() * mean, "{stiff_skin} against {mean} m/s");
}

/// The stated error bounds the difference from a refined solution, also in thin sublayers.
#[test]
fn stated_errors_of_sublayers_hold() {
    for (thickness, count) in [(4e-3, 3_u32), (4e-3, 7), (1e-3, 4)] {
        for index in 0..3 {
            let each = |i| (thickness / f64::from(count), draw(0.2, 10 * index + u64::from(i)));
            let sublayers = stack(&(0..count).map(each).collect::<Vec<_>>());
            let mut setup = with_thickness(&Setup::default(), &sublayers);
            let found = arrival(&setup, &sublayers);
            setup.solver.refinement = 5.0;
            let error = (found.velocity / arrival(&setup, &sublayers).velocity - 1.0).abs();
            let stated = found.estimated_error;
            assert!(error < stated, "{count} of {thickness} m, {index}: {error:e}, {stated:e}");
        }
    }
}
