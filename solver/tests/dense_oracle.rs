//! The plate's admittance against dense linear algebra: eigenvectors of the first-order system,
//! as long as its exponentials stay within reach of double precision.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]
#![expect(clippy::disallowed_methods, reason = "an independent formula")]

use std::f64::consts::{PI, TAU};

use faer::prelude::Solve as _;
use faer::{Mat, c64};
use osteon_common::attenuation::Attenuation;
use osteon_common::bone::{Bone, BoneRef, Sublayer, Sublayers};
use osteon_common::case::Setup;
use osteon_common::fluid_sublayers::{FluidSublayer, FluidSublayers};
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_solver::{Complex, Solver, admittance, pressure};

/// A bone whose moduli are all multiplied by a complex factor.
struct Plate<'a> {
    bone: &'a Bone,
    factor: c64,
}

impl Plate<'_> {
    fn block(&self, j: usize, l: usize) -> Mat<c64> {
        let entry = |i, m| self.factor * self.bone.elasticity.component(i, j, m, l);
        Mat::from_fn(3, 3, entry)
    }
}

/// The system ∂3 (u, τ) = M (u, τ) at one (k, s), tractions in units of `unit`.
fn system(plate: &Plate<'_>, k: f64, s: c64, unit: f64) -> Mat<c64> {
    let ik = c64::new(0.0, k);
    let (a11, a13) = (plate.block(0, 0), plate.block(0, 2));
    let (a31, a33) = (plate.block(2, 0), plate.block(2, 2));
    let identity: Mat<c64> = Mat::identity(3, 3);
    let inverse = a33.partial_piv_lu().solve(&identity);
    let coupling = &inverse * &a31;
    let membrane = &a11 - &a13 * &coupling;
    let back = &a13 * &inverse;
    let inertia = s * s * plate.bone.density;
    Mat::from_fn(6, 6, |i, j| match (i < 3, j < 3) {
        (true, true) => -ik * coupling[(i, j)],
        (true, false) => inverse[(i, j - 3)] * unit,
        (false, true) => {
            let mass = if i - 3 == j { inertia } else { c64::new(0.0, 0.0) };
            (mass + membrane[(i - 3, j)] * (k * k)) / unit
        }
        (false, false) => -ik * back[(i - 3, j - 3)],
    })
}

/// (u, τ) at the top = this · (u, τ) at the bottom of a plate of thickness `h`.
fn transfer(plate: &Plate<'_>, h: f64, k: f64, s: c64, unit: f64) -> Mat<c64> {
    let eigen = system(plate, k, s, unit).eigen().unwrap();
    let vectors = eigen.U().to_owned();
    let stretched = Mat::from_fn(6, 6, |i, j| vectors[(i, j)] * (eigen.S()[j] * h).exp());
    let identity: Mat<c64> = Mat::identity(6, 6);
    stretched * vectors.partial_piv_lu().solve(&identity)
}

/// The same of plates on each other, given with their thicknesses, downwards.
fn transfer_of_all(plates: &[(f64, Plate<'_>)], k: f64, s: c64, unit: f64) -> Mat<c64> {
    plates
        .iter()
        .fold(Mat::identity(6, 6), |above, (h, plate)| above * transfer(plate, *h, k, s, unit))
}

/// û3(0)/p̂(0) of plates with the lowest face loaded by τ3 = `load` u3.
fn dense_admittance(plates: &[(f64, Plate<'_>)], k: f64, s: c64, load: c64) -> c64 {
    let thickness: f64 = plates.iter().map(|(h, _)| h).sum();
    let unit = plates[0].1.bone.elasticity.rows()[0][0] / thickness;
    let transfer = transfer_of_all(plates, k, s, unit);
    // At the bottom τ = (0, 0, load u3).
    let from_bottom = Mat::from_fn(6, 3, |i, j| {
        let loaded = if j == 2 { transfer[(i, 5)] * load / unit } else { c64::new(0.0, 0.0) };
        transfer[(i, j)] + loaded
    });
    // τ at the top is -p e3, with p = 1.
    let tractions = Mat::from_fn(3, 3, |i, j| from_bottom[(i + 3, j)] * unit);
    let pressure = Mat::from_fn(3, 1, |i, _| c64::new(if i == 2 { -1.0 } else { 0.0 }, 0.0));
    let bottom = tractions.partial_piv_lu().solve(&pressure);
    (0..3).map(|j| from_bottom[(2, j)] * bottom[(j, 0)]).sum()
}

/// m(s) = (s/ω0)^(2 atan(1/Q)/π): Kjartansson's law.
fn constant_quality(found: &Attenuation, s: c64) -> c64 {
    let Some(quality) = found.quality_factor else { return c64::new(1.0, 0.0) };
    (s / (TAU * found.reference_frequency)).powf(2.0 * (1.0 / quality).atan() / PI)
}

fn thin_plate_setup() -> Setup {
    let mut setup = Setup::default();
    setup.layers.bone_thickness = 0.6e-3;
    setup
}

#[test]
fn random_plates_agree_with_dense_eigenvectors() {
    check(&thin_plate_setup());
}

#[test]
fn attenuated_plates_agree_with_dense_eigenvectors() {
    let quality = |quality: f64, reference_frequency: f64| Attenuation {
        quality_factor: Some(quality),
        reference_frequency,
    };
    for (bone, marrow) in [(10.0, None), (5.0, Some(30.0)), (400.0, Some(2.0))] {
        let mut setup = thin_plate_setup();
        setup.layers.bone_attenuation = quality(bone, 0.7e6);
        if let Some(marrow) = marrow {
            setup.layers.marrow.attenuation = quality(marrow, 3e6);
        }
        check(&setup);
    }
}

/// Compares the admittance of a bone with that of the same plates by dense algebra.
fn check_admittance(setup: &Setup, plates: &[(f64, Bone)], bone: BoneRef<'_>, what: &str) {
    let marrow = setup.layers.marrow;
    for (k, omega) in [(300.0, 1e6), (-1500.0, 6e6), (4000.0, 9e6), (9000.0, 2e7)] {
        let s = c64::new(1.2e6, omega);
        let squared = marrow.sound_speed * marrow.sound_speed;
        let squared = constant_quality(&marrow.attenuation, s) * squared;
        let g = (s * s / squared + k * k).sqrt();
        let load = s * s * marrow.density * (g * marrow.thickness).tanh() / g;
        let factor = constant_quality(&setup.layers.bone_attenuation, s);
        let plates: Vec<_> = plates.iter().map(|(h, bone)| (*h, Plate { bone, factor })).collect();
        let expected = dense_admittance(&plates, k, s, load);
        let found = admittance(setup, bone, k, Complex::new(s.re, s.im));
        let error = (c64::new(found.re, found.im) - expected).norm() / expected.norm();
        // Exponentials up to e⁸ cost the dense side up to seven of its sixteen digits.
        assert!(error < 1e-9, "{setup:?}, {what}, k {k}: {error:e}");
    }
}

fn check(setup: &Setup) {
    let seed = 21;
    for dispersion in [0.1, 0.4, 0.7] {
        let point =
            Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion]);
        let ensemble = Ensemble::new(&point, seed).unwrap();
        for index in 0..10 {
            let bone = ensemble.bone(index).unwrap();
            let plate = [(setup.layers.bone_thickness, bone)];
            let what = format!("seed {seed}, dispersion {dispersion}, index {index}");
            check_admittance(setup, &plate, (&bone).into(), &what);
            // Two to six sublayers of other draws, the thickest up to nine times as thick as the thinnest.
            let count = 2 + index % 5;
            let solids: Vec<Bone> = (0..count)
                .map(|i| {
                    let drawn = ensemble.bone(10 + 6 * index + i).unwrap();
                    Bone { density: drawn.density * (0.8 + 0.1 * i as f64), ..drawn }
                })
                .collect();
            let shares: Vec<f64> = (0..count).map(|i| (1 + (7 * i + index) % 9) as f64).collect();
            let whole = setup.layers.bone_thickness / shares.iter().sum::<f64>();
            let thicknesses = shares.iter().map(|share| share * whole);
            let stack: Vec<(f64, Bone)> = thicknesses.zip(solids).collect();
            let sublayers: Vec<Sublayer> =
                stack.iter().map(|&(thickness, solid)| Sublayer { thickness, solid }).collect();
            let sublayers = Sublayers::new(&sublayers).unwrap();
            check_admittance(
                setup,
                &stack,
                (&sublayers).into(),
                &format!("{what}, {count} sublayers"),
            );
        }
    }
}

/// At a wave of plates with free faces some displacements of the bottom cause no traction on top.
#[test]
fn guided_waves_of_sublayers_leave_both_faces_free() {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.2]);
    let ensemble = Ensemble::new(&point, 23).unwrap();
    for (thickness, count) in [(0.6e-3, 2_u32), (0.6e-3, 5), (2e-3, 3)] {
        let share = thickness / f64::from(count);
        let solids: Vec<Bone> = (0..count).map(|i| ensemble.bone(i.into()).unwrap()).collect();
        let sublayers: Vec<_> =
            solids.iter().map(|&solid| Sublayer { thickness: share, solid }).collect();
        let found =
            Solver::new(&Setup::default()).guided_waves(&Sublayers::new(&sublayers).unwrap());
        let plates = || -> Vec<_> {
            let factor = c64::new(1.0, 0.0);
            solids.iter().map(|bone| (share, Plate { bone, factor })).collect()
        };
        let omega = TAU * found.frequency;
        let unit = solids[0].elasticity.rows()[0][0] / thickness;
        let tractions = |k: f64, omega: f64| {
            let transfer = transfer_of_all(&plates(), k, c64::new(0.0, omega), unit);
            let block = Mat::from_fn(3, 3, |i, j| transfer[(i + 3, j)]);
            let values = block.singular_values().unwrap();
            values[2] / values[0]
        };
        for wave in [found.a0.unwrap(), found.s0.unwrap()] {
            let k = omega / wave.phase_velocity;
            let (there, beside) = (tractions(k, omega), tractions(1.001 * k, omega));
            assert!(
                there < 1e-6 * beside,
                "{count} of {thickness} m, {wave:?}: {there:e}, {beside:e}"
            );
            // Along the curve of the wave there is none either.
            let step = 1e-3;
            let along = tractions(
                (1.0 + step) * k,
                omega * (1.0 + step * wave.group_velocity / wave.phase_velocity),
            );
            assert!(
                along < 1e-2 * beside,
                "{count} of {thickness} m, {wave:?}: {along:e}, {beside:e}"
            );
        }
    }
}

fn fluids(all: &[(f64, f64, f64)]) -> FluidSublayers {
    let one =
        |&(thickness, density, sound_speed)| FluidSublayer { thickness, density, sound_speed };
    FluidSublayers::new(&all.iter().map(one).collect::<Vec<_>>()).unwrap()
}

/// A fluid: thickness, density, speed of sound.
type Fluid = (f64, f64, f64);

/// Both waves of a fluid, a exp(-g ζ) and b exp(-g (d - ζ)) with the distance ζ from one face: their pressures
/// on both faces, and the slopes of these over the density.
struct Waves {
    near: [c64; 2],
    far: [c64; 2],
    slope_near: [c64; 2],
    slope_far: [c64; 2],
}

impl Waves {
    fn new((d, density, c): Fluid, loss: c64, k: f64, s: c64) -> Self {
        let g = (s * s / (loss * (c * c)) + k * k).sqrt();
        let (one, decay, y) = (c64::new(1.0, 0.0), (-g * d).exp(), g / density);
        let (near, far) = ([one, decay], [decay, one]);
        Self { near, far, slope_near: [-y, y * decay], slope_far: [-y * decay, y] }
    }
}

/// Solves the linear system of all fluids at once, listed from the bone outwards: on its face the slope over
/// the density and `face` times the pressure are `given`, at the nearer face of the fluids in `driven` the former
/// falls by 1, and on the outer face p = 0. Returns the pressures on the nearer faces.
fn dense_fluids(fluids: &[Waves], face: c64, given: c64, driven: &[usize]) -> Vec<c64> {
    let n = 2 * fluids.len();
    let (mut matrix, mut right) = (Mat::<c64>::zeros(n, n), Mat::<c64>::zeros(n, 1));
    right[(0, 0)] = given;
    for (j, waves) in fluids.iter().enumerate() {
        let is_last = j + 1 == fluids.len();
        for i in 0..2 {
            let column = 2 * j + i;
            if j == 0 {
                matrix[(0, column)] = waves.slope_near[i] + face * waves.near[i];
            } else {
                matrix[(2 * j - 1, column)] = waves.near[i];
                matrix[(2 * j, column)] = waves.slope_near[i];
            }
            matrix[(2 * j + 1, column)] = if is_last { waves.far[i] } else { -waves.far[i] };
            if !is_last {
                matrix[(2 * j + 2, column)] = -waves.slope_far[i];
            }
        }
        if driven.contains(&j) {
            right[(2 * j, 0)] = c64::new(-1.0, 0.0);
        }
    }
    let solved = matrix.partial_piv_lu().solve(&right);
    let near = |(j, waves): (usize, &Waves)| {
        solved[(2 * j, 0)] * waves.near[0] + solved[(2 * j + 1, 0)] * waves.near[1]
    };
    fluids.iter().enumerate().map(near).collect()
}

/// p̂ at the receivers per unit of F; fluids are listed from the bone outwards.
fn dense_pressure(
    [above, below]: [&[Fluid]; 2],
    [above_loss, below_loss]: [c64; 2],
    plates: &[(f64, Plate<'_>)],
    (source, receiver): (f64, f64),
    (k, s): (f64, c64),
) -> c64 {
    // The pressure under the bone per displacement downwards: there the slope over the density is -s² of it.
    let marrow: Vec<_> = below.iter().map(|&fluid| Waves::new(fluid, below_loss, k, s)).collect();
    let pressure = dense_fluids(&marrow, c64::new(0.0, 0.0), -s * s, &[])[0];
    // Moved up, the bone pulls: τ3 = -p = Z u3.
    let admittance = dense_admittance(plates, k, s, pressure);
    // The fluids above, cut at the source and at the receivers.
    let (mut pieces, mut starts, mut start) = (Vec::new(), Vec::new(), 0.0);
    for &(d, density, c) in above {
        let mut cuts = vec![start, start + d];
        cuts.extend([source, receiver].into_iter().filter(|z| *z > start && *z < start + d));
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        for pair in cuts.windows(2) {
            pieces.push(Waves::new((pair[1] - pair[0], density, c), above_loss, k, s));
            starts.push(pair[0]);
        }
        start += d;
    }
    let at = |height: f64| starts.iter().position(|start| *start == height).unwrap();
    let zero = c64::new(0.0, 0.0);
    dense_fluids(&pieces, s * s * admittance, zero, &[at(source)])[at(receiver)]
}

/// Stacks of one to four fluids on both sides, of densities and speeds much unlike each other; source and
/// receivers in the same fluid, in different ones, and on joints.
#[test]
fn pressures_in_stacks_of_fluids_are_those_of_dense_algebra() {
    let above = [
        (1.2e-3, 1090.0, 1580.0),
        (0.8e-3, 920.0, 1440.0),
        (1.5e-3, 1150.0, 1730.0),
        (2e-3, 990.0, 1510.0),
    ];
    let below = [
        (2e-3, 1010.0, 1450.0),
        (0.5e-3, 700.0, 1200.0),
        (1e-3, 1300.0, 1900.0),
        (2e-3, 960.0, 1480.0),
    ];
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.3]);
    let ensemble = Ensemble::new(&point, 29).unwrap();
    let places = [(0.4e-3, 0.9e-3), (1.2e-3, 1.2e-3), (0.7e-3, 0.7e-3), (1.0e-3, 0.3e-3)];
    for (case, quality) in [None, Some(30.0)].into_iter().enumerate() {
        for count in 1..=4 {
            let (above, below) = (&above[..count], &below[..5 - count]);
            let top: f64 = above.iter().map(|fluid| fluid.0).sum();
            let spread = top / 1.3e-3;
            for (i, (source, receiver)) in places.into_iter().enumerate() {
                // The second pair is on a joint, where there is one.
                let scale = if i == 1 { 1.0 } else { spread };
                let (source, receiver) = (scale * source, scale * receiver);
                let mut setup = Setup::default();
                let layers = &mut setup.layers;
                layers.coupling.sublayers = fluids(above).reversed();
                layers.marrow.sublayers = fluids(below);
                layers.bone_thickness = 1e-3;
                layers.coupling.attenuation.quality_factor = quality;
                layers.marrow.attenuation.quality_factor = quality.map(|q| 2.0 * q);
                layers.bone_attenuation.quality_factor = quality;
                (setup.probe.source.x3, setup.probe.receivers.x3) = (source, receiver);
                if i == 1 && count == 1 {
                    continue;
                }
                let bone = ensemble.bone((4 * count + i) as u64).unwrap();
                for (k, omega) in [(300.0, 1e6), (2500.0, 6e6), (4200.0, 6.2e6), (7000.0, 2e7)] {
                    let s = c64::new(1.2e6, omega);
                    let loss = |of: &Attenuation| constant_quality(of, s);
                    let losses = [&setup.layers.coupling, &setup.layers.marrow]
                        .map(|f| loss(&f.attenuation));
                    let factor = loss(&setup.layers.bone_attenuation);
                    let plates = [(1e-3, Plate { bone: &bone, factor })];
                    let expected =
                        dense_pressure([above, below], losses, &plates, (source, receiver), (k, s));
                    let found = pressure(&setup, &bone, k, Complex::new(s.re, s.im));
                    let error = (c64::new(found.re, found.im) - expected).norm() / expected.norm();
                    // Waves from the faces that cancel, and the dense side's exponentials, cost digits.
                    assert!(
                        error < 1e-9,
                        "case {case}, {count} above, places {i}, k {k}: {error:e}"
                    );
                }
            }
        }
    }
}
