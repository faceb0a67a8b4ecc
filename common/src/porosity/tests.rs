use super::*;

use crate::fields::{DeclaredValue, entries};

/// The paper's optimum (Sec. 6).
const OPTIMUM: (f64, EngineeringConstants) = (
    1598.8,
    EngineeringConstants {
        longitudinal_young_modulus: 17.717e9,
        longitudinal_poisson_ratio: 0.3816,
        longitudinal_shear_modulus: 4.795e9,
        transverse_young_modulus: 9.8254e9,
        transverse_poisson_ratio: 0.4495,
    },
);

fn close(a: f64, b: f64, relative: f64) {
    assert!((a - b).abs() <= relative * b.abs(), "{a} against {b}");
}

#[test]
fn a_tenth_of_water_in_the_default_matrix_is_the_papers_optimum() {
    let bone = PorosityModel::default().bone(&BoneMatrix::default(), 0.1).unwrap();
    let (density, expected) = OPTIMUM;
    let found = bone.elasticity.engineering_constants();
    // The matrix has six digits.
    close(bone.density, density, 1e-5);
    close(found.longitudinal_young_modulus, expected.longitudinal_young_modulus, 1e-5);
    close(found.longitudinal_poisson_ratio, expected.longitudinal_poisson_ratio, 1e-5);
    close(found.longitudinal_shear_modulus, expected.longitudinal_shear_modulus, 1e-5);
    close(found.transverse_young_modulus, expected.transverse_young_modulus, 1e-5);
    close(found.transverse_poisson_ratio, expected.transverse_poisson_ratio, 1e-5);
}

#[test]
fn without_pores_it_is_the_matrix() {
    let matrix = BoneMatrix::default();
    let bone = PorosityModel::default().bone(&matrix, 0.0).unwrap();
    assert_eq!(bone.density, matrix.density);
    let matrix = matrix.constants.elasticity().unwrap();
    for (found, expected) in bone.elasticity.rows().iter().zip(matrix.rows()) {
        for (found, expected) in found.iter().zip(expected) {
            close(*found, *expected, 1e-14);
        }
    }
}

#[test]
fn the_density_is_that_of_both_volumes() {
    let (mut model, mut matrix) = (PorosityModel::default(), BoneMatrix::default());
    matrix.density = 1900.0;
    model.fluid.density = 900.0;
    assert_eq!(model.bone(&matrix, 0.25).unwrap().density, 1650.0);
}

#[test]
fn what_has_no_stiffness_is_refused() {
    let mut model = PorosityModel {
        homogenisation: Homogenisation::SelfConsistent,
        ..PorosityModel::default()
    };
    let mut matrix = BoneMatrix::default();
    assert!(model.bone(&matrix, 0.49).is_ok());
    assert_eq!(model.bone(&matrix, 0.5), Err(NoPorousBone::NoShear));
    model.fluid.bulk_modulus = 0.0;
    assert_eq!(model.bone(&matrix, 0.4), Err(NoPorousBone::NoShear));
    matrix.constants.longitudinal_poisson_ratio = 0.9;
    assert!(matches!(model.bone(&matrix, 0.1), Err(NoPorousBone::Matrix(_))));
    let mut model = PorosityModel::default();
    model.fluid.bulk_modulus = f64::MAX;
    let none = model.bone(&BoneMatrix::default(), 0.1);
    assert!(matches!(none, Err(NoPorousBone::NotElastic(_))));
}

/// The velocity of compression along the bone falls by as much as that of an independent evaluation, and
/// the self-consistent estimate by a little more.
#[test]
fn the_first_pores_slow_waves_down() {
    let velocity = |homogenisation, porosity| {
        let model = PorosityModel { homogenisation, ..PorosityModel::default() };
        let bone = model.bone(&BoneMatrix::default(), porosity).unwrap();
        (bone.elasticity.rows()[0][0] / bone.density).sqrt()
    };
    for (porosity, expected) in [(0.0, 4159.5), (0.05, 4056.7), (0.1, 3960.1), (0.2, 3777.1)] {
        close(velocity(Homogenisation::MoriTanaka, porosity), expected, 2e-5);
    }
    let around_bone = velocity(Homogenisation::SelfConsistent, 0.2);
    assert!(around_bone > 3600.0 && around_bone < 3777.0, "{around_bone}");
}

#[test]
fn the_matrix_declares_the_parameters_of_a_bone() {
    let keys = entries(&mut CasePorosityModel::default());
    let names: Vec<_> = keys.iter().map(|entry| entry.key.name).collect();
    assert_eq!(names, ["homogenisation", "fluid", "matrix"]);
    let DeclaredValue::Table(matrix) = &keys[2].value else { panic!("{:?}", keys[2]) };
    let names = matrix.iter().map(|entry| entry.key.name);
    let [of_matrix @ .., _dispersion] = Parameter::OF_BONE;
    assert!(names.eq(of_matrix.map(Parameter::name)));
}
