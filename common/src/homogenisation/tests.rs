//! Against closed forms of the literature, and against Hill's tensor by integration.

use rand_chacha::ChaCha20Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::*;

const WATER: f64 = 2.3e9;

/// Stiffness of bone without pores, about that of the paper's optimum.
const BONE: HillModuli = HillModuli {
    plane_bulk: 16.2e9,
    cross: 12.2e9,
    axial: 28.8e9,
    transverse_shear: 4.3e9,
    axial_shear: 5.9e9,
};

fn close(a: f64, b: f64, relative: f64) {
    assert!((a - b).abs() <= relative * b.abs(), "{a} against {b}");
}

fn all_close(a: HillModuli, b: HillModuli, relative: f64) {
    for (a, b) in numbers(a).into_iter().zip(numbers(b)) {
        close(a, b, relative);
    }
}

fn numbers(moduli: HillModuli) -> [f64; 5] {
    let HillModuli { plane_bulk, cross, axial, transverse_shear, axial_shear } = moduli;
    [plane_bulk, cross, axial, transverse_shear, axial_shear]
}

/// Returns solids of very different anisotropy, all positive definite.
fn solids() -> Vec<HillModuli> {
    let mut generator = ChaCha20Rng::seed_from_u64(7);
    let mut between = |from: f64, to: f64| {
        from + (to - from) * f64::from(generator.next_u32()) / f64::from(u32::MAX)
    };
    let mut solid = |_| {
        let plane_bulk = between(1e9, 60e9);
        let cross = 2.0 * plane_bulk * between(-0.4, 0.6);
        let axial = cross * cross / plane_bulk + between(1e9, 60e9);
        let (transverse_shear, axial_shear) = (between(0.5e9, 40e9), between(0.5e9, 40e9));
        HillModuli { plane_bulk, cross, axial, transverse_shear, axial_shear }
    };
    (0..200).map(&mut solid).collect()
}

const FRACTIONS: [f64; 6] = [1e-3, 0.05, 0.1, 0.2, 0.3, 0.45];
const FLUIDS: [f64; 4] = [0.0, 0.1e9, WATER, 40e9];

/// E_L and ν_L of R. Hill, J. Mech. Phys. Solids 12 (1964) 199: relations that every composite of two
/// solids aligned along axis 1 fulfils, whatever the arrangement; and the plane bulk and axial shear moduli
/// of the composite cylinders of Z. Hashin and B. W. Rosen, J. Appl. Mech. 31 (1964) 223.
#[test]
fn mori_tanaka_is_that_of_composite_cylinders() {
    for solid in solids() {
        for (fluid, f) in FLUIDS.iter().flat_map(|&k| FRACTIONS.map(|f| (k, f))) {
            let found = solid.mori_tanaka(fluid, f);
            let (k, m, p) = (solid.plane_bulk, solid.transverse_shear, solid.axial_shear);
            let bulk = k + f / (1.0 / (fluid - k) + (1.0 - f) / (k + m));
            close(found.plane_bulk, bulk, 1e-12);
            close(found.axial_shear, p * (1.0 - f) / (1.0 + f), 1e-12);
            if fluid == 0.0 {
                // Nothing stretches with the solid: E_L is in proportion to it, ν_L that of the solid.
                close(young(found), (1.0 - f) * young(solid), 1e-12);
                close(poisson(found), poisson(solid), 1e-12);
                continue;
            }
            let slope = (poisson(solid) - 0.5) / (1.0 / k - 1.0 / fluid);
            let curved = (1.0 - f) / k + f / fluid - 1.0 / bulk;
            let e = (1.0 - f) * young(solid) + 4.0 * slope * slope * curved;
            let nu = (1.0 - f) * poisson(solid) + f * 0.5 - slope * curved;
            // What cancels in the slope is of the size of the moduli.
            close(young(found), e, 1e-10);
            assert!((poisson(found) - nu).abs() < 1e-10, "{found:?}");
        }
    }
}

fn young(solid: HillModuli) -> f64 {
    solid.axial - solid.cross * solid.cross / solid.plane_bulk
}

fn poisson(solid: HillModuli) -> f64 {
    0.5 * solid.cross / solid.plane_bulk
}

/// The Young modulus of a plane with round holes does not depend on its Poisson ratio. It is E (1 - f)/(1 + 2 f)
/// by the upper bound of Z. Hashin and S. Shtrikman, and E (1 - 3 f) by the self-consistent estimate.
#[test]
fn across_empty_pores_it_is_the_plane_with_holes() {
    let plane = |solid: HillModuli| 4.0 / (1.0 / solid.plane_bulk + 1.0 / solid.transverse_shear);
    for solid in solids() {
        for f in [1e-3, 0.1, 0.2, 0.3] {
            let found = plane(solid.mori_tanaka(0.0, f));
            close(found, plane(solid) * (1.0 - f) / (1.0 + 2.0 * f), 1e-12);
            let found = plane(solid.self_consistent(0.0, f).unwrap());
            close(found, plane(solid) * (1.0 - 3.0 * f), 1e-11);
        }
    }
}

/// The same estimates by 6×6 matrices, with Hill's tensor of the cylinder by integration over the circle:
/// nothing of the closed forms is used.
#[test]
fn both_estimates_solve_their_equations_of_tensors() {
    for solid in solids().into_iter().step_by(10) {
        for (fluid, f) in FLUIDS.iter().flat_map(|&k| FRACTIONS.map(|f| (k, f))) {
            let matrix = solid.elasticity().unwrap();
            let change = minus(rows(HillModuli::of_fluid(fluid)), *matrix.rows());
            let found = *solid.mori_tanaka(fluid, f).elasticity().unwrap().rows();
            let concentration = |medium: &Elasticity| {
                let from_medium = minus(rows(HillModuli::of_fluid(fluid)), *medium.rows());
                inverse(plus(UNIT, times(hill_tensor(medium), from_medium)))
            };
            let dilute = concentration(&matrix);
            let all = inverse(plus(scaled(1.0 - f, UNIT), scaled(f, dilute)));
            let in_pores = times(dilute, all);
            let expected = plus(*matrix.rows(), scaled(f, times(change, in_pores)));
            matrices_close(found, expected);
            let Some(found) = solid.self_consistent(fluid, f) else { continue };
            let found = found.elasticity().unwrap();
            let in_pores = concentration(&found);
            let expected = plus(*matrix.rows(), scaled(f, times(change, in_pores)));
            matrices_close(*found.rows(), expected);
        }
    }
}

#[test]
fn without_pores_it_is_the_solid_and_without_solid_the_fluid() {
    for solid in solids() {
        assert_eq!(solid.mori_tanaka(WATER, 0.0), solid);
        all_close(solid.self_consistent(WATER, 0.0).unwrap(), solid, 1e-14);
        let fluid = numbers(solid.mori_tanaka(WATER, 1.0));
        for (found, expected) in fluid.into_iter().zip(numbers(HillModuli::of_fluid(WATER))) {
            assert!((found - expected).abs() < 1e-13 * 100e9, "{found} against {expected}");
        }
    }
}

/// The first pores change the stiffness as a single one in an infinite solid does, by either estimate.
#[test]
fn few_pores_change_it_as_single_ones() {
    const F: f64 = 1e-7;
    for solid in solids() {
        let HillModuli { plane_bulk: k, cross: l, axial: n, transverse_shear: m, axial_shear: p } =
            solid;
        let area = (k + m) / (WATER + m);
        let single = [
            (WATER - k) * area,
            (WATER - l) * area,
            WATER - n - (WATER - l) * (WATER - l) / (WATER + m),
            -2.0 * m * (k + m) / k,
            -2.0 * p,
        ];
        for estimate in [solid.mori_tanaka(WATER, F), solid.self_consistent(WATER, F).unwrap()] {
            let found = numbers(estimate).into_iter().zip(numbers(solid));
            for ((with, without), expected) in found.zip(single) {
                // The terms in f² are up to 80 times as large where the fluid is much stiffer than the solid.
                let slope = (with - without) / F;
                assert!((slope - expected).abs() < 1e-4 * expected.abs().max(n + k), "{slope}");
            }
        }
    }
}

#[test]
fn every_solid_with_pores_is_softer_and_remains_a_solid() {
    for solid in solids() {
        for fluid in [0.0, WATER] {
            let mut before = solid.elasticity().unwrap();
            for porosity in (1..100).map(|percent| f64::from(percent) / 100.0) {
                let found = solid.mori_tanaka(fluid, porosity).elasticity().unwrap();
                if fluid < solid.plane_bulk && softer_in_all(solid, fluid) {
                    // The difference is positive definite: every deformation takes less energy.
                    Elasticity::new(minus(*before.rows(), *found.rows())).unwrap();
                }
                before = found;
            }
        }
    }
}

/// Returns whether the fluid is softer than the solid in every deformation.
fn softer_in_all(solid: HillModuli, fluid: f64) -> bool {
    Elasticity::new(minus(rows(solid), rows(HillModuli::of_fluid(fluid)))).is_ok()
}

#[test]
fn the_self_consistent_estimate_falls_faster_and_ends() {
    for porosity in (1..50).map(|percent| f64::from(percent) / 100.0) {
        let around_matrix = numbers(BONE.mori_tanaka(WATER, porosity));
        let around_bone = numbers(BONE.self_consistent(WATER, porosity).unwrap());
        for (bone, matrix) in around_bone.into_iter().zip(around_matrix) {
            assert!(bone < matrix, "{porosity}: {bone} against {matrix}");
        }
    }
    assert_eq!(BONE.self_consistent(WATER, 0.5), None);
    assert_eq!(BONE.self_consistent(WATER, 0.9), None);
    assert!(BONE.self_consistent(0.0, 0.333).is_some());
    assert_eq!(BONE.self_consistent(0.0, 0.334), None);
}

#[test]
fn moduli_survive_the_way_there_and_back() {
    for solid in solids() {
        all_close(HillModuli::from_elasticity(&solid.elasticity().unwrap()), solid, 1e-13);
    }
}

type Rows = [[f64; 6]; 6];

const UNIT: Rows = {
    let mut unit = [[0.0; 6]; 6];
    let mut i = 0;
    while i < 6 {
        unit[i][i] = 1.0;
        i += 1;
    }
    unit
};

/// Returns the rows of a solid or a fluid, which is no [`Elasticity`].
fn rows(moduli: HillModuli) -> Rows {
    let [k, l, n, m, p] = numbers(moduli);
    let mut rows = [[0.0; 6]; 6];
    rows[0][..3].copy_from_slice(&[n, l, l]);
    rows[1][..3].copy_from_slice(&[l, k + m, k - m]);
    rows[2][..3].copy_from_slice(&[l, k - m, k + m]);
    (rows[3][3], rows[4][4], rows[5][5]) = (2.0 * m, 2.0 * p, 2.0 * p);
    rows
}

/// Returns Hill's tensor of a circular cylinder along axis 1, 1/Pa: the mean over the unit vectors ξ across
/// the axis of the symmetric part of ξ_i (ξ·c·ξ)⁻¹_jk ξ_l (J. R. Willis, Adv. Appl. Mech. 21 (1981) 1). Of
/// a transversely isotropic medium these are trigonometric polynomials of degree 4, so that 8
/// points are exact.
fn hill_tensor(medium: &Elasticity) -> Rows {
    const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)];
    const POINTS: u32 = 8;
    let mut tensor = [[0.0; 6]; 6];
    for point in 0..POINTS {
        let angle = f64::from(point) * std::f64::consts::TAU / f64::from(POINTS);
        let xi = [0.0, libm::cos(angle), libm::sin(angle)];
        let mut acoustic = UNIT;
        for (i, j) in (0..9).map(|index| (index / 3, index % 3)) {
            let terms = (0..9).map(|index| (index / 3, index % 3));
            acoustic[i][j] = terms.map(|(k, l)| medium.component(k, i, j, l) * xi[k] * xi[l]).sum();
        }
        let inverse = inverse(acoustic);
        for (row, &(i, j)) in PAIRS.iter().enumerate() {
            for (column, &(k, l)) in PAIRS.iter().enumerate() {
                let part = |i: usize, j: usize, k: usize, l: usize| xi[i] * inverse[j][k] * xi[l];
                let symmetric =
                    part(i, j, k, l) + part(j, i, k, l) + part(i, j, l, k) + part(j, i, l, k);
                let weight = |pair: usize| if pair > 2 { std::f64::consts::SQRT_2 } else { 1.0 };
                tensor[row][column] +=
                    0.25 * symmetric * weight(row) * weight(column) / f64::from(POINTS);
            }
        }
    }
    tensor
}

fn combined(a: Rows, b: Rows, combine: impl Fn(f64, f64) -> f64) -> Rows {
    std::array::from_fn(|i| std::array::from_fn(|j| combine(a[i][j], b[i][j])))
}

fn plus(a: Rows, b: Rows) -> Rows {
    combined(a, b, |a, b| a + b)
}

fn minus(a: Rows, b: Rows) -> Rows {
    combined(a, b, |a, b| a - b)
}

fn scaled(factor: f64, a: Rows) -> Rows {
    a.map(|row| row.map(|entry| factor * entry))
}

fn times(a: Rows, b: Rows) -> Rows {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..6).map(|k| a[i][k] * b[k][j]).sum::<f64>()))
}

/// Returns the inverse by Gauss and Jordan, with pivots by columns.
fn inverse(mut a: Rows) -> Rows {
    let mut inverse = UNIT;
    for column in 0..6 {
        let largest = |&i: &usize, &j: &usize| a[i][column].abs().total_cmp(&a[j][column].abs());
        let pivot = (column..6).max_by(largest).unwrap();
        a.swap(column, pivot);
        inverse.swap(column, pivot);
        let divisor = a[column][column];
        for j in 0..6 {
            a[column][j] /= divisor;
            inverse[column][j] /= divisor;
        }
        for i in (0..6).filter(|&i| i != column) {
            let factor = a[i][column];
            for j in 0..6 {
                a[i][j] -= factor * a[column][j];
                inverse[i][j] -= factor * inverse[column][j];
            }
        }
    }
    inverse
}

fn matrices_close(found: Rows, expected: Rows) {
    for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
        // Of moduli of up to 200 GPa.
        assert!((found - expected).abs() < 1e-11 * 200e9, "{found} against {expected}");
    }
}
