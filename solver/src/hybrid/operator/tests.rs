use osteon_common::bone::{Bone, BoneRef};
use osteon_common::case::Setup;
use osteon_common::fluid_sublayers::{FluidSublayer, FluidSublayers};
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;

use super::*;
use crate::hybrid::element::Element;
use crate::hybrid::mesh::LayerMesh;
use crate::hybrid::scope::Scope;
use crate::hybrid::stepping::{WaveState, smooth_start, stability_limit};
use crate::lanes::LANES;
use crate::vector::Scalar;

/// A triclinic draw.
fn bone() -> Bone {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.3]);
    Ensemble::new(&point, 11).unwrap().bone(0).unwrap()
}

fn whole() -> Sublayers {
    BoneRef::from(&bone()).sublayers(4e-3)
}

fn fluids(all: &[(f64, f64, f64)]) -> FluidSublayers {
    let one =
        |&(thickness, density, sound_speed)| FluidSublayer { thickness, density, sound_speed };
    FluidSublayers::new(&all.iter().map(one).collect::<Vec<_>>()).unwrap()
}

/// Unlike fluids, three above the bone and two below it, and layers of unlike elements.
fn setup() -> Setup {
    let mut setup = Setup::default();
    let above = [(1.5e-3, 1000.0, 1500.0), (1e-3, 930.0, 1440.0), (2.5e-3, 1060.0, 1570.0)];
    setup.layers.coupling.sublayers = fluids(&above);
    setup.layers.marrow.sublayers = fluids(&[(2e-3, 930.0, 1440.0), (1e-3, 1040.0, 1530.0)]);
    setup
}

fn mesh() -> Mesh {
    let scope = Scope::until_direct_wave(&setup(), 4500.0);
    let in_fluid = |fluid: &FluidSublayer| if fluid.density < 1000.0 { 0.8e-3 } else { 0.7e-3 };
    Mesh::with_sizes(&setup(), &whole(), &scope, 6, in_fluid, |_| 0.9e-3)
}

fn wavenumbers() -> Lanes {
    Lanes(std::array::from_fn(|lane| 700.0 * lane as f64))
}

/// A state without symmetry, zero at the free ends.
fn noise<const C: usize>(operator: &Operator<C>, seed: u64) -> Vec<Lanes> {
    let mut state = seed;
    let mut next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut x: Vec<Lanes> =
        (0..operator.len()).map(|_| Lanes(std::array::from_fn(|_| next()))).collect();
    let (coupling, solid, _) = operator.lengths();
    x[coupling - C..coupling].fill(Lanes::ZERO);
    x[coupling + solid..coupling + solid + MARROW].fill(Lanes::ZERO);
    // Both nodes on a joint of two fluids have one pressure.
    let (mesh, order) = (mesh(), mesh().element.count() - 1);
    for (fluids, from, c) in [(&mesh.coupling, 0, C), (&mesh.marrow, coupling + solid, MARROW)] {
        let mut node = 0;
        for lower in &fluids[..fluids.len() - 1] {
            node += lower.mesh.elements * order + 1;
            let joint = from + node * c;
            x.copy_within(joint - c..joint, joint);
        }
    }
    x
}

fn apply<const C: usize>(operator: &Operator<C>, k: Lanes, x: &[Lanes]) -> Vec<Lanes> {
    let mut scratch = Scratch::default();
    let mut out = vec![Lanes::ZERO; x.len()];
    operator.apply::<Scalar, Keep>(k, x, Lanes::ZERO, &mut scratch, &mut out, &mut Keep);
    out
}

/// Masses of the nodes of one layer, per unit of `factor`.
fn masses(mesh: &LayerMesh, element: &Element, factor: f64) -> Vec<f64> {
    let count = element.count();
    let mut masses = vec![0.0; mesh.elements * (count - 1) + 1];
    for e in 0..mesh.elements {
        for i in 0..count {
            masses[e * (count - 1) + i] += factor * element.weights[i] * 0.5 * mesh.size;
        }
    }
    masses
}

/// The inner product diag(Ks, Mf), lane by lane: the solid's own stiffness, taken from the operator
/// with no pressure, and the fluids' masses.
fn inner<const C: usize>(operator: &Operator<C>, k: Lanes, x: &[Lanes], y: &[Lanes]) -> Lanes {
    let (mesh, bone) = (mesh(), bone());
    let (coupling, solid, _) = operator.lengths();
    let mut u = y.to_vec();
    u[..coupling].fill(Lanes::ZERO);
    u[coupling + solid..].fill(Lanes::ZERO);
    let forces = apply(operator, k, &u);
    let scale = 1060.0 * 1570.0 * 1570.0 / LENGTH;
    let mut sum = Lanes::ZERO;
    let mut add = |i: usize, mass: f64, with: Lanes| {
        sum = (Lanes::splat(mass) * x[i]).mul_add(with, sum);
    };
    // Displacements carry `scale`, once in each factor.
    let solid_masses = masses(&mesh.bone[0], &mesh.element, bone.density / (scale * scale));
    for (node, &mass) in solid_masses.iter().enumerate() {
        for c in 0..SOLID {
            let i = coupling + node * SOLID + c;
            add(i, mass, -forces[i]);
        }
    }
    for (fluids, from, c) in [(&mesh.coupling, 0, C), (&mesh.marrow, coupling + solid, MARROW)] {
        let of_fluid = |FluidMesh { fluid, mesh: layer }: &FluidMesh| {
            let factor = 1.0 / (fluid.density * fluid.sound_speed * fluid.sound_speed);
            masses(layer, &mesh.element, factor)
        };
        for (node, mass) in fluids.iter().flat_map(of_fluid).enumerate() {
            for i in from + node * c..from + (node + 1) * c {
                add(i, mass, y[i]);
            }
        }
    }
    sum
}

#[test]
fn the_operator_is_self_adjoint_and_not_positive() {
    let operator = Operator::<2>::new(&whole(), &mesh());
    let k = wavenumbers();
    let (x, y) = (noise(&operator, 1), noise(&operator, 2));
    let one = inner(&operator, k, &x, &apply(&operator, k, &y));
    let other = inner(&operator, k, &y, &apply(&operator, k, &x));
    let own = inner(&operator, k, &x, &apply(&operator, k, &x));
    for lane in 0..LANES {
        assert!(own.0[lane] < 0.0);
        assert!((one.0[lane] - other.0[lane]).abs() < 1e-11 * own.0[lane].abs(), "lane {lane}");
    }
}

#[test]
fn energy_without_source_is_conserved() {
    let operator = Operator::<2>::new(&whole(), &mesh());
    let k = wavenumbers();
    let mut state = WaveState::default();
    let step = 0.9 * stability_limit::<Scalar, _>(&operator, k.0[LANES - 1], &mut state);
    state.reset(&operator);
    state.now = noise(&operator, 3);
    state.before = noise(&operator, 4);
    // The scheme is x⁺ - 2x + x⁻ = step² B x with B = A + step²/12 A², and keeps
    // |x⁺ - x|² - step² (x⁺, B x).
    let energy = |state: &WaveState| {
        let once = apply(&operator, k, &state.before);
        let twice = apply(&operator, k, &once);
        let bent: Vec<Lanes> = once
            .iter()
            .zip(&twice)
            .map(|(&a, &b)| Lanes::splat(step * step / 12.0).mul_add(b, a))
            .collect();
        let change: Vec<Lanes> =
            state.now.iter().zip(&state.before).map(|(&now, &before)| now - before).collect();
        inner(&operator, k, &change, &change)
            - Lanes::splat(step * step) * inner(&operator, k, &state.now, &bent)
    };
    let before = energy(&state);
    for _ in 0..2000 {
        state.step::<Scalar, _>(&operator, k, [Lanes::ZERO; 3], step);
    }
    let after = energy(&state);
    for lane in 0..LANES {
        assert!(before.0[lane] > 0.0);
        let drift = after.0[lane] / before.0[lane] - 1.0;
        assert!(drift.abs() < 1e-9, "lane {lane}: {drift:e}");
    }
}

/// Drives the bone's face by a smooth load; the states of fluid 1 at the end.
fn drive_face<const C: usize>() -> Vec<Lanes> {
    let operator = Operator::<C>::new(&whole(), &mesh());
    let k = wavenumbers();
    let mut state = WaveState::default();
    let step = stability_limit::<Scalar, _>(&operator, k.0[LANES - 1], &mut state);
    let load = |n: usize| {
        let t = n as f64 * step / 0.3e-6 - 6.1;
        Lanes::splat(libm::exp(-t * t))
    };
    state.start::<Scalar, _>(&operator, k, smooth_start([load(1), load(2)]), step);
    for n in 1..600 {
        state.step::<Scalar, _>(&operator, k, [load(n - 1), load(n), load(n + 1)], step);
    }
    state.now[..operator.lengths().0].to_vec()
}

#[test]
fn the_pressure_in_fluid_1_is_real_for_a_triclinic_bone() {
    let complex = drive_face::<2>();
    let real = drive_face::<1>();
    let largest = real.iter().flat_map(|p| p.0).fold(0.0, |max: f64, p| max.max(p.abs()));
    for (node, &alone) in complex.chunks_exact(2).zip(&real) {
        for lane in 0..LANES {
            assert!(node[1].0[lane].abs() < 1e-11 * largest, "{}", node[1].0[lane] / largest);
            assert!((node[0].0[lane] - alone.0[lane]).abs() < 1e-11 * largest);
        }
    }
    // And is not so by accident: the bone's motion does depend on the sign of k.
    let u2 = bone().elasticity.component(2, 2, 1, 2);
    assert!(u2.abs() > 1e7, "{u2}");
}

#[test]
fn steps_above_the_limit_grow_without_bound_and_those_below_do_not() {
    let operator = Operator::<1>::new(&whole(), &mesh());
    let k = Lanes::splat(4900.0);
    let mut state = WaveState::default();
    let limit = stability_limit::<Scalar, _>(&operator, 4900.0, &mut state);
    for (share, stable) in [(1.0, true), (1.05, false)] {
        state.reset(&operator);
        state.now = noise(&operator, 5);
        for _ in 0..3000 {
            state.step::<Scalar, _>(&operator, k, [Lanes::ZERO; 3], share * limit);
        }
        let bounded = state.now.iter().flat_map(|p| p.0).all(|p| p.abs() < 1e6);
        assert_eq!(bounded, stable, "{share} of the limit");
    }
}
