//! Wavenumbers that another program has published.

use osteon_common::bone::Bone;
use osteon_common::elasticity::EngineeringConstants;

use super::solver;

/// Frequencies (Hz), and wavenumbers (rad/m) of all Lamb waves that propagate there, of 1 mm of steel with
/// λ = 115.6 GPa, μ = 78.99 GPa and 7900 kg/m³: every one of `tests/data/Lamb_ref_fields.mat` of GEWtool
/// (D. A. Kiefer, doi:10.5281/zenodo.10114243) at six of its frequencies.
const GEWTOOL: [(f64, &[f64]); 6] = [
    (10e3, &[11.7803915, 202.7393771]),
    (36_778.523_489_932_886, &[43.327101, 392.536493]),
    (545_570.469_798_657_8, &[644.7695397, 1773.6675107]),
    (2_018_389.261_744_966, &[1413.5465735, 2635.2100979, 4714.3830268]),
    (2_955_637.583_892_618, &[2771.5932516, 3042.7353891, 5538.3762697, 6597.3805623]),
    (4e6, &[2246.7320369, 4332.2156697, 5055.2251429, 8269.0643259, 8735.6104734]),
];

#[test]
fn lamb_waves_of_steel_are_those_of_gewtool() {
    let (lame, shear) = (115.6e9, 78.99e9);
    let poisson = 0.5 * lame / (lame + shear);
    let young = 2.0 * shear * (1.0 + poisson);
    let constants = EngineeringConstants {
        longitudinal_young_modulus: young,
        longitudinal_poisson_ratio: poisson,
        longitudinal_shear_modulus: shear,
        transverse_young_modulus: young,
        transverse_poisson_ratio: poisson,
    };
    let steel = Bone { density: 7900.0, elasticity: constants.elasticity().unwrap() };
    for (frequency, expected) in GEWTOOL {
        let modes = solver(1e-3).modes(&steel, frequency).unwrap();
        let is_sheared = |name: &Option<String>| name.as_ref().unwrap().starts_with("SH");
        let mut found: Vec<f64> = modes
            .iter()
            .filter(|mode| !is_sheared(&mode.name))
            .map(|mode| mode.wavenumber)
            .collect();
        found.sort_unstable_by(f64::total_cmp);
        assert_eq!(found.len(), expected.len(), "{frequency} Hz: {found:?}");
        for (found, expected) in found.iter().zip(expected) {
            let error = (found / expected - 1.0).abs();
            assert!(error < 1e-8, "{frequency} Hz: {found}, {expected}: {error:e}");
        }
    }
}
