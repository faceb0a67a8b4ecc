//! A setup with what every pass of the exact method needs of it.

use osteon_common::case::{Bone, Setup};
use osteon_common::probe::Place;
use osteon_common::sampling;

use crate::exact::plate::Plate;
use crate::exact::tensor::{FillPlate, Solid};
use crate::failure::{Failure, check_direct_wave, speed_not_finite};
use crate::isa::Isa;
use crate::medium::Medium;

/// A setup, the places of its receivers, and the instruction set on which it is computed.
#[derive(Debug, Clone)]
pub(super) struct PreparedSetup {
    pub(super) setup: Setup,
    /// Distances of the receivers along the probe, m.
    pub(super) distances: Vec<f64>,
    pub(super) places: Vec<Place>,
    pub(super) isa: Isa,
}

impl PreparedSetup {
    pub(super) fn new(setup: &Setup, isa: Isa) -> Self {
        Self {
            setup: *setup,
            distances: setup.probe.distances().collect(),
            places: setup.probe.places().collect(),
            isa,
        }
    }

    /// Returns the solid of a bone, and the upper bound of every wave's speed, m/s.
    pub(super) fn solid(&self, bone: &Bone) -> Result<(Medium, f64), Failure> {
        let medium = self.isa.run(Solid(bone));
        let speed = sampling::fastest(&self.setup, medium.fastest);
        if !speed.is_finite() {
            return Err(speed_not_finite());
        }
        check_direct_wave(&self.setup, speed)?;
        Ok((medium, speed))
    }

    /// Fills `plate` for `medium`.
    pub(super) fn fill_plate<const TERMS: usize>(&self, medium: &Medium, plate: &mut Plate<TERMS>) {
        let thickness = self.setup.layers.bone_thickness;
        self.isa.run(FillPlate { medium, thickness, plate });
    }
}
