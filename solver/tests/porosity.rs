//! Velocities of bones that are given by their porosity.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use osteon_common::bone::{Sublayer, Sublayers};
use osteon_common::case::{Bone, Setup};
use osteon_common::elasticity::EngineeringConstants;
use osteon_common::porosity::{BoneMatrix, CasePorosityModel, Homogenisation};
use osteon_solver::{Solver, Workspace};

/// Returns velocities of the first arriving signal in a plate of 4 mm, m/s.
fn velocities<const N: usize>(bones: [Bone; N]) -> [f64; N] {
    let solver = Solver::new(&Setup::default());
    let mut workspace = Workspace::default();
    bones.map(|bone| solver.arrival(&bone, &mut workspace).unwrap().velocity)
}

/// Returns by how much the velocity falls for one per cent more of pores, m/s, about 10 %.
fn fall(model: &CasePorosityModel) -> f64 {
    let [more, less] = velocities([0.15, 0.05].map(|porosity| model.bone(porosity).unwrap()));
    (less - more) / 10.0
}

/// Returns a model whose matrix has the density of usual bone.
fn model_of_usual_density() -> CasePorosityModel {
    let constants = EngineeringConstants {
        longitudinal_young_modulus: 22e9,
        longitudinal_poisson_ratio: 0.35,
        longitudinal_shear_modulus: 6.5e9,
        transverse_young_modulus: 15e9,
        transverse_poisson_ratio: 0.4,
    };
    let matrix = BoneMatrix { density: 1900.0, constants };
    CasePorosityModel { matrix, ..CasePorosityModel::default() }
}

/// Returns by how much a plate of six sublayers of equal thickness, with these porosities from the skin's side
/// to the marrow's, is faster than a homogeneous one of their mean porosity, m/s.
fn gain_of_profile(model: &CasePorosityModel, thickness: f64, porosities: [f64; 6]) -> f64 {
    let sublayer =
        |porosity| Sublayer { thickness: thickness / 6.0, solid: model.bone(porosity).unwrap() };
    let sublayers = Sublayers::new(&porosities.map(sublayer)).unwrap();
    let mut setup = Setup::default();
    setup.layers.bone_thickness = sublayers.thickness();
    let (solver, mut workspace) = (Solver::new(&setup), Workspace::default());
    let homogeneous = model.bone(porosities.iter().sum::<f64>() / 6.0).unwrap();
    let mean = solver.arrival(&homogeneous, &mut workspace).unwrap().velocity;
    solver.arrival(&sublayers, &mut workspace).unwrap().velocity - mean
}

/// Returns the gain of a linear profile, by the porosities at the middle of each sublayer.
fn gain_of_gradient(model: &CasePorosityModel, thickness: f64, [from, to]: [f64; 2]) -> f64 {
    let middle = |i: u32| (to - from).mul_add((f64::from(i) + 0.5) / 6.0, from);
    gain_of_profile(model, thickness, [0, 1, 2, 3, 4, 5].map(middle))
}

/// In a thick plate the first signal runs in the dense bone below the skin. The expected gains are those of an
/// independent code, which also estimates by Mori and Tanaka, with a matrix of its own.
#[test]
fn a_gradient_is_faster_than_its_mean_in_a_thick_plate_only() {
    let model = model_of_usual_density();
    for (thickness, porosities, expected) in [
        (4e-3, [0.05, 0.15], 45.0),
        (4e-3, [0.04, 0.24], 92.0),
        (1.5e-3, [0.05, 0.15], -2.0),
        (1.5e-3, [0.04, 0.24], -1.0),
    ] {
        let gain = gain_of_gradient(&model, thickness, porosities);
        assert!((gain - expected).abs() < 3.0, "{porosities:?} in {thickness} m: {gain} m/s");
    }
}

/// A dense outer half above a porous endosteal one, of 20 % in its mean: the same independent code says +138 m/s
/// in 4 mm and +5 m/s in 1.5 mm.
#[test]
fn a_porous_endosteal_half_hardly_slows_the_first_signal_of_a_thick_plate() {
    let profile = [0.05, 0.05, 0.05, 0.125, 0.2, 0.275];
    for (thickness, expected) in [(4e-3, 138.0), (1.5e-3, 5.0)] {
        let gain = gain_of_profile(&model_of_usual_density(), thickness, profile);
        assert!((gain - expected).abs() < 3.0, "{thickness} m: {gain} m/s");
    }
}

/// The numbers are those of docs/physics.md, as found when they were written: the matrix decides how fast the
/// velocity falls.
#[test]
fn the_velocity_falls_with_the_porosity() {
    let mut model = CasePorosityModel::default();
    let by_default = fall(&model);
    assert!((by_default - 18.3).abs() < 0.1, "{by_default} m/s");
    model.model.homogenisation = Homogenisation::SelfConsistent;
    let around_bone = fall(&model);
    assert!((around_bone - 20.5).abs() < 0.1, "{around_bone} m/s");
    let of_usual_density = fall(&model_of_usual_density());
    assert!((of_usual_density - 15.1).abs() < 0.1, "{of_usual_density} m/s");
}

/// A tenth of pores in the default matrix is the paper's optimum, whose velocity is 3908.77 m/s. Its six digits
/// leave an uncertainty of a few millionths.
#[test]
fn a_tenth_of_pores_has_the_velocity_of_the_papers_optimum() {
    let [velocity] = velocities([CasePorosityModel::default().bone(0.1).unwrap()]);
    assert!((velocity / 3908.77 - 1.0).abs() < 1e-5, "{velocity} m/s");
}
