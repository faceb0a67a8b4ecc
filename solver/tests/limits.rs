//! What plates become when they are very thick or very thin.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use faer::Mat;
use faer::prelude::Solve as _;
use osteon_common::case::{Bone, Setup};
use osteon_common::elasticity::Elasticity;
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_solver::{Complex, Solver, Workspace, admittance};

const OPTIMUM: [f64; 6] = [1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495];

/// Bone `index` of the paper's optimum with another dispersion.
fn draw(dispersion: f64, seed: u64, index: u64) -> Bone {
    let [density, e_l, nu_l, g_l, e_t, nu_t] = OPTIMUM;
    let point = Point::of_bone([density, e_l, nu_l, g_l, e_t, nu_t, dispersion]);
    Ensemble::new(&point, seed).unwrap().bone(index).unwrap()
}

/// The bone's part that is symmetric in all three planes: the mean of its mirror images.
fn orthotropic(bone: &Bone) -> Bone {
    let mut rows = *bone.elasticity.rows();
    for (i, row) in rows.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            if i != j && (i > 2 || j > 2) {
                *entry = 0.0;
            }
        }
    }
    Bone { elasticity: Elasticity::new(rows).unwrap(), ..*bone }
}

/// Stiffness of a plate along x1 whose faces are free of traction, Pa: A11 - A13 A33⁻¹ A31 of
/// displacements 1 and 2, by the definition (the elasticity is condensed over σ13 = σ23 = σ33 = 0).
fn plane_stress(bone: &Bone) -> [[f64; 2]; 2] {
    let c = |i, j, m, l| bone.elasticity.component(i, j, m, l);
    let a33 = Mat::from_fn(3, 3, |i, m| c(i, 2, m, 2));
    let a31 = Mat::from_fn(3, 3, |i, m| c(i, 2, m, 0));
    let condensed = a33.partial_piv_lu().solve(&a31);
    [0, 1].map(|i| {
        [0, 1].map(|m| {
            let through: f64 = (0..3).map(|q| c(i, 0, q, 2) * condensed[(q, m)]).sum();
            c(i, 0, m, 0) - through
        })
    })
}

fn velocity(setup: &Setup, bone: &Bone) -> f64 {
    Solver::new(setup).arrival(bone, &mut Workspace::default()).unwrap().velocity
}

/// The paper's geometry at refinement 2, for limits that are reached to a thousandth.
fn refined_setup(change: impl Fn(&mut Setup)) -> Setup {
    let mut setup = Setup::default();
    setup.solver.refinement = 2.0;
    change(&mut setup);
    setup
}

#[test]
fn the_first_signal_of_a_thick_plate_is_the_lateral_wave() {
    for index in 0..3 {
        let bone = orthotropic(&draw(0.1029, 31, index));
        let lateral = (bone.elasticity.rows()[0][0] / bone.density).sqrt();
        let behind = |first_x1: f64| {
            let setup = refined_setup(|setup| {
                setup.layers.bone_thickness = 20e-3;
                setup.probe.receivers.first_x1 = first_x1;
                setup.probe.receivers.count = 5;
            });
            1.0 - velocity(&setup, &bone) / lateral
        };
        // The wave front travels at the lateral wave's speed. The first extremum falls behind it, by
        // less and less: a wave along the face of a half space takes its final shape within a
        // few wavelengths (4 mm), with a remainder that falls at least as the inverse distance.
        let by_distance = [10e-3, 20e-3, 40e-3, 80e-3].map(behind);
        for pair in by_distance.windows(2) {
            assert!(0.0 < pair[1] && pair[1] < 0.5 * pair[0], "index {index}: {by_distance:?}");
        }
        assert!(by_distance[3] < 4e-3 / 80e-3 / 30.0, "index {index}: {by_distance:?}");
    }
}

#[test]
fn the_lower_face_of_a_thick_plate_is_not_heard() {
    for index in 0..3 {
        let bone = orthotropic(&draw(0.1029, 31, index));
        let velocity_at = |thickness: f64| {
            velocity(&refined_setup(|setup| setup.layers.bone_thickness = thickness), &bone)
        };
        // To the lower face and back it is longer than to the end of the first packet: what
        // remains is the sampling's error at refinement 2.
        let change = velocity_at(12e-3) / velocity_at(24e-3) - 1.0;
        assert!(change.abs() < 1e-5, "index {index}: {change:e}");
    }
}

#[test]
fn the_first_signal_of_a_thin_plate_is_the_plate_wave() {
    for index in 0..3 {
        let bone = draw(0.1029, 32, index);
        let [[a, b], [_, d]] = plane_stress(&bone);
        let largest = 0.5 * (a + d) + (0.25 * (a - d) * (a - d) + b * b).sqrt();
        let plate = (largest / bone.density).sqrt();
        let ahead = |thickness: f64| {
            velocity(&refined_setup(|setup| setup.layers.bone_thickness = thickness), &bone) / plate
                - 1.0
        };
        // The wavelength is 4 mm. The load of the fluids moves the wave, in proportion to the
        // thickness: 1 % where it is a fortieth of the wavelength.
        let by_thickness = [0.4e-3, 0.2e-3, 0.1e-3].map(ahead);
        for pair in by_thickness.windows(2) {
            assert!(pair[1].abs() < 0.55 * pair[0].abs(), "index {index}: {by_thickness:?}");
        }
        assert!(by_thickness[2].abs() < 0.012, "index {index}: {by_thickness:?}");
    }
}

#[test]
fn a_thin_plate_bends_as_kirchhoff_says() {
    let mut setup = Setup::default();
    // As good as vacuum.
    setup.layers.marrow.density = 1e-12;
    let h = 1e-3;
    setup.layers.bone_thickness = h;
    for index in 0..20 {
        let bone = draw(0.4, 33, index);
        let stiffness = plane_stress(&bone)[0][0];
        for kh in [1e-2, 3e-2] {
            let k = kh / h;
            // Inertia and bending stiffness of one size.
            let s = Complex::new(0.3, 1.0).scale(k * k * h * (stiffness / bone.density).sqrt());
            let bending = stiffness * h * h * h * k * k * k * k / 12.0;
            let expected = (s * s).scale(bone.density * h) + Complex::new(bending, 0.0);
            let found = -(Complex::new(1.0, 0.0) / admittance(&setup, &bone, k, s));
            let error = (found - expected).abs() / expected.abs();
            // Shear and rotary inertia are of second order in k h.
            assert!(error < 0.4 * kh * kh, "index {index}, k h {kh}: {error:e}");
        }
    }
}
