//! Heights of source and receivers in the fluids above the bone.

use osteon_common::case::Setup;
use osteon_common::fluid_sublayers::FluidSublayers;

use crate::exact::element_average::ElementAverage;

/// Heights of source and receivers above the bone, m.
#[derive(Debug, Clone)]
pub(super) struct Heights {
    pub(super) source: f64,
    pub(super) lowest: f64,
    /// Height of a receiver above the next lower one; 0 if all have one height.
    pub(super) step: f64,
    /// Whether receivers with larger numbers are lower.
    pub(super) falling: bool,
    /// The fluids above the bone, upwards.
    pub(super) fluids: FluidSublayers,
    /// The numbers, from the lowest receiver upwards, of those that are the first ones in another fluid;
    /// each fluid's receivers end where the next one's begin, the last one's at their number.
    pub(super) ends: Vec<usize>,
    /// What source and receivers average over; `None` if they are lines.
    pub(super) elements: Option<ElementAverage>,
}

impl Heights {
    pub(super) fn from_setup(setup: &Setup) -> Self {
        let probe = &setup.probe;
        let heights: Vec<f64> = probe.places().map(|place| place.x3).collect();
        let fluids = setup.layers.coupling_fluids();
        let mut new = Self {
            source: probe.source.x3,
            lowest: probe.lowest_receiver(),
            step: probe.receivers.pitch * libm::sin(probe.tilt).abs(),
            falling: heights.first() > heights.last(),
            fluids,
            ends: Vec::new(),
            elements: ElementAverage::from_probe(probe),
        };
        let fluid = |number: usize| new.fluids.at(new.height(number));
        let others = (1..heights.len()).filter(|&number| fluid(number) != fluid(number - 1));
        let ends = others.chain([heights.len()]).collect();
        new.ends = ends;
        new
    }

    /// Returns the height, m, of a receiver; they are numbered from the lowest upwards.
    pub(super) fn height(&self, number: usize) -> f64 {
        (number as f64).mul_add(self.step, self.lowest)
    }

    /// Returns the number of the lowest receiver in a fluid; fluids with receivers are numbered upwards.
    pub(super) fn first_in(&self, fluid: usize) -> usize {
        fluid.checked_sub(1).map_or(0, |below| self.ends[below])
    }

    /// Returns whether the receivers are at different heights.
    pub(super) fn are_different(&self) -> bool {
        self.step != 0.0
    }

    /// Returns the density, kg/m³, of the fluid on the bone's face.
    pub(super) fn face_density(&self) -> f64 {
        self.fluids.as_slice().first().map_or(0.0, |fluid| fluid.density)
    }
}
