//! Whatever passes validation gives a velocity or a typed failure: never a panic, never a NaN.

use osteon_common::case::Setup;
use osteon_common::check;
use osteon_common::layers::{Fluid, Layers};
use osteon_common::parameters::Point;
use osteon_common::probe::{Probe, Receivers, Source};
use osteon_common::realization::Ensemble;
use osteon_common::sampling::pair_count;
use osteon_common::violations::Violations;
use osteon_solver::{Solver, Workspace};
use proptest::prelude::*;

/// Setups with more pairs are left out: they are as right, and take too long here.
const PAIRS_MAX: f64 = 3e4;

/// 10^exponent for an exponent between the given ones.
fn decades(from: f64, to: f64) -> impl Strategy<Value = f64> {
    (from..to).prop_map(libm::exp10)
}

fn fluid() -> impl Strategy<Value = Fluid> {
    (decades(-3.5, -1.5), 1.0..3000.0, 300.0..2500.0)
        .prop_map(|(thickness, density, sound_speed)| Fluid { thickness, density, sound_speed })
}

fn setup() -> impl Strategy<Value = Setup> {
    let probe = (
        0.25e6..2e6,
        (0.01..0.99, 0.01..0.99),
        (decades(-3.0, -1.3), decades(-4.0, -2.0), 3_u32..=64),
    );
    (fluid(), decades(-6.0, -2.0), fluid(), probe).prop_map(
        |(coupling, bone_thickness, marrow, (center_frequency, heights, row))| Setup {
            layers: Layers { coupling, bone_thickness, marrow },
            probe: Probe {
                center_frequency,
                amplitude: 100.0,
                source: Source { x1: 0.0, x3: heights.0 * coupling.thickness },
                receivers: Receivers {
                    first_x1: row.0,
                    pitch: row.1,
                    count: row.2,
                    x3: heights.1 * coupling.thickness,
                },
            },
            ..Setup::default()
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, ..ProptestConfig::default() })]

    #[test]
    fn a_velocity_or_a_typed_failure(setup in setup(), dispersion in 0.01..0.79, seed in any::<u32>()) {
        let mut violations = Violations::new();
        check::setup(&setup, &mut violations);
        prop_assume!(violations.is_empty() && pair_count(&setup) < PAIRS_MAX);
        let point = Point([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, dispersion]);
        let ensemble = Ensemble::new(&point, u64::from(seed)).unwrap();
        let solver = Solver::new(&setup);
        let mut workspace = Workspace::default();
        for index in 0..2 {
            let bone = ensemble.bone(index).unwrap();
            match solver.arrival(&bone, &mut workspace) {
                Ok(arrival) => {
                    prop_assert!(arrival.velocity.is_finite() && arrival.velocity > 0.0);
                    prop_assert!(arrival.times.iter().all(|t| t.is_finite() && *t > 0.0));
                    prop_assert_eq!(arrival.times.len(), setup.probe.receivers.count as usize);
                }
                Err(failure) => prop_assert!(!failure.detail.is_empty()),
            }
        }
    }
}
