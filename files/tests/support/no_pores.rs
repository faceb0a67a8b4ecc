//! The pores and sublayers that a job has by default: none.

use osteon_common::bone_structure::{BoneStructure, PorosityProfile, ProfileShape};
use osteon_common::porosity::{Homogenisation, PoreFluid, PorosityModel};

pub(crate) const NO_PORES: BoneStructure = BoneStructure {
    porosity: None,
    profile: PorosityProfile {
        surface: None,
        marrow: None,
        shape: ProfileShape::Linear,
        sublayers: 6,
        values: Vec::new(),
    },
    model: PorosityModel {
        homogenisation: Homogenisation::MoriTanaka,
        fluid: PoreFluid { bulk_modulus: 2.3e9, density: 1000.0 },
    },
    sublayers: Vec::new(),
};
