//! Elements and depths: to which depth the fluids are meshed, and into how many elements each layer
//! is divided.
//!
//! A fluid is cut off, with p = 0, where no echo of the cut can reach a receiver before the direct
//! wave: the windows are the same as for the whole fluid.

use std::f64::consts::PI;

use osteon_common::bone::{Bone, Sublayer, Sublayers};
use osteon_common::case::Setup;
use osteon_common::sampling::slowness;

use super::element::Element;
use super::scope::Scope;
use crate::medium::Medium;

/// The slowest wavelength at the centre frequency, m, for which `element_size` is meant.
const WAVELENGTH: f64 = 1.5e-3;
/// Depths are increased by this factor, so that an echo is clearly late.
const DEPTH_MARGIN: f64 = 1.02;
/// With this many nodes per wavelength at the centre frequency a mesh resolves the waves, so that
/// agreeing passes are right.
const NODES_PER_WAVELENGTH: f64 = 5.0;
/// Maximum number of elements of a layer that are counted; beyond, the work exceeds its limit
/// anyway.
const ELEMENTS_MAX: f64 = 1e9;

/// Equal elements of one layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LayerMesh {
    pub(super) elements: usize,
    /// Size of an element, m.
    pub(super) size: f64,
}

/// The mesh of one bone between its fluids.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    pub(super) element: Element,
    pub(super) coupling: LayerMesh,
    /// The bone's sublayers, downwards.
    pub(super) bone: Vec<LayerMesh>,
    pub(super) marrow: LayerMesh,
}

impl LayerMesh {
    /// Returns the smallest number of equal elements that are not larger than `size` (m).
    pub(super) fn new(thickness: f64, size: f64) -> Self {
        // A thickness that is a whole number of sizes except for rounding counts as one.
        let elements = (thickness / size * (1.0 - 1e-12)).ceil().clamp(1.0, ELEMENTS_MAX);
        Self { elements: elements as usize, size: thickness / elements }
    }
}

impl Mesh {
    /// Creates the mesh for `scope`, with elements `finer` times smaller than in the setup.
    pub(super) fn new(setup: &Setup, bone: &Sublayers, scope: &Scope, finer: f64) -> Self {
        let frequency = setup.probe.band_unit();
        let size = |slowest: f64| {
            let share = (slowest / frequency / WAVELENGTH).min(1.0);
            setup.solver.element_size * share / finer
        };
        let fluids =
            [size(setup.layers.coupling.sound_speed), size(setup.layers.marrow.sound_speed)];
        let in_solid = |solid: &Bone| size(sublayer_speed(setup, solid));
        let order = setup.solver.element_order as usize;
        Self::with_sizes(setup, bone, scope, order, fluids, in_solid)
    }

    /// Creates a mesh of elements of degree `order`, none larger than `fluids` (m) in fluid 1 and fluid 2,
    /// and what `in_solid` returns (m) in the solids of the bone.
    pub(super) fn with_sizes(
        setup: &Setup,
        bone: &Sublayers,
        scope: &Scope,
        order: usize,
        fluids: [f64; 2],
        in_solid: impl Fn(&Bone) -> f64,
    ) -> Self {
        let [coupling, marrow] = fluids;
        let sublayer = |one: &Sublayer| LayerMesh::new(one.thickness, in_solid(&one.solid));
        Self {
            element: Element::new(order),
            coupling: LayerMesh::new(coupling_depth(setup, scope), coupling),
            bone: bone.iter().map(sublayer).collect(),
            marrow: LayerMesh::new(marrow_depth(setup, scope, marrow), marrow),
        }
    }

    /// Returns the number of elements of all layers.
    pub(super) fn elements(&self) -> usize {
        let bone: usize = self.bone.iter().map(|sublayer| sublayer.elements).sum();
        self.coupling.elements + bone + self.marrow.elements
    }

    /// Returns the largest relative error of the speed of waves at the centre frequency on this
    /// mesh, by the leading term for elements of degree n with lumped mass, (k h)^(2n) (n!/(2n)!)²
    /// / (2n (2n + 1)): Ainsworth and Wajid, SIAM J. Numer. Anal. 47 (2009).
    ///
    /// Only layers with so few nodes per wavelength that two agreeing meshes prove nothing are
    /// counted; the term is larger than 1 where waves are not resolved at all.
    pub(super) fn dispersion(&self, setup: &Setup, bone: &Sublayers) -> f64 {
        let order = self.element.count() - 1;
        let error = |mesh: &LayerMesh, speed: f64| {
            let phase = 2.0 * PI * setup.probe.center_frequency * mesh.size / speed;
            let n = order as f64;
            if 2.0 * PI * n >= NODES_PER_WAVELENGTH * phase {
                return 0.0;
            }
            (1..=order).fold(0.5 / (n * (2.0 * n + 1.0)), |error, j| {
                let ratio = phase / (n + j as f64);
                error * ratio * ratio
            })
        };
        let of_bone = self.bone.iter().zip(bone.iter()).fold(0.0, |largest: f64, (mesh, one)| {
            largest.max(error(mesh, sublayer_speed(setup, &one.solid)))
        });
        error(&self.coupling, setup.layers.coupling.sound_speed)
            .max(of_bone)
            .max(error(&self.marrow, setup.layers.marrow.sound_speed))
    }

    /// Node and weights by which the pressure at height `x3` (m) in fluid 1 is interpolated.
    pub(super) fn receiver(&self, x3: f64) -> (usize, Vec<f64>) {
        let mesh = &self.coupling;
        let e = ((x3 / mesh.size) as usize).min(mesh.elements - 1);
        let local = 2.0 * (x3 / mesh.size - e as f64) - 1.0;
        (e * (self.element.count() - 1), self.element.polynomials_at(local))
    }
}

/// Returns the longest path, m, across the coupling fluid on which a wave can arrive within its
/// window.
pub(super) fn longest_coupling_path(setup: &Setup, scope: &Scope) -> f64 {
    scope.longest_time_across() / slowness(setup.layers.coupling.sound_speed, scope.speed)
}

/// Returns the speed, m/s, of the waves for which elements in a sublayer of the bone are made.
///
/// If shear waves in it are slower than sound in the coupling fluid, it is the geometric mean
/// of the two: the slowest waves contribute little to the first arrival.
fn sublayer_speed(setup: &Setup, solid: &Bone) -> f64 {
    (setup.layers.coupling.sound_speed * Medium::new(solid).slowest_across()).sqrt()
}

/// Returns the depth of fluid 1 that is meshed, m: the wave goes from the source to the bone, then
/// up to the cut and down to the receiver.
fn coupling_depth(setup: &Setup, scope: &Scope) -> f64 {
    let (source, receivers) = (setup.probe.source.x3, setup.probe.receivers.x3);
    let heard = 0.5 * (longest_coupling_path(setup, scope) + receivers - source);
    (DEPTH_MARGIN * heard.max(receivers)).min(setup.layers.coupling.thickness)
}

/// Returns the depth of fluid 2 that is meshed, m; at least one element of `size`.
fn marrow_depth(setup: &Setup, scope: &Scope, size: f64) -> f64 {
    let marrow = &setup.layers.marrow;
    let heard = 0.5 * scope.longest() / slowness(marrow.sound_speed, scope.speed);
    (DEPTH_MARGIN * heard).max(size).min(marrow.thickness)
}

#[cfg(test)]
mod tests {
    use osteon_common::bone::BoneRef;
    use osteon_common::elasticity::EngineeringConstants;

    use super::*;

    fn bone() -> Bone {
        let constants = EngineeringConstants {
            longitudinal_young_modulus: 17.717e9,
            longitudinal_poisson_ratio: 0.3816,
            longitudinal_shear_modulus: 4.795e9,
            transverse_young_modulus: 9.8254e9,
            transverse_poisson_ratio: 0.4495,
        };
        Bone { density: 1598.8, elasticity: constants.elasticity().unwrap() }
    }

    fn whole(bone: &Bone) -> Sublayers {
        BoneRef::from(bone).sublayers(4e-3)
    }

    #[test]
    fn the_slowest_wave_across_is_the_transverse_shear_wave() {
        assert!(
            (Medium::new(&bone()).slowest_across() - (3.389e9_f64 / 1598.8).sqrt()).abs() < 0.1
        );
    }

    #[test]
    fn elements_in_the_bone_follow_the_mean_of_slow_waves_there_and_in_the_coupling() {
        let setup = Setup::default();
        let scope = Scope::until_direct_wave(&setup, 3960.1);
        let mut slow = bone();
        // Four times the density: waves of half the speed, 0.728 mm long; in the fluid 1.5 mm.
        slow.density *= 4.0;
        for (bone, largest) in [(bone(), 0.5e-3 * 0.985), (slow, 0.5e-3 * 0.697)] {
            let mesh = Mesh::new(&setup, &whole(&bone), &scope, 1.0);
            let elements = (4e-3_f64 / largest).ceil();
            assert_eq!(
                mesh.bone,
                [LayerMesh { elements: elements as usize, size: 4e-3 / elements }]
            );
            assert!((mesh.coupling.size / 0.5e-3 - 1.0).abs() < 0.1);
        }
    }

    #[test]
    fn layers_are_cut_into_equal_elements_none_larger() {
        for (thickness, size, elements) in
            [(4e-3, 0.5e-3, 8), (4.01e-3, 0.5e-3, 9), (1e-6, 0.5e-3, 1), (0.3, 0.1, 3)]
        {
            let mesh = LayerMesh::new(thickness, size);
            assert_eq!(mesh.elements, elements);
            assert!(mesh.size <= size * (1.0 + 1e-9));
        }
    }

    #[test]
    fn fluids_end_where_no_echo_is_heard() {
        let setup = Setup::default();
        let scope = Scope::until_direct_wave(&setup, 3960.1);
        let mesh = Mesh::new(&setup, &whole(&bone()), &scope, 1.0);
        // By hand, at the farthest receiver: (14.267 - 5.404) µs / 616.99 µs/m is a path of
        // 14.36 mm, half of it 7.18 mm; below, (14.267 - 5.404 - 2.468) µs leaves 5.18 mm.
        let depth = |mesh: &LayerMesh| mesh.elements as f64 * mesh.size;
        assert!((depth(&mesh.coupling) - 1.02 * 7.182e-3).abs() < 1e-5);
        assert!((depth(&mesh.marrow) - 1.02 * 5.182e-3).abs() < 1e-5);
        // Thin fluids are meshed whole.
        let mut thin = setup;
        thin.layers.coupling.thickness = 4e-3;
        thin.layers.marrow.thickness = 2e-3;
        let mesh = Mesh::new(&thin, &whole(&bone()), &Scope::until_direct_wave(&thin, 3960.1), 1.0);
        assert!((depth(&mesh.coupling) - 4e-3).abs() < 1e-12);
        assert!((depth(&mesh.marrow) - 2e-3).abs() < 1e-12);
    }
}
