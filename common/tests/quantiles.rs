//! Quantile functions against tables of an arbitrary-precision library (see the head of each file).

use osteon_common::special::{GammaQuantile, standard_normal_quantile};

#[test]
fn gamma_quantiles_agree_with_40_digits() {
    let mut rows = 0;
    for [shape, u, expected] in table(include_str!("data/gamma_quantile.csv")) {
        let x = GammaQuantile::new(shape).relative_quantile(u);
        let error = (x - expected).abs() / expected;
        assert!(error < 4e-15, "shape {shape}, u {u:e}: {x:e}, expected {expected:e}");
        rows += 1;
    }
    assert_eq!(rows, 176);
}

#[test]
fn normal_quantiles_agree_with_50_digits() {
    let mut rows = 0;
    for [u, expected] in table(include_str!("data/normal_quantile.csv")) {
        let x = standard_normal_quantile(u);
        let error = (x - expected).abs();
        assert!(error <= 6e-16 * expected.abs(), "u {u:e}: {x:e}, expected {expected:e}");
        rows += 1;
    }
    assert_eq!(rows, 24);
}

/// Rows of comma-separated numbers; lines that start with # are comments.
#[expect(clippy::unwrap_used, reason = "a table that cannot be read is a failed test")]
fn table<const N: usize>(text: &str) -> Vec<[f64; N]> {
    let parse = |line: &str| {
        let row: Vec<f64> = line.split(',').map(|number| number.parse().unwrap()).collect();
        row.try_into().unwrap()
    };
    text.lines().filter(|line| !line.starts_with('#')).map(parse).collect()
}
