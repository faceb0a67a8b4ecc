//! Elements and depths: to which depth the fluids are meshed, and into how many elements each layer
//! is divided.
//!
//! A fluid is cut off, with p = 0, where no echo of the cut can reach a receiver before the direct
//! wave: the windows are the same as for the whole fluid.

use std::f64::consts::PI;

use osteon_common::bone::{Bone, Sublayer, Sublayers};
use osteon_common::case::Setup;
use osteon_common::fluid_sublayers::{FluidSublayer, FluidSublayers};
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

/// A fluid, as far as it is meshed, with its elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FluidMesh {
    pub(super) fluid: FluidSublayer,
    pub(super) mesh: LayerMesh,
}

/// The mesh of one bone between its fluids.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    pub(super) element: Element,
    /// The fluids above the bone, upwards.
    pub(super) coupling: Vec<FluidMesh>,
    /// The bone's sublayers, downwards.
    pub(super) bone: Vec<LayerMesh>,
    /// The fluids below the bone, upwards.
    pub(super) marrow: Vec<FluidMesh>,
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
        let in_fluid = |fluid: &FluidSublayer| size(fluid.sound_speed);
        let in_solid = |solid: &Bone| size(sublayer_speed(setup, solid));
        let order = setup.solver.element_order as usize;
        Self::with_sizes(setup, bone, scope, order, in_fluid, in_solid)
    }

    /// Creates a mesh of elements of degree `order`, none larger than what `in_fluid` returns (m) in the
    /// fluids, and `in_solid` (m) in the solids of the bone.
    pub(super) fn with_sizes(
        setup: &Setup,
        bone: &Sublayers,
        scope: &Scope,
        order: usize,
        in_fluid: impl Fn(&FluidSublayer) -> f64,
        in_solid: impl Fn(&Bone) -> f64,
    ) -> Self {
        let fluid = |&fluid: &FluidSublayer| FluidMesh {
            fluid,
            mesh: LayerMesh::new(fluid.thickness, in_fluid(&fluid)),
        };
        let fluids = |all: FluidSublayers| all.as_slice().iter().map(fluid).collect();
        let (above, below) = (setup.layers.coupling_fluids(), setup.layers.marrow_fluids());
        let least = below.as_slice().first().map_or(0.0, &in_fluid);
        let sublayer = |one: &Sublayer| LayerMesh::new(one.thickness, in_solid(&one.solid));
        Self {
            element: Element::new(order),
            coupling: fluids(above.between(0.0, coupling_depth(setup, scope))),
            bone: bone.iter().map(sublayer).collect(),
            marrow: fluids(below.between(0.0, marrow_depth(setup, scope, least)).reversed()),
        }
    }

    /// Returns the number of elements of all layers.
    pub(super) fn elements(&self) -> usize {
        let bone: usize = self.bone.iter().map(|sublayer| sublayer.elements).sum();
        let fluids = self.coupling.iter().chain(&self.marrow);
        bone + fluids.map(|fluid| fluid.mesh.elements).sum::<usize>()
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
        let fluids = self.coupling.iter().chain(&self.marrow);
        fluids.fold(of_bone, |largest, one| largest.max(error(&one.mesh, one.fluid.sound_speed)))
    }

    /// Node and weights by which the pressure at height `x3` (m) in fluid 1 is interpolated.
    pub(super) fn receiver(&self, x3: f64) -> (usize, Vec<f64>) {
        let (mut node, mut x3, order) = (0, x3, self.element.count() - 1);
        let mut fluids = self.coupling.iter().peekable();
        while let Some(FluidMesh { fluid, mesh }) = fluids.next() {
            if x3 <= fluid.thickness || fluids.peek().is_none() {
                let e = ((x3 / mesh.size) as usize).min(mesh.elements - 1);
                let local = 2.0 * (x3 / mesh.size - e as f64) - 1.0;
                return (node + e * order, self.element.polynomials_at(local));
            }
            node += mesh.elements * order + 1;
            x3 -= fluid.thickness;
        }
        (node, Vec::new())
    }
}

/// Returns the longest path, m, across the coupling fluid on which a wave can arrive within its
/// window.
pub(super) fn longest_coupling_path(setup: &Setup, scope: &Scope) -> f64 {
    scope.longest_time_across() / slowness(setup.layers.coupling.fastest(), scope.speed)
}

/// Returns the speed, m/s, of the waves for which elements in a sublayer of the bone are made.
///
/// If shear waves in it are slower than sound in the coupling fluid, it is the geometric mean
/// of the two: the slowest waves contribute little to the first arrival.
fn sublayer_speed(setup: &Setup, solid: &Bone) -> f64 {
    let fluids = setup.layers.coupling_fluids();
    let on_face = fluids.as_slice().first().map_or(0.0, |fluid| fluid.sound_speed);
    (on_face * Medium::new(solid).slowest_across()).sqrt()
}

/// Returns the depth of fluid 1 that is meshed, m: the wave goes from the source to the bone, then
/// up to the cut and down to the receiver. In a stack, the source's wave is stepped through the mesh, too,
/// and may come to the bone by way of the cut.
fn coupling_depth(setup: &Setup, scope: &Scope) -> f64 {
    let (source, receivers) = (setup.probe.source.x3, setup.probe.receivers.x3);
    let higher = receivers - source;
    let (higher, least) = match setup.layers.coupling_fluids().as_slice() {
        [_] => (higher, receivers),
        _ => (higher.abs(), receivers.max(source)),
    };
    let heard = 0.5 * (longest_coupling_path(setup, scope) + higher);
    (DEPTH_MARGIN * heard.max(least)).min(setup.layers.coupling.whole_thickness())
}

/// Returns the depth of fluid 2 that is meshed, m; at least one element of `size`.
fn marrow_depth(setup: &Setup, scope: &Scope, size: f64) -> f64 {
    let marrow = &setup.layers.marrow;
    let heard = 0.5 * scope.longest() / slowness(marrow.fastest(), scope.speed);
    (DEPTH_MARGIN * heard).max(size).min(marrow.whole_thickness())
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
            assert!((mesh.coupling[0].mesh.size / 0.5e-3 - 1.0).abs() < 0.1);
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
        let depth = |fluids: &[FluidMesh]| {
            fluids.iter().fold(0.0, |sum, one| sum + one.mesh.elements as f64 * one.mesh.size)
        };
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
