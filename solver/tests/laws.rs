//! Laws of physics that hold for every admissible input.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]
#![expect(clippy::needless_range_loop, reason = "matrix indices read as in the formulas")]

use osteon_common::case::{Bone, Setup};
use osteon_common::elasticity::Elasticity;
use osteon_common::layers::Fluid;
use osteon_common::parameters::Point;
use osteon_common::probe::Source;
use osteon_common::realization::Ensemble;
use osteon_solver::{Arrival, Complex, Solver, Workspace, admittance};

/// The paper's optimum with another dispersion.
fn draws(dispersion: f64, seed: u64) -> Ensemble {
    let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion]);
    Ensemble::new(&point, seed).unwrap()
}

fn isotropic(density: f64, longitudinal_speed: f64, shear_speed: f64) -> Bone {
    let modulus = density * longitudinal_speed * longitudinal_speed;
    let shear = density * shear_speed * shear_speed;
    let mut rows = [[0.0; 6]; 6];
    for i in 0..3 {
        rows[i][..3].fill(modulus - 2.0 * shear);
        rows[i][i] = modulus;
        rows[i + 3][i + 3] = 2.0 * shear;
    }
    Bone { density, elasticity: Elasticity::new(rows).unwrap() }
}

/// The bone's part that is symmetric in depth: the mean of it and its mirror image.
fn symmetric_in_depth(bone: &Bone) -> Bone {
    let mut rows = *bone.elasticity.rows();
    // Odd numbers of indices 3 are in 23 and 31.
    for i in [0, 1, 2, 5] {
        for j in [3, 4] {
            rows[i][j] = 0.0;
            rows[j][i] = 0.0;
        }
    }
    Bone { elasticity: Elasticity::new(rows).unwrap(), ..*bone }
}

fn arrival(setup: &Setup, bone: &Bone) -> Arrival {
    Solver::new(setup).arrival(bone, &mut Workspace::default()).unwrap()
}

/// Largest difference of two arrivals' times, s.
fn largest_delay(a: &Arrival, b: &Arrival) -> f64 {
    a.times.iter().zip(&b.times).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// cosh and sinh.
fn hyperbolic(z: Complex) -> (Complex, Complex) {
    let (up, down) = (z.exp(), (-z).exp());
    ((up + down).scale(0.5), (up - down).scale(0.5))
}

/// Admittance of a free isotropic plate, from the potentials of Rayleigh and Lamb: half the load
/// deforms the plate symmetrically, half antisymmetrically (e.g. K. F. Graff, Wave Motion in
/// Elastic Solids, ch. 8).
fn rayleigh_lamb(bone: &Bone, speeds: (f64, f64), h: f64, k: f64, s: Complex) -> Complex {
    let (cl, ct) = speeds;
    let k2 = Complex::new(k * k, 0.0);
    let ql = (k2 + (s * s).scale(1.0 / (cl * cl))).sqrt();
    let qt = (k2 + (s * s).scale(1.0 / (ct * ct))).sqrt();
    let (cosh_l, sinh_l) = hyperbolic(ql.scale(0.5 * h));
    let (cosh_t, sinh_t) = hyperbolic(qt.scale(0.5 * h));
    let m = k2 + qt * qt;
    let shear = bone.density * ct * ct;
    let half = |odd_l: Complex, even_l: Complex, odd_t: Complex, even_t: Complex| {
        let numerator = (s * s).scale(-0.5 / (ct * ct)) * ql * odd_l * odd_t;
        let lamb = m * m * even_l * odd_t - (k2 * ql * qt).scale(4.0) * odd_l * even_t;
        numerator / lamb.scale(shear)
    };
    half(sinh_l, cosh_l, sinh_t, cosh_t) + half(cosh_l, sinh_l, cosh_t, sinh_t)
}

#[test]
fn a_free_isotropic_plate_has_the_admittance_of_rayleigh_and_lamb() {
    let speeds = (3300.0, 1700.0);
    let bone = isotropic(1800.0, speeds.0, speeds.1);
    let mut setup = Setup::default();
    // As good as vacuum: its load is fifteen orders below the plate's stiffness.
    setup.layers.marrow.density = 1e-12;
    for h in [0.5e-3, 4e-3] {
        setup.layers.bone_thickness = h;
        for k in [1e-3, 300.0, 2000.0, 9000.0] {
            for omega in [1e5, 3e6, 9e6, 2e7] {
                let s = Complex::new(1.2e6, omega);
                let expected = rayleigh_lamb(&bone, speeds, h, k, s);
                let found = admittance(&setup, &bone, k, s);
                let error = (found - expected).abs() / expected.abs();
                // The closed form itself cancels at small k h; the doubling does not.
                assert!(error < 1e-9, "h {h}, k {k}, omega {omega}: {error:e}");
            }
        }
    }
}

#[test]
fn a_matched_plate_reflects_nothing() {
    // ρ c as the fluids', a marrow without echo: at normal incidence the wave passes.
    let bone = isotropic(2000.0, 750.0, 400.0);
    let mut setup = Setup::default();
    setup.layers.marrow.thickness = 1.0;
    let s = Complex::new(1e6, 7e6);
    let found = admittance(&setup, &bone, 0.0, s);
    let expected = -(Complex::new(1.0, 0.0) / s.scale(1000.0 * 1500.0));
    assert!((found - expected).abs() < 1e-12 * expected.abs(), "{found:?} {expected:?}");
}

#[test]
fn a_solid_with_next_to_no_shear_stiffness_is_a_fluid() {
    let bone = isotropic(1000.0, 1500.0, 0.15);
    let mut setup = Setup::default();
    setup.layers.marrow.thickness = 1.0;
    let s = Complex::new(1e6, 7e6);
    for k in [0.0, 500.0, 3000.0] {
        // Y = -g/(ρ s²) of a fluid half space.
        let g = (Complex::new(k * k, 0.0) + (s * s).scale(1.0 / (1500.0 * 1500.0))).sqrt();
        let expected = -(g / (s * s).scale(1000.0));
        let error = (admittance(&setup, &bone, k, s) - expected).abs() / expected.abs();
        // The shear boundary layer has a relative thickness of c_T/c = 1e-4.
        assert!(error < 1e-3, "k {k}: {error:e}");
    }
}

#[test]
fn random_plates_are_passive_and_reciprocal() {
    let setup = Setup::default();
    for dispersion in [0.1, 0.5, 0.79] {
        let ensemble = draws(dispersion, 11);
        for index in 0..60 {
            let bone = ensemble.bone(index).unwrap();
            for (k, omega) in [(5.0, 1e4), (900.0, 2e6), (4000.0, 1.2e7), (12_000.0, 3e7)] {
                let s = Complex::new(1.2e6, omega);
                let y = admittance(&setup, &bone, k, s);
                // Pressure pushes down: the power -Re(s Y) goes into the plate.
                assert!((s * y).re < 0.0, "dispersion {dispersion}, index {index}, k {k}: {y:?}");
                let mirrored = admittance(&setup, &bone, -k, s);
                assert!(
                    (mirrored - y).abs() < 1e-9 * y.abs(),
                    "dispersion {dispersion}, index {index}, k {k}: {y:?} {mirrored:?}"
                );
            }
        }
    }
}

#[test]
fn thickness_of_marrow_may_be_called_plate() {
    // Two layers of one fluid are one; the plate is the fluid with next to no shear stiffness.
    let bone = isotropic(1300.0, 1700.0, 0.15);
    let setup = |plate: f64, marrow: f64| {
        let mut setup = Setup::default();
        setup.layers.bone_thickness = plate;
        setup.layers.marrow = Fluid {
            thickness: marrow,
            density: 1300.0,
            sound_speed: 1700.0,
            ..setup.layers.marrow
        };
        setup
    };
    for k in [0.0, 900.0, 4000.0] {
        for omega in [1e6, 7e6] {
            let s = Complex::new(1e6, omega);
            let expected = admittance(&setup(2e-3, 3e-3), &bone, k, s);
            for moved in [-1.2e-3, 0.7e-3, 2.9e-3] {
                let found = admittance(&setup(2e-3 + moved, 3e-3 - moved), &bone, k, s);
                let error = (found - expected).abs() / expected.abs();
                // The shear boundary layer has a relative thickness of c_T/c = 1e-4.
                assert!(error < 1e-3, "k {k}, omega {omega}, {moved} m: {error:e}");
            }
        }
    }
}

#[test]
fn two_half_layers_are_one() {
    // What a solid that is symmetric about the plane x3 = const does under equal pressures on both
    // faces is what its upper half does on a smooth rigid base: u3 and the tractions σ13, σ23 vanish
    // in the middle. With a the admittance of a free plate and b that from face to face, it is
    // a + b; on the base itself, a - b²/a.
    let admittance = |bone: &Bone, thickness: f64, marrow_density: f64, k: f64, s: Complex| {
        let mut setup = Setup::default();
        setup.layers.bone_thickness = thickness;
        setup.layers.marrow.density = marrow_density;
        admittance(&setup, bone, k, s)
    };
    let (free, rigid) = (1e-12, 1e24);
    for index in 0..20 {
        let bone = symmetric_in_depth(&draws(0.5, 14).bone(index).unwrap());
        for (k, omega) in [(200.0, 3e5), (1500.0, 5e6), (-3000.0, 9e6)] {
            let s = Complex::new(1.2e6, omega);
            let h = 1.3e-3;
            let a = admittance(&bone, 2.0 * h, free, k, s);
            let half = admittance(&bone, h, rigid, k, s);
            let whole = admittance(&bone, 2.0 * h, rigid, k, s);
            let error = ((half - a) * (half - a) - a * (a - whole)).abs() / (a * a).abs();
            assert!(error < 1e-10, "index {index}, k {k}: {error:e}");
        }
    }
}

#[test]
fn a_closed_system_without_damping_takes_no_power() {
    let setup = Setup::default();
    for index in 0..20 {
        let bone = draws(0.5, 15).bone(index).unwrap();
        for (k, omega) in [(100.0, 1e6), (2500.0, 5e6), (9000.0, 1.1e7)] {
            // So little damping that what it takes can only be seen close to a resonance.
            let s = Complex::new(1e-9 * omega, omega);
            let y = admittance(&setup, &bone, k, s);
            assert!(y.im.abs() < 1e-5 * y.abs(), "index {index}, k {k}, omega {omega}: {y:?}");
        }
    }
}

#[test]
fn power_into_the_plate_is_radiated_into_the_marrow() {
    for index in 0..20 {
        let bone = draws(0.5, 16).bone(index).unwrap();
        for (k, omega) in [(100.0, 2e6), (1500.0, 5e6), (4000.0, 1.1e7)] {
            let s = Complex::new(1e-9 * omega, omega);
            // No echo comes back from a face that far away.
            let admittance_on = |density: f64| {
                let mut setup = Setup::default();
                setup.layers.marrow.thickness = 1e15;
                setup.layers.marrow.density = density;
                admittance(&setup, &bone, k, s)
            };
            // The marrow's load Z = ρ s²/g is imaginary and proportional to its density, and
            // |∂Y/∂Z| is |u3(-h)/p(0)|² by reciprocity: so this is |Im Z| |u3(-h)|².
            let step = 1e-4;
            let change =
                admittance_on(1000.0 * (1.0 + step)) - admittance_on(1000.0 * (1.0 - step));
            let radiated = change.abs() / (2.0 * step);
            let taken = admittance_on(1000.0).im.abs();
            let error = (taken - radiated).abs() / radiated;
            // The central difference is right to the square of its step over the resonance's width.
            assert!(error < 1e-5, "index {index}, k {k}, omega {omega}: {error:e}");
        }
    }
}

#[test]
fn source_and_receivers_may_be_exchanged() {
    for index in 0..5 {
        let bone = draws(0.3, 3).bone(index).unwrap();
        let mut setup = Setup::default();
        // Near enough for the echoes of both outer faces.
        setup.layers.coupling.thickness = 4e-3;
        setup.layers.marrow.thickness = 3e-3;
        setup.probe.source.x3 = 1e-3;
        setup.probe.receivers.x3 = 3e-3;
        let traces = |setup: &Setup| Solver::new(setup).traces(&bone, 12e-6, 50e-9).unwrap();
        let (there, there_traces) = (arrival(&setup, &bone), traces(&setup));
        setup.probe.source.x3 = 3e-3;
        setup.probe.receivers.x3 = 1e-3;
        let (back, back_traces) = (arrival(&setup, &bone), traces(&setup));
        // Rounding of the echoes, amplified by the picking.
        assert!(largest_delay(&there, &back) < 1e-16, "index {index}: {there:?} {back:?}");
        for (there, back) in there_traces.pressures.iter().zip(&back_traces.pressures) {
            let largest = there.iter().fold(0.0, |max: f64, p| max.max(p.abs()));
            let difference = there.iter().zip(back).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(difference < 1e-12 * largest, "index {index}: {difference} of {largest}");
        }
    }
}

#[test]
fn position_along_the_bone_does_not_matter() {
    let bone = draws(0.1029, 3).bone(6).unwrap();
    let here = arrival(&Setup::default(), &bone);
    let mut setup = Setup::default();
    setup.probe.source = Source { x1: 1.0, x3: 2e-3 };
    setup.probe.receivers.first_x1 = 1.0 + 11e-3;
    // 1.0 + x - 1.0 loses sixteen digits less three.
    assert!(largest_delay(&here, &arrival(&setup, &bone)) < 1e-16 * 1e3);
}

#[test]
fn the_mirrored_bone_sends_the_same_wave() {
    for index in 0..5 {
        let bone = draws(0.3, 4).bone(index).unwrap();
        // x1 → -x1 changes the sign of what has an odd number of indices 1.
        let mut rows = *bone.elasticity.rows();
        for i in 0..4 {
            for j in 4..6 {
                rows[i][j] = -rows[i][j];
                rows[j][i] = -rows[j][i];
            }
        }
        let mirrored = Bone { elasticity: Elasticity::new(rows).unwrap(), ..bone };
        // Above refinement 1 the series of a slice is summed to rounding.
        let mut setup = Setup::default();
        setup.solver.refinement = 1.5;
        let difference = largest_delay(&arrival(&setup, &bone), &arrival(&setup, &mirrored));
        // Rounding of Y, amplified by the picking.
        assert!(difference < 1e-13, "index {index}: {difference:e}");
    }
}

#[test]
fn a_wave_cannot_outrun_the_bone() {
    // Echoes of nearby outer faces included: all that is computed is causal.
    let mut setup = Setup::default();
    setup.layers.coupling.thickness = 4e-3;
    setup.layers.marrow.thickness = 3e-3;
    let ensemble = draws(0.1029, 9);
    for index in 0..5 {
        let bone = ensemble.bone(index).unwrap();
        let solver = Solver::new(&setup);
        let traces = solver.traces(&bone, 12e-6, 50e-9).unwrap();
        let near = &traces.pressures[0];
        let largest = near.iter().fold(0.0, |max: f64, p| max.max(p.abs()));
        // 11 mm at 4.5 km/s and 4 mm of fluid: nothing before 4.7 µs.
        for (t, p) in traces.times.iter().zip(near).take_while(|(t, _)| **t < 4.6e-6) {
            assert!(p.abs() < 1e-4 * largest, "index {index}: {p} Pa at {t} s");
        }
    }
}

#[test]
fn nearby_outer_faces_are_computed_as_long_as_they_can_be_heard() {
    // With a thin coupling the head wave by way of its outer face comes before the direct wave;
    // the trace, which always has all echoes, must show the picked extremum at the picked time.
    let bone = draws(0.1029, 9).bone(0).unwrap();
    let mut setup = Setup::default();
    setup.layers.coupling.thickness = 3e-3;
    setup.layers.marrow.thickness = 2e-3;
    let solver = Solver::new(&setup);
    let picked = solver.arrival(&bone, &mut Workspace::default()).unwrap();
    let step = 2e-9;
    let traces = solver.traces(&bone, 10e-6, step).unwrap();
    for (trace, &time) in traces.pressures.iter().zip(&picked.times) {
        let nearest = (time / step) as usize;
        let range = nearest - 20..nearest + 20;
        let peak = range.max_by(|&a, &b| trace[a].abs().total_cmp(&trace[b].abs())).unwrap();
        let found = traces.times[peak];
        assert!((found - time).abs() < 3e-9, "{found} against {time}");
    }
}
