//! Random elasticities, and random pores of a bone, all of them valid.

use osteon_common::bone::Bone;
use osteon_common::bone_structure::{
    BoneStructure, MeanSolid, MeanSublayer, PorosityProfile, ProfileShape, thickness,
};
use osteon_common::case::Setup;
use osteon_common::elasticity::Elasticity;
use osteon_common::limits::SUBLAYERS_MAX;
use osteon_common::porosity::{Homogenisation, PoreFluid, PorosityModel};
use proptest::prelude::*;

pub(super) fn structure() -> impl Strategy<Value = BoneStructure> {
    let shape = prop::sample::select(ProfileShape::ALL.to_vec());
    let homogenisation = prop::sample::select(Homogenisation::ALL.to_vec());
    let porosities = (any::<bool>(), 0.01..0.32, 0.01..0.32);
    (porosities, shape, 2_u32..=16, homogenisation, 0.0..1e10, 0.0..1600.0).prop_map(
        |((is_profile, one, other), shape, sublayers, homogenisation, bulk_modulus, density)| {
            let model =
                PorosityModel { homogenisation, fluid: PoreFluid { bulk_modulus, density } };
            let mut structure = BoneStructure { model, ..BoneStructure::default() };
            if !is_profile {
                structure.porosity = Some(one);
                return structure;
            }
            let profile = PorosityProfile {
                surface: Some(one),
                marrow: Some(other),
                shape,
                sublayers,
                ..PorosityProfile::default()
            };
            structure.profile = match shape {
                ProfileShape::Linear => profile,
                ProfileShape::Endosteal => PorosityProfile { sublayers: 6, ..profile },
                ProfileShape::Table => PorosityProfile {
                    shape,
                    values: vec![one, other, one],
                    ..PorosityProfile::default()
                },
            };
            structure
        },
    )
}

/// A bone of sublayers, of which at least one has a porosity.
pub(super) fn layered() -> impl Strategy<Value = BoneStructure> {
    let thickness = || 1e-4..1e-3;
    let solid = (1500.0..2200.0, elasticity())
        .prop_map(|(density, elasticity)| MeanSolid::Given(Box::new(Bone { density, elasticity })));
    let solid = prop_oneof![(0.01..0.32).prop_map(MeanSolid::Porous), solid];
    let lower = prop::collection::vec((thickness(), solid), 0..SUBLAYERS_MAX);
    (0.01..0.32, thickness(), lower, 0.0..1e10).prop_map(
        |(porosity, thickness, lower, bulk_modulus)| {
            let first = (thickness, MeanSolid::Porous(porosity));
            let sublayer = |(thickness, solid)| MeanSublayer { thickness, solid };
            let sublayers = [first].into_iter().chain(lower).map(sublayer).collect();
            let fluid = PoreFluid { bulk_modulus, ..PoreFluid::default() };
            let model = PorosityModel { fluid, ..PorosityModel::default() };
            BoneStructure { sublayers, model, ..BoneStructure::default() }
        },
    )
}

/// Returns a setup with this structure of the bone: with sublayers, its thickness is that of all together.
pub(super) fn with_structure(mut setup: Setup, structure: BoneStructure) -> Setup {
    if structure.is_layered() {
        setup.layers.bone_thickness = thickness(&structure.sublayers);
    }
    Setup { structure, ..setup }
}

/// Positive definite, of any size between 1 Pa and 1e12 Pa, with all 36 entries.
pub(super) fn elasticity() -> impl Strategy<Value = Elasticity> {
    let entries = prop::array::uniform32(-1.0..1.0);
    (entries, 1.0..1e12).prop_filter_map("not positive definite", |(entries, scale)| {
        let mut rows = [[0.0; 6]; 6];
        for i in 0..6 {
            for j in 0..6 {
                let product: f64 = (0..5).map(|m| entries[5 * i + m] * entries[5 * j + m]).sum();
                rows[i][j] = scale * (product + if i == j { 1.0 } else { 0.0 });
            }
        }
        Elasticity::new(rows).ok()
    })
}
