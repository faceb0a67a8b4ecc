//! Random fluids, of one or of several sublayers.

use osteon_common::fluid_sublayers::{FluidSublayer, FluidSublayers};
use osteon_common::layers::{Fluid, Layers};
use osteon_common::limits::FLUID_SUBLAYERS_MAX;
use proptest::prelude::*;

/// Any positive normal or subnormal number.
pub(crate) fn positive() -> impl Strategy<Value = f64> {
    use proptest::num::f64::{NORMAL, POSITIVE, SUBNORMAL};
    POSITIVE | NORMAL | SUBNORMAL
}

pub(crate) fn fluid() -> impl Strategy<Value = Fluid> {
    let one = || (4e-3..30e-3, positive(), 1200.0..1800.0);
    let of_one = one().prop_map(|(thickness, density, sound_speed)| Fluid {
        thickness,
        density,
        sound_speed,
        ..Layers::default().coupling
    });
    let sublayer = one().prop_map(|(thickness, density, sound_speed)| FluidSublayer {
        thickness,
        density,
        sound_speed,
    });
    let some = prop::collection::vec(sublayer, 1..=FLUID_SUBLAYERS_MAX);
    let of_sublayers = some.prop_filter_map("not too many", |all| {
        let sublayers = FluidSublayers::new(&all)?;
        Some(Fluid { sublayers, ..Layers::default().coupling })
    });
    prop_oneof![of_one, of_sublayers]
}
