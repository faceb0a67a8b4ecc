use super::*;

use crate::porosity::Homogenisation;

fn matrix() -> Point {
    Point::of_matrix(&BoneMatrix::default(), 0.1)
}

fn profile(surface: f64, marrow: f64, shape: ProfileShape, sublayers: u32) -> BoneStructure {
    let (surface, marrow) = (Some(surface), Some(marrow));
    let profile =
        PorosityProfile { surface, marrow, shape, sublayers, ..PorosityProfile::default() };
    BoneStructure { profile, ..BoneStructure::default() }
}

#[test]
fn sublayers_have_the_porosity_at_their_middle() {
    let check = |shape, sublayers, expected: &[f64]| {
        let BoneStructure { profile, .. } = profile(0.05, 0.15, shape, sublayers);
        let found = profile.of_sublayers().unwrap();
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
    };
    check(ProfileShape::Linear, 2, &[0.075, 0.125]);
    check(ProfileShape::Linear, 4, &[0.0625, 0.0875, 0.1125, 0.1375]);
    check(ProfileShape::Endosteal, 4, &[0.05, 0.15]);
}

#[test]
fn a_table_has_its_porosities_and_their_mean() {
    let values = vec![0.04, 0.05, 0.3];
    let profile =
        PorosityProfile { shape: ProfileShape::Table, values, ..PorosityProfile::default() };
    assert_eq!(profile.of_sublayers(), Some(vec![0.04, 0.05, 0.3]));
    let structure = BoneStructure { profile, ..BoneStructure::default() };
    assert!((structure.mean_porosity().unwrap() - 0.13).abs() < 1e-15);
    let none = PorosityProfile { shape: ProfileShape::Table, ..PorosityProfile::default() };
    assert_eq!((none.is_given(), none.of_sublayers()), (false, None));
}

#[test]
fn a_point_overrides_the_porosities_of_the_setup() {
    let mut point = matrix();
    let setup = BoneStructure { porosity: Some(0.2), ..BoneStructure::default() };
    assert_eq!(setup.at(&point).mean_porosity(), Some(0.2));
    point.0[Parameter::Porosity as usize] = 0.05;
    assert_eq!(setup.at(&point).mean_porosity(), Some(0.05));
    let setup = profile(0.05, 0.15, ProfileShape::Linear, 6);
    let mut point = matrix();
    point.0[Parameter::MarrowPorosity as usize] = 0.25;
    assert!((setup.at(&point).mean_porosity().unwrap() - 0.15).abs() < 1e-15);
    assert_eq!(BoneStructure::default().mean_porosity(), None);
}

#[test]
fn without_pores_the_mean_bone_is_the_mean_model() {
    let (point, structure) = (matrix(), BoneStructure::default());
    let bone = structure.mean_solid(&point).unwrap();
    assert_eq!((bone.density, Ok(bone.elasticity)), (1665.33, point.constants().elasticity()));
    assert_eq!(structure.bulk_velocity(&point).unwrap(), bulk_velocity(&point).unwrap());
}

/// A tenth of water makes the paper's optimum of the default matrix (docs/physics.md).
#[test]
fn the_bulk_velocity_is_that_of_the_porous_bone() {
    let structure = BoneStructure { porosity: Some(0.1), ..BoneStructure::default() };
    let found = libm::exp(structure.bulk_velocity(&matrix()).unwrap().logarithm);
    assert!((found - 3960.1).abs() < 0.1, "{found}");
    let none = bulk_velocity(&matrix()).unwrap().logarithm;
    assert!((libm::exp(none) - 4159.5).abs() < 0.1);
}

/// Twice the step changes a difference quotient by three times the error of the first, which is of the
/// order of the square of its step; here 1e-4 and 2e-4.
#[test]
fn derivatives_are_those_of_differences() {
    for homogenisation in Homogenisation::ALL {
        let model = PorosityModel { homogenisation, ..PorosityModel::default() };
        let structure = BoneStructure { porosity: Some(0.2), model, ..BoneStructure::default() };
        let mut point = matrix();
        point.0[Parameter::Porosity as usize] = 0.12;
        let velocity = structure.bulk_velocity(&point).unwrap();
        for parameter in Parameter::ALL {
            let (place, value) = (parameter as usize, point.get(parameter));
            let at = |step: f64| {
                let mut beside = point;
                beside.0[place] += step * value;
                structure.bulk_velocity(&beside).unwrap().logarithm
            };
            let quotient = |step: f64| (at(step) - at(-step)) / (2.0 * step);
            let (one, two) = (quotient(1e-4), quotient(2e-4));
            let found = velocity.gradient[place] * value;
            assert!(
                (found - one).abs() <= (two - one).abs() + 1e-9,
                "{parameter:?}: {found} {one}"
            );
        }
        let slope = velocity.gradient[Parameter::Porosity as usize];
        assert!((-0.7..-0.4).contains(&slope), "{slope}");
    }
}

#[test]
fn each_solid_is_realized_and_the_thicknesses_are_equal() {
    let point = matrix();
    let realize = |bone: Bone| -> Result<Bone, NoPorousBone> {
        Ok(Bone { density: bone.density + 1.0, ..bone })
    };
    let structure = BoneStructure { porosity: Some(0.1), ..BoneStructure::default() };
    let CaseBone::Homogeneous(bone) = structure.bone(&point.mean_model(), 4e-3, realize).unwrap()
    else {
        panic!("one porosity makes one solid");
    };
    assert_eq!(bone.density, structure.mean_solid(&point).unwrap().density + 1.0);
    let structure = profile(0.05, 0.15, ProfileShape::Linear, 8);
    let CaseBone::Layered(layers) = structure.bone(&point.mean_model(), 4e-3, realize).unwrap()
    else {
        panic!("a profile makes sublayers");
    };
    assert_eq!(layers.lower().len(), 7);
    assert!(layers.iter().all(|layer| layer.thickness == 0.5e-3));
    let mean = layers.iter().map(|layer| layer.solid.density).sum::<f64>() / 8.0;
    assert!((mean - (bone.density)).abs() < 1e-9, "{mean}");
}

#[test]
fn a_solid_that_does_not_exist_is_an_error() {
    let model = PorosityModel {
        homogenisation: Homogenisation::SelfConsistent,
        ..PorosityModel::default()
    };
    let mut structure = profile(0.2, 0.4, ProfileShape::Linear, 4);
    structure.model = model;
    structure.model.fluid.bulk_modulus = 0.0;
    let keep = |bone: Bone| -> Result<Bone, NoPorousBone> { Ok(bone) };
    let found = structure.bone(&matrix().mean_model(), 4e-3, keep);
    assert_eq!(found, Err(NoPorousBone::NoShear));
}

#[test]
fn sublayers_are_realized_each_about_its_own_mean() {
    let stiff = BoneMatrix { density: 1900.0, ..BoneMatrix::default() }.bone().unwrap();
    let sublayers = vec![
        MeanSublayer { thickness: 1e-3, solid: MeanSolid::Given(Box::new(stiff)) },
        MeanSublayer { thickness: 3e-3, solid: MeanSolid::Porous(0.2) },
    ];
    let structure = BoneStructure { sublayers, ..BoneStructure::default() };
    assert_eq!((structure.is_given(), structure.has_pores()), (true, true));
    let porous = structure.model.bone(&BoneMatrix::default(), 0.2).unwrap();
    let bone_at = |thickness| {
        let softer =
            |mean: Bone| Ok::<_, NoPorousBone>(Bone { density: mean.density - 1.0, ..mean });
        structure.bone(&matrix().mean_model(), thickness, softer).unwrap()
    };
    let CaseBone::Layered(found) = bone_at(4e-3) else { panic!("sublayers") };
    let found: Vec<_> =
        found.iter().map(|one| (one.thickness, one.solid.density, one.solid.elasticity)).collect();
    let expected = [
        (1e-3, stiff.density - 1.0, stiff.elasticity),
        (3e-3, porous.density - 1.0, porous.elasticity),
    ];
    assert_eq!(found, expected);
    let CaseBone::Layered(thicker) = bone_at(8e-3) else { panic!("sublayers") };
    assert_eq!(thicker.iter().map(|one| one.thickness).collect::<Vec<_>>(), [2e-3, 6e-3]);
    let mean = structure.mean_solid(&matrix()).unwrap();
    assert!((mean.density - 0.25 * stiff.density - 0.75 * porous.density).abs() < 1e-9);
}
