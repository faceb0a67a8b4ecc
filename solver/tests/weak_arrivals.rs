//! First arrivals that are small against the waves behind them: nothing that is left out of a quick
//! pass may move them.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use osteon_common::case::{Bone, Setup};
use osteon_common::parameters::Point;
use osteon_common::settings::SolverSettings;
use osteon_solver::{Solver, Workspace};

/// Velocities of a mean model at default settings and at refinement 5.
fn velocities(point: Point, thickness: f64) -> [f64; 2] {
    let elasticity = point.constants().elasticity().unwrap();
    let bone = Bone { density: point.density(), elasticity };
    [1.0, 5.0].map(|refinement| {
        let solver = SolverSettings { refinement, ..SolverSettings::default() };
        let mut setup = Setup { solver, ..Setup::default() };
        setup.layers.bone_thickness = thickness;
        Solver::new(&setup).arrival(&bone, &mut Workspace::default()).unwrap().velocity
    })
}

fn check(name: &str, constants: [f64; 6], bound: f64) {
    let [rho, e_l, nu_l, g_l, e_t, nu_t] = constants;
    let [found, reference] =
        velocities(Point::of_bone([rho, e_l, nu_l, g_l, e_t, nu_t, 0.1]), 4e-3);
    let error = (found / reference - 1.0).abs();
    assert!(error <= bound, "{name}: {found} against {reference}: {error:e}");
}

#[test]
fn a_weak_first_arrival_is_right() {
    // Without the pass in which nothing is thinned out, these are off by 5.8e-4 and 3.2e-4.
    check("stiff across", [1579.81, 17.9107e9, 0.11726, 4.09166e9, 13.1159e9, 0.27735], 1e-4);
    check("in a search's bounds", [1750.0, 20e9, 0.22, 5e9, 10e9, 0.25], 1e-4);
}

#[test]
fn a_bone_whose_waves_hardly_couple_has_a_velocity() {
    for nu in [0.0, 0.005, 0.01, 0.03] {
        check("nearly decoupled", [1598.8, 17e9, nu, 4.8e9, 9.8e9, nu], 1e-4);
    }
}

/// What is computed for neighbouring ranges of speed differs a little; at the edge both count.
#[test]
fn no_velocity_jumps_where_the_sampling_changes() {
    for bin in 17..21 {
        let setup = Setup::default();
        let elasticity =
            Point::of_bone([1700.0, 17e9, 0.37, 4.8e9, 10e9, 0.44, 0.1]).constants().elasticity();
        let bone = Bone { density: 1700.0, elasticity: elasticity.unwrap() };
        let edge = osteon_common::sampling::speed_bin_edge(&setup, bin);
        let ratio = osteon_solver::fastest_wave(&bone) / edge;
        let solver = Solver::new(&setup);
        let [below, above] = [1.0 + 1e-9, 1.0 - 1e-9].map(|factor| {
            let bone = Bone { density: bone.density * ratio * ratio * factor, ..bone };
            solver.arrival(&bone, &mut Workspace::default()).unwrap().velocity
        });
        assert!((above / below - 1.0).abs() < 1e-8, "bin {bin}: {below} and {above}");
    }
}
