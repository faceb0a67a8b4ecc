//! Fields of guided waves across the bone against closed forms, the equations of motion, and finite elements.

use std::f64::consts::{PI, TAU};

use faer::c64;
use osteon_common::bone::{Bone, BoneRef, Sublayer, Sublayers};
use osteon_common::case::Setup;
use osteon_common::fluid_sublayers::{FluidSublayer, FluidSublayers};
use osteon_solver::{Complex, Isa, Mode, ModeShape, ModesError, ShapeError, ShapePoint, Solver};

use super::finite_elements::FiniteElements;
use super::{across, draw, isotropic, optimum, solver, stack};

/// Displacements and tractions at one depth.
type Values = [c64; 6];

fn values(point: &ShapePoint) -> Values {
    let of = |value: Complex| c64::new(value.re, value.im);
    let [u1, u2, u3] = point.displacement.map(of);
    let [t1, t2, t3] = point.traction.map(of);
    [u1, u2, u3, t1, t2, t3]
}

fn shapes<'a>(
    solver: &Solver,
    bone: impl Into<BoneRef<'a>>,
    frequency: f64,
    depths: usize,
) -> Vec<(Mode, ModeShape)> {
    let bone = bone.into();
    let shape = |mode: Mode| {
        let shape = solver.shape(bone, &mode, depths).unwrap();
        (mode, shape)
    };
    solver.modes(bone, frequency).unwrap().into_iter().map(shape).collect()
}

/// Makes the largest displacement one, and the largest of the first point real and positive.
fn normalize(points: &mut [Values]) {
    let largest = points.iter().flat_map(|point| &point[..3]).map(|u| u.norm()).fold(0.0, f64::max);
    let face = points[0];
    let of_face = face[..3].iter().max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap();
    let factor = of_face.conj() / c64::from(of_face.norm() * largest);
    points.iter_mut().flatten().for_each(|value| *value *= factor);
}

/// Largest difference of displacements, and of tractions in this unit (Pa/m).
fn difference(shape: &ModeShape, expected: &[Values], unit: f64) -> f64 {
    assert_eq!(shape.points.len(), expected.len());
    let of_point = |(point, expected): (&ShapePoint, &Values)| {
        let found = values(point);
        let of = |i: usize| (found[i] - expected[i]).norm() / if i < 3 { 1.0 } else { unit };
        (0..6).map(of).fold(0.0, f64::max)
    };
    shape.points.iter().zip(expected).map(of_point).fold(0.0, f64::max)
}

/// Field of a Lamb wave at a height above the middle, from potentials φ and ψ with u1 = ∂1 φ - ∂3 ψ and
/// u3 = ∂3 φ + ∂1 ψ.
fn lamb_field(bone: &Bone, h: f64, k: f64, omega: f64, symmetric: bool, z: f64) -> Values {
    let (shear, whole) =
        (bone.elasticity.component(0, 2, 0, 2), bone.elasticity.component(2, 2, 2, 2));
    let root = |modulus: f64| c64::from(bone.density * omega * omega / modulus - k * k).sqrt();
    let (p, q, ik) = (root(whole), root(shear), c64::new(0.0, k));
    // φ and its derivative by x3 over p; ψ and its derivative over q.
    let (phi, of_phi) =
        if symmetric { ((p * z).cos(), -(p * z).sin()) } else { ((p * z).sin(), (p * z).cos()) };
    let psi_parts = |z: f64| match symmetric {
        true => ((q * z).sin(), (q * z).cos()),
        false => ((q * z).cos(), -(q * z).sin()),
    };
    let (psi, of_psi) = psi_parts(z);
    let of_phi_at_face = if symmetric { -(p * 0.5 * h).sin() } else { (p * 0.5 * h).cos() };
    // σ13 = shear (2 ∂13 φ + (∂11 - ∂33) ψ) is zero at the face.
    let ratio = ik * 2.0 * p * of_phi_at_face / ((q * q - k * k) * psi_parts(0.5 * h).0);
    let (psi, of_psi) = (psi * ratio, of_psi * ratio);
    let sheared = (-ik * 2.0 * p * of_phi + (q * q - k * k) * psi) * shear;
    let stretch = -(p * p) * phi - ik * q * of_psi;
    let pressed = -(p * p + k * k) * phi * (whole - 2.0 * shear) + stretch * (2.0 * shear);
    let zero = c64::from(0.0);
    [-ik * phi - q * of_psi, zero, p * of_phi - ik * psi, sheared, zero, pressed]
}

#[test]
fn an_isotropic_plate_has_the_fields_of_lamb_and_of_shear() {
    let (thickness, mut worst) = (3e-3, 0.0_f64);
    for poisson in [0.2, 0.3, 0.38] {
        let bone = isotropic(16e9, poisson);
        let shear = across(&bone)[0];
        for scaled in [0.02, 0.3, 0.7, 0.91, 1.6, 3.3, 6.1] {
            let frequency = scaled * shear / thickness;
            for (mode, shape) in shapes(&solver(thickness), &bone, frequency, 40) {
                let (k, omega) = (mode.wavenumber, TAU * frequency);
                let unit = bone.density * shear * shear * omega / shear;
                let field = |point: &ShapePoint| {
                    let z = 0.5 * thickness - point.depth;
                    match mode.name.as_deref().unwrap().strip_prefix("SH") {
                        None => {
                            lamb_field(&bone, thickness, k, omega, mode.family == "symmetric", z)
                        }
                        Some(n) => {
                            let along = PI * n.parse::<f64>().unwrap() / thickness;
                            let phase = along * point.depth;
                            let traction = bone.density * shear * shear * along * phase.sin();
                            let [zero, u2, t2] = [0.0, phase.cos(), traction].map(c64::from);
                            [zero, u2, zero, zero, t2, zero]
                        }
                    }
                };
                let mut expected: Vec<Values> = shape.points.iter().map(field).collect();
                normalize(&mut expected);
                let error = difference(&shape, &expected, unit);
                worst = worst.max(error);
                assert!(error < 1e-7, "{poisson}, {scaled}, {mode:?}: {error:e}");
            }
        }
    }
    println!("closed forms: {worst:e}");
}

/// Largest errors of Hooke's law and of the equations of motion by differences of fourth order over
/// sublayers.
fn equation_error(bone: &Sublayers, shape: &ModeShape, k: c64, omega: f64, modulus: c64) -> f64 {
    let all: Vec<Values> = shape.points.iter().map(values).collect();
    let step = shape.points[1].depth;
    let ik = c64::new(0.0, 1.0) * k;
    let (mut worst, mut top) = (0.0_f64, 0.0);
    for Sublayer { thickness, solid } in bone.iter() {
        let c = |i, j, m, l| modulus * solid.elasticity.component(i, j, m, l);
        let is_inside = |place: &usize| {
            let depths = [place - 2, place + 2].map(|place| shape.points[place].depth);
            depths[0] >= top && depths[1] <= top + thickness
        };
        for place in (2..all.len() - 2).filter(is_inside) {
            let by_x3 = |i: usize| {
                let [a, b, c, d] =
                    [place + 2, place + 1, place - 1, place - 2].map(|place| all[place][i]);
                (a - b * 8.0 + c * 8.0 - d) / (12.0 * step)
            };
            let u = &all[place][..3];
            let gradient = |m: usize, l: usize| match l {
                0 => -ik * u[m],
                1 => c64::from(0.0),
                _ => by_x3(m),
            };
            let stress = |i: usize, j: usize| {
                let mut sum = c64::from(0.0);
                for (m, l) in (0..9).map(|pair| (pair / 3, pair % 3)) {
                    sum += c(i, j, m, l) * gradient(m, l);
                }
                sum
            };
            let unit = c(0, 0, 0, 0).norm() * k.norm();
            for i in 0..3 {
                let law = (stress(i, 2) - all[place][3 + i]).norm() / unit;
                let force =
                    -ik * stress(i, 0) + by_x3(3 + i) + u[i] * (solid.density * omega * omega);
                worst = worst.max(law).max(force.norm() / (unit * k.norm()));
            }
        }
        top += thickness;
    }
    worst
}

/// Sublayers of random solids, one alone, and the same from both faces.
fn bones() -> [Sublayers; 4] {
    [
        stack(&[(3e-3, draw(0.3, 1))]),
        stack(&[(0.8e-3, draw(0.2, 5)), (1.2e-3, optimum()), (1e-3, draw(0.4, 2))]),
        stack(&[(0.5e-3, draw(0.2, 3)), (2e-3, draw(0.3, 4)), (0.5e-3, draw(0.2, 3))]),
        stack(&[(0.7e-3, optimum()), (1.6e-3, isotropic(12e9, 0.3)), (0.7e-3, optimum())]),
    ]
}

#[test]
fn fields_obey_the_equations_of_motion_and_leave_the_faces_free() {
    let (mut worst, mut at_faces, mut count) = (0.0_f64, 0.0_f64, 0);
    for bone in bones() {
        let solver = solver(bone.thickness());
        for frequency in [0.05e6, 0.4e6, 1.2e6] {
            for (mode, shape) in shapes(&solver, &bone, frequency, 1001) {
                let (k, omega) = (c64::from(mode.wavenumber), TAU * frequency);
                let error = equation_error(&bone, &shape, k, omega, c64::from(1.0));
                // What remains is of the differences: (step · k)⁴, and rounding over step · k.
                assert!(error < 1e-7, "{frequency}, {mode:?}: {error:e}");
                let unit = bone.uppermost().solid.elasticity.rows()[0][0] * mode.wavenumber;
                for face in [&shape.points[0], &shape.points[1000]] {
                    let largest = face.traction.map(Complex::abs).into_iter().fold(0.0, f64::max);
                    assert!(largest < 1e-10 * unit, "{mode:?}: {largest:e}");
                    at_faces = at_faces.max(largest / unit);
                }
                (worst, count) = (worst.max(error), count + 1);
            }
        }
    }
    println!("{count} waves, equations: {worst:e}, faces: {at_faces:e}");
}

#[test]
fn displacements_are_those_of_finite_elements() {
    let mut worst = 0.0_f64;
    for bone in bones() {
        // Enough for the thickness of a sublayer; with more, rounding of the dense eigenvectors is larger.
        let degree = if bone.lower().is_empty() { 14 } else { 8 };
        let elements = FiniteElements::new(&bone, degree);
        let solver = solver(bone.thickness());
        for (mode, shape) in shapes(&solver, &bone, 0.5e6, 301) {
            let expected =
                elements.displacement(mode.wavenumber, mode.wavenumber * mode.phase_velocity);
            let (mut places, mut depth) = (vec![0.0], 0.0);
            for sublayer in bone.iter() {
                depth += sublayer.thickness;
                places.push(depth);
            }
            let at = |depth: f64| {
                let nearest = |point: &&ShapePoint| (point.depth - depth).abs() < 1e-9;
                values(shape.points.iter().find(nearest).unwrap())
            };
            // Their nodes are counted from below.
            let last = places.len() - 1;
            let node = |place: usize| &expected[3 * degree * (last - place)..][..3];
            let found: Vec<c64> =
                places.iter().flat_map(|place| at(*place)[..3].to_vec()).collect();
            let expected: Vec<c64> = (0..=last).flat_map(|place| node(place).to_vec()).collect();
            let largest = (0..found.len())
                .max_by(|a, b| found[*a].norm().total_cmp(&found[*b].norm()))
                .unwrap();
            let factor = found[largest] / expected[largest];
            for (found, expected) in found.iter().zip(&expected) {
                let error = (found - expected * factor).norm();
                assert!(error < 1e-7, "{mode:?}: {found:?}: {error:e}");
                worst = worst.max(error);
            }
        }
    }
    println!("finite elements: {worst:e}");
}

/// A0 and S0 of a plate that is its own mirror image are odd and even, also where they have one wavenumber.
#[test]
fn waves_of_a_symmetric_plate_are_even_or_odd_to_the_bit() {
    let bone = isotropic(16e9, 0.25);
    for (thickness, depths) in [(1e-3, 40), (12e-3, 41)] {
        let found = shapes(&solver(thickness), &bone, 2e6, depths);
        for (name, sign) in [("A0", -1.0), ("S0", 1.0)] {
            let (_, shape) =
                found.iter().find(|(mode, _)| mode.name.as_deref() == Some(name)).unwrap();
            assert_eq!(shape.points.len(), depths);
            for (one, other) in shape.points.iter().zip(shape.points.iter().rev()) {
                let signs = [sign, 1.0, -sign, -sign, 1.0, sign];
                for ((one, other), sign) in values(one).into_iter().zip(values(other)).zip(signs) {
                    assert_eq!(one, other * sign, "{name}, {thickness} m");
                }
            }
        }
    }
}

fn setup_of_fluids(thickness: f64, quality_factor: Option<f64>) -> Setup {
    let mut setup = Setup::default();
    setup.layers.bone_thickness = thickness;
    setup.layers.marrow.sound_speed = 1400.0;
    setup.layers.marrow.density = 900.0;
    setup.layers.bone_attenuation.quality_factor = quality_factor;
    setup
}

#[test]
fn fields_in_fluids_obey_the_equations_and_press_against_the_fluids() {
    let mut worst = 0.0_f64;
    for (quality_factor, frequency) in [(None, 0.4e6), (Some(20.0), 1e6)] {
        for bone in bones() {
            let setup = setup_of_fluids(bone.thickness(), quality_factor);
            let (solver, omega) = (Solver::new(&setup), TAU * frequency);
            let modulus = quality_factor.map_or(c64::from(1.0), |q: f64| {
                // (iω/ω0)^(2γ) at ω = ω0.
                let angle = (1.0 / q).atan();
                c64::new(angle.cos(), angle.sin())
            });
            for mode in solver.modes_in_fluids(&bone, frequency).unwrap().modes {
                let shape = solver.shape_in_fluids(&bone, &mode, 1001).unwrap();
                let k = c64::new(mode.wavenumber, -mode.attenuation);
                let error = equation_error(&bone, &shape, k, omega, modulus);
                assert!(error < 1e-7, "{frequency}, {mode:?}: {error:e}");
                let unit = 1e10 * mode.wavenumber;
                for (point, fluid, outwards) in [
                    (&shape.points[0], setup.layers.coupling, 1.0),
                    (&shape.points[1000], setup.layers.marrow, -1.0),
                ] {
                    let [_, _, u3, t1, t2, t3] = values(point);
                    let q = (c64::from((omega / fluid.sound_speed).powi(2)) - k * k).sqrt();
                    let radiates = mode.wavenumber < omega / fluid.sound_speed;
                    // Outwards: exp(i(ωt - qx3)); slower than sound, decaying.
                    let turned = if radiates { q.re < 0.0 } else { q.im > 0.0 };
                    let q = if turned { -q } else { q };
                    let pressure = c64::new(0.0, fluid.density * omega * omega) / q * u3 * outwards;
                    for wrong in [t1, t2, t3 + pressure] {
                        assert!(wrong.norm() < 1e-9 * unit, "{frequency}, {mode:?}: {wrong:?}");
                    }
                }
                worst = worst.max(error);
            }
        }
    }
    println!("in fluids: {worst:e}");
}

#[test]
fn processors_give_the_same_bits() {
    let (bone, setup) = (draw(0.3, 1), setup_of_fluids(2e-3, Some(20.0)));
    let shapes = |isa: Isa| {
        let solver = Solver::with_isa(&setup, isa);
        let free = solver.modes(&bone, 0.7e6).unwrap();
        let fluid = solver.modes_in_fluids(&bone, 0.7e6).unwrap().modes;
        let free: Vec<_> = free.iter().map(|mode| solver.shape(&bone, mode, 41).unwrap()).collect();
        let fluid = fluid.iter().map(|mode| solver.shape_in_fluids(&bone, mode, 41).unwrap());
        free.into_iter().chain(fluid).collect::<Vec<_>>()
    };
    let expected = shapes(Isa::fastest());
    for isa in Isa::available() {
        assert_eq!(shapes(isa), expected, "{}", isa.name());
    }
}

#[test]
fn waves_that_the_bone_does_not_have_are_refused() {
    let (bone, solver) = (optimum(), solver(2e-3));
    let modes = solver.modes(&bone, 0.7e6).unwrap();
    let mode = modes.first().unwrap();
    assert_eq!(solver.shape(&bone, mode, 1), Err(ShapeError::Depths { count: 1 }));
    let other = solver.shape(&draw(0.3, 1), mode, 41);
    assert_eq!(other, Err(ShapeError::Family { family: "antisymmetric" }));
    let wavenumber = 1.01 * mode.wavenumber;
    let beside = Mode { wavenumber, ..mode.clone() };
    assert_eq!(solver.shape(&bone, &beside, 41), Err(ShapeError::Undecided { wavenumber }));
    let mut setup = Setup::default();
    setup.layers.bone_thickness = 2e-3;
    let fluid = setup.layers.coupling_fluids().as_slice()[0];
    let faster = FluidSublayer { sound_speed: 1600.0, ..fluid };
    setup.layers.marrow.sublayers = FluidSublayers::new(&[fluid, faster]).unwrap();
    let refused = Solver::new(&setup).shape_in_fluids(&bone, mode, 41);
    let reason = ModesError::SeveralFluids { field: "layers.marrow.sublayers" };
    assert_eq!(refused, Err(ShapeError::Modes(reason)));
}

/// Both waves of single faces of a thick plate without symmetry are waves of one family, with one wavenumber.
#[test]
fn waves_that_cannot_be_told_apart_have_no_field() {
    let bone = draw(0.3, 1);
    let solver = solver(20e-3);
    let modes = solver.modes(&bone, 2e6).unwrap();
    let [first, second] = [0, 1].map(|place| &modes[place]);
    assert!((first.wavenumber / second.wavenumber - 1.0).abs() < 1e-12, "{first:?}, {second:?}");
    let found = solver.shape(&bone, first, 41);
    assert_eq!(found, Err(ShapeError::Undecided { wavenumber: first.wavenumber }));
}
