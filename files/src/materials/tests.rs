use std::fs;
use std::path::Path;

use osteon_common::elasticity::Elasticity;
use osteon_common::parameters::{AS_IN_SETUP, Parameter, Point, extended};

use super::*;

/// Names of the files in `examples/materials`.
fn files() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/materials");
    let entries = fs::read_dir(folder).unwrap();
    let name = |path: &Path| path.file_stem().unwrap().to_str().unwrap().to_owned();
    let mut names: Vec<_> = entries.map(|entry| name(&entry.unwrap().path())).collect();
    names.sort();
    names
}

#[test]
fn every_file_is_compiled_in() {
    let mut names = NAMES.map(str::to_owned);
    names.sort();
    assert_eq!(files(), names);
    assert_eq!(all().len(), names.len());
}

#[test]
fn every_material_is_admissible_and_plausible_as_bone() {
    for (name, material) in all() {
        assert_eq!(material.constants().violated(), [], "{name}");
        let values = Parameter::OF_BONE.map(|parameter| material.value(parameter).unwrap_or(0.1));
        let point = Point::new(extended(values, AS_IN_SETUP));
        let bulk = osteon_common::bulk_velocity::bulk_velocity(&point).unwrap();
        let velocity = libm::exp(bulk.logarithm);
        assert!((3000.0..4500.0).contains(&velocity), "{name}: {velocity} m/s");
        assert!(!material.reference.is_empty() && !material.checked.is_empty(), "{name}");
        if let Some(doi) = &material.doi {
            assert!(doi.starts_with("10."), "{name}: {doi}");
        }
    }
}

/// Stiffness as published, GPa, axis 3 along the bone: C11 C22 C33 C44 C55 C66 C12 C13 C23.
const PUBLISHED: [(&str, [f64; 9]); 7] = [
    ("human-femur-ashman-1984", [18.0, 20.2, 27.6, 6.23, 5.61, 4.52, 9.98, 10.1, 10.7]),
    ("human-femur-dry-yoon-1976", [23.4, 23.4, 32.5, 8.71, 8.71, 7.17, 9.06, 9.11, 9.11]),
    ("human-tibia-rho-1996", [19.5, 20.1, 30.9, 5.72, 5.17, 4.05, 11.4, 12.5, 12.5]),
    ("bovine-femur-haversian-katz-1984", [21.2, 21.0, 29.0, 6.3, 6.3, 5.4, 11.7, 12.7, 11.1]),
    ("bovine-femur-plexiform-katz-1984", [22.4, 25.0, 35.0, 8.2, 7.1, 6.1, 14.0, 15.8, 13.6]),
    ("bovine-femur-van-buskirk-1981", [14.1, 18.4, 25.0, 7.0, 6.3, 5.28, 6.34, 4.84, 6.94]),
    ("bovine-phalanx-lang-1969", [19.7, 19.7, 32.0, 5.4, 5.4, 3.8, 12.1, 12.6, 12.6]),
];

/// The constants in the files follow from the published stiffness by averaging it over all rotations
/// about the long axis, which here is computed by rotating.
#[test]
fn the_files_have_the_published_stiffness() {
    for (name, c) in PUBLISHED {
        let material = named(name).unwrap();
        let [c11, c22, c33, c44, c55, c66, c12, c13, c23] = c;
        // Axes 1 2 3 of this program are 3 1 2 of the papers; shear is doubled (Kelvin-Mandel).
        let mut rows = [[0.0; 6]; 6];
        let normal = [[c33, c13, c23], [c13, c11, c12], [c23, c12, c22]];
        for i in 0..3 {
            rows[i][..3].copy_from_slice(&normal[i]);
        }
        // 23 here is 12 there, 31 is 23, 12 is 13.
        rows[3][3] = 2.0 * c66;
        rows[4][4] = 2.0 * c44;
        rows[5][5] = 2.0 * c55;
        let published = Elasticity::new(rows).unwrap();
        let mean = average(&published);
        let ours = *material.constants().elasticity().unwrap().rows();
        for i in 0..6 {
            for j in 0..6 {
                let difference = (ours[i][j] * 1e-9 - mean[i][j]).abs();
                // Five digits of the constants; c66 of a transversely isotropic source is rounded
                // to two decimals.
                assert!(difference < 0.015, "{name}: ({i},{j}) {} {}", ours[i][j], mean[i][j]);
            }
        }
    }
}

/// Returns the mean of a stiffness over rotations about axis 1.
fn average(stiffness: &Elasticity) -> [[f64; 6]; 6] {
    const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)];
    // A trigonometric polynomial of degree 4 has its mean over 8 equal steps.
    let steps = 8;
    let mut mean = [[0.0; 6]; 6];
    for step in 0..steps {
        let angle = std::f64::consts::TAU * f64::from(step) / f64::from(steps);
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        let turn = [[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]];
        for (row, (i, j)) in PAIRS.into_iter().enumerate() {
            for (column, (k, l)) in PAIRS.into_iter().enumerate() {
                let mut sum = 0.0;
                for index in 0..81_usize {
                    let [p, q, r, s] = [index / 27, index / 9 % 3, index / 3 % 3, index % 3];
                    sum += turn[i][p]
                        * turn[j][q]
                        * turn[k][r]
                        * turn[l][s]
                        * stiffness.component(p, q, r, s);
                }
                let shear = [row, column].iter().filter(|&&n| n > 2).count();
                let scale = [1.0, std::f64::consts::SQRT_2, 2.0][shear];
                mean[row][column] += scale * sum / f64::from(steps);
            }
        }
    }
    mean
}
