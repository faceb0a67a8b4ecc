//! Guided waves of plates and stacks: the fundamental ones and all others in a vacuum, and those between fluids.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]
#![expect(clippy::disallowed_methods, reason = "independent formulas")]

mod finite_elements;
mod fluids;
mod free;
mod fundamental;
mod published;
mod rayleigh_lamb;
mod shapes;

use osteon_common::bone::{Bone, Sublayer, Sublayers};
use osteon_common::case::Setup;
use osteon_common::elasticity::EngineeringConstants;
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_solver::Solver;

fn solver(thickness: f64) -> Solver {
    let mut setup = Setup::default();
    setup.layers.bone_thickness = thickness;
    Solver::new(&setup)
}

fn isotropic(young: f64, poisson: f64) -> Bone {
    let constants = EngineeringConstants {
        longitudinal_young_modulus: young,
        longitudinal_poisson_ratio: poisson,
        longitudinal_shear_modulus: young / (2.0 * (1.0 + poisson)),
        transverse_young_modulus: young,
        transverse_poisson_ratio: poisson,
    };
    Bone { density: 1700.0, elasticity: constants.elasticity().unwrap() }
}

const OPTIMUM: [f64; 6] = [1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495];

fn random_bone(seed: u64, dispersion: f64, index: u64) -> Bone {
    let [a, b, c, d, e, f] = OPTIMUM;
    let point = Point::of_bone([a, b, c, d, e, f, dispersion]);
    Ensemble::new(&point, seed).unwrap().bone(index).unwrap()
}

fn draw(dispersion: f64, index: u64) -> Bone {
    random_bone(23, dispersion, index)
}

fn optimum() -> Bone {
    let [density, e_l, nu_l, g_l, e_t, nu_t] = OPTIMUM;
    let constants = EngineeringConstants {
        longitudinal_young_modulus: e_l,
        longitudinal_poisson_ratio: nu_l,
        longitudinal_shear_modulus: g_l,
        transverse_young_modulus: e_t,
        transverse_poisson_ratio: nu_t,
    };
    Bone { density, elasticity: constants.elasticity().unwrap() }
}

/// Speeds of the waves straight across the plate with displacements along x1, x2 and x3, m/s.
fn across(bone: &Bone) -> [f64; 3] {
    [0, 1, 2].map(|i| (bone.elasticity.component(i, 2, i, 2) / bone.density).sqrt())
}

fn stack(all: &[(f64, Bone)]) -> Sublayers {
    let all: Vec<_> = all.iter().map(|&(thickness, solid)| Sublayer { thickness, solid }).collect();
    Sublayers::new(&all).unwrap()
}
