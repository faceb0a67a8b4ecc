//! Random quantities of the setup, against quadrature over fixed ones.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use osteon_common::bone_structure::{PorosityProfile, ProfileShape};
use osteon_common::case::Setup;
use osteon_common::germ_source::{GermScheme, GermSource};
use osteon_common::moments::Moments;
use osteon_common::parameters::Point;
use osteon_common::random_quantities::{RandomDistribution, RandomQuantities, Scatter};
use osteon_common::realization::{Ensemble, mean_bone};
use osteon_common::settings::SolverSettings;
use osteon_common::setup_quantity::SetupQuantity;
use osteon_common::statistics::moments;
use osteon_solver::{Isa, Solver, Workspace};

/// The paper's optimum with nearly no dispersion, so that the velocity is a function of the random
/// quantity alone.
const MEAN_MODEL: Point =
    Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 1e-9]);
/// Number of realizations, a power of two.
const REALIZATIONS: u64 = 128;

/// Nodes and weights of Gauss-Legendre quadrature for a uniform variable with mean 0 and variance 1.
fn quadrature() -> [(f64, f64); 5] {
    let root = (10.0_f64 / 7.0).sqrt();
    let outer = (5.0 + 2.0 * root).sqrt() / 3.0;
    let inner = (5.0 - 2.0 * root).sqrt() / 3.0;
    let seventy = 13.0 * 70.0_f64.sqrt();
    let (far, near) = ((322.0 - seventy) / 1800.0, (322.0 + seventy) / 1800.0);
    let nodes = [(-outer, far), (-inner, near), (0.0, 64.0 / 225.0), (inner, near), (outer, far)];
    nodes.map(|(node, weight)| (3.0_f64.sqrt() * node, weight))
}

fn by_quadrature(setup_at: impl Fn(f64) -> Setup) -> Moments {
    let (rule, mut workspace) = (quadrature(), Workspace::default());
    let velocities = rule.map(|(node, _)| {
        let setup = setup_at(node);
        let bone = mean_bone(&MEAN_MODEL, &setup).unwrap();
        Solver::new(&setup).arrival(&bone, &mut workspace).unwrap().velocity
    });
    let mean_of = |f: &dyn Fn(f64) -> f64| -> f64 {
        velocities.iter().zip(rule).map(|(v, (_, weight))| weight * f(*v)).sum()
    };
    let mean = mean_of(&|v| v);
    let variance = mean_of(&|v| (v - mean) * (v - mean));
    Moments { mean, coefficient_of_variation: variance.sqrt() / mean }
}

fn by_realizations(setup: &Setup, random: RandomQuantities) -> Moments {
    let germs = GermSource { seed: 4, scheme: GermScheme::Sobol { points: REALIZATIONS } };
    let ensemble = Ensemble::drawn(&MEAN_MODEL, germs).unwrap().with_random(random);
    let (solver, mut workspace) = (Solver::with_isa(setup, Isa::fastest()), Workspace::default());
    let velocity = |index| solver.realization(&ensemble, index, &mut workspace).outcome.unwrap();
    let velocities: Vec<f64> = (0..REALIZATIONS).map(velocity).collect();
    moments(&velocities).unwrap()
}

fn check(quantity: SetupQuantity, setup: &Setup, deviation: f64, tolerance: f64) {
    let distribution = RandomDistribution::Uniform;
    let scatter = Scatter { standard_deviation: Some(deviation), distribution };
    let mut random = RandomQuantities::default();
    match quantity {
        SetupQuantity::BoneThickness => random.bone_thickness = scatter,
        SetupQuantity::BoneQualityFactor => random.bone_quality_factor = scatter,
        SetupQuantity::CouplingSoundSpeed => random.coupling_sound_speed = scatter,
        SetupQuantity::ProbeTilt => random.probe_tilt = scatter,
        SetupQuantity::Porosity => random.porosity = scatter,
        SetupQuantity::SurfacePorosity => random.surface_porosity = scatter,
        SetupQuantity::MarrowPorosity => random.marrow_porosity = scatter,
    }
    let mean = quantity.value_in(setup).unwrap();
    let expected = by_quadrature(|node| quantity.with(mean + node * deviation, setup.clone()));
    let found = by_realizations(setup, random);
    let off = found.mean / expected.mean - 1.0;
    let ratio = found.coefficient_of_variation / expected.coefficient_of_variation - 1.0;
    assert!(
        off.abs() < tolerance && ratio.abs() < 1e-2,
        "{quantity:?}: {off:e}, {ratio:e}; {expected:?}"
    );
}

#[test]
fn moments_over_random_setups_are_those_of_quadrature_over_fixed_ones() {
    let mut setup = Setup::default();
    setup.layers.bone_thickness = 2e-3;
    check(SetupQuantity::BoneThickness, &setup, 0.2e-3, 1e-5);
    // It does so little that the errors of refinement 1 would be seen.
    let solver = SolverSettings { refinement: 2.0, ..setup.solver };
    let refined = Setup { solver, ..setup.clone() };
    check(SetupQuantity::CouplingSoundSpeed, &refined, 20.0, 1e-6);
    // One degree: 4.3 % in one direction.
    check(SetupQuantity::ProbeTilt, &setup, 0.017_45, 1e-5);
    setup.layers.bone_attenuation.quality_factor = Some(15.0);
    check(SetupQuantity::BoneQualityFactor, &setup, 1.5, 1e-5);
    let mut setup = Setup::default();
    setup.structure.porosity = Some(0.1);
    check(SetupQuantity::Porosity, &setup, 0.02, 1e-5);
    setup.structure.porosity = None;
    let PorosityProfile { sublayers, .. } = PorosityProfile::default();
    let (surface, marrow) = (Some(0.05), Some(0.15));
    let shape = ProfileShape::Endosteal;
    setup.structure.profile =
        PorosityProfile { surface, marrow, shape, sublayers, ..PorosityProfile::default() };
    check(SetupQuantity::SurfacePorosity, &setup, 0.01, 1e-5);
    check(SetupQuantity::MarrowPorosity, &setup, 0.02, 1e-5);
}

/// Tables are shared between thick plates, and no bit depends on it: of a case that was used before,
/// and of plates that need tables of their own.
#[test]
fn a_realization_has_the_velocity_of_its_own_setup() {
    let germs = GermSource { seed: 4, scheme: GermScheme::Sobol { points: 8 } };
    let mut point = MEAN_MODEL;
    point.0[6] = 0.1029;
    let scatter = Scatter { standard_deviation: Some(0.2e-3), ..Scatter::default() };
    let random = RandomQuantities { bone_thickness: scatter, ..RandomQuantities::default() };
    for (thickness, tilt) in [(4e-3, 0.0), (2.1e-3, 0.0), (3e-3, 0.01)] {
        let mut setup = Setup::default();
        setup.layers.bone_thickness = thickness;
        (setup.probe.tilt, setup.probe.bidirectional) = (tilt, tilt != 0.0);
        let ensemble = Ensemble::drawn(&point, germs).unwrap().with_random(random);
        let (solver, mut workspace) = (Solver::new(&setup), Workspace::default());
        for index in 0..8 {
            let own = Solver::new(&ensemble.own_setup(index, &setup).unwrap());
            let bone = ensemble.bone(index).unwrap();
            let expected = own.arrival(&bone, &mut workspace).unwrap().velocity;
            let found = solver.realization(&ensemble, index, &mut workspace).outcome.unwrap();
            assert_eq!(found.to_bits(), expected.to_bits(), "{thickness} m, {index}");
        }
    }
}
