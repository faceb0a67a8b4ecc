//! The velocities that a layered medium can carry, generously bounded: an answer beyond them is no velocity.

use std::ops::RangeInclusive;

use crate::layers::Layers;
use crate::parameters::Point;

/// Factor beyond the speeds of the mean model within which every velocity is taken for possible: random
/// elasticity, tilted probes and attenuation change velocities by much less.
const MARGIN: f64 = 10.0;

/// Returns the velocities, m/s, that realizations of a point can have: from a tenth of the speed of sound in
/// the slowest fluid to ten times an upper bound on the speeds in the mean bone (the square root of the trace
/// of its elasticity over its density) and in the fluids. `None` if the mean elasticity is inadmissible, so
/// that there are no realizations.
pub fn carried_velocities(layers: &Layers, point: &Point) -> Option<RangeInclusive<f64>> {
    let elasticity = point.constants().elasticity().ok()?;
    let trace: f64 = (0..6).map(|i| elasticity.rows()[i][i]).sum();
    let bone = (trace / point.density()).sqrt();
    let fluids = [layers.coupling_fluids(), layers.marrow_fluids()];
    let speeds = || fluids.iter().flat_map(|all| all.as_slice()).map(|fluid| fluid.sound_speed);
    Some(speeds().fold(f64::INFINITY, f64::min) / MARGIN..=speeds().fold(bone, f64::max) * MARGIN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_are_bounded_by_the_medium() {
        let optimum = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
        let carried = carried_velocities(&Layers::default(), &optimum).unwrap();
        for (velocity, is_carried) in [
            (5e-324, false),
            (149.0, false),
            (151.0, true),
            (3908.8, true),
            (12e3, true),
            (1e6, false),
            (1e308, false),
        ] {
            assert_eq!(carried.contains(&velocity), is_carried, "{velocity} in {carried:?}");
        }
        let mut inadmissible = optimum;
        inadmissible.0[5] = 1.5;
        assert_eq!(carried_velocities(&Layers::default(), &inadmissible), None);
    }
}
