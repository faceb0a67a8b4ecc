//! Scatter of quantities of the setup, of random jobs.

use osteon_common::case::Setup;
use osteon_common::random_quantities::{RandomDistribution, RandomQuantities, Scatter};
use osteon_common::setup_quantity::SetupQuantity;
use proptest::prelude::*;

pub(crate) fn random() -> impl Strategy<Value = [(Option<f64>, RandomDistribution); 5]> {
    let distribution = prop::sample::select(RandomDistribution::ALL.to_vec());
    prop::array::uniform5((prop::option::of(0.001..0.08), distribution))
}

/// Makes quantities random, each by a share of its mean.
pub(crate) fn scattered(
    [thickness, quality, speed, tilt, porosity]: [(Option<f64>, RandomDistribution); 5],
    setup: &Setup,
) -> RandomQuantities {
    let scatter = |(share, distribution): (Option<f64>, RandomDistribution), mean: f64| {
        let share = share.filter(|share| share * mean > 0.0);
        let deviation =
            |share: f64| Scatter { standard_deviation: Some(share * mean), distribution };
        share.map_or_else(Scatter::default, deviation)
    };
    let quality_factor = setup.layers.bone_attenuation.quality_factor;
    RandomQuantities {
        bone_thickness: scatter(thickness, setup.layers.bone_thickness),
        // The smallest that is accepted is 2.
        bone_quality_factor: scatter(quality, quality_factor.map_or(0.0, |mean| mean - 2.0)),
        coupling_sound_speed: scatter(
            speed,
            SetupQuantity::CouplingSoundSpeed.value_in(setup).unwrap_or(0.0),
        ),
        probe_tilt: scatter(tilt, setup.probe.tilt),
        porosity: scatter(porosity, setup.structure.porosity.unwrap_or(0.0)),
        ..RandomQuantities::default()
    }
}
