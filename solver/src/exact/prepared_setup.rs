//! A setup with what every pass of the exact method needs of it.

use osteon_common::bone::BoneRef;
use osteon_common::case::Setup;
use osteon_common::probe::Place;
use osteon_common::sampling;
use osteon_common::settings::Picking;

use crate::failure::{Failure, check_direct_wave, speed_not_finite};
use crate::isa::Isa;
use crate::media::Media;
use crate::picking::criterion;

/// A setup, the places of its receivers, and the instruction set on which it is computed.
#[derive(Debug, Clone)]
pub(super) struct PreparedSetup {
    pub(super) setup: Setup,
    /// Distances of the receivers along the probe, m.
    pub(super) distances: Vec<f64>,
    pub(super) places: Vec<Place>,
    /// The criterion of the first arriving signal, for the probe's pulse.
    pub(super) criterion: Picking,
    pub(super) isa: Isa,
}

impl PreparedSetup {
    pub(super) fn new(setup: &Setup, isa: Isa) -> Self {
        Self {
            setup: setup.clone(),
            distances: setup.probe.distances().collect(),
            places: setup.probe.places().collect(),
            criterion: criterion(setup),
            isa,
        }
    }

    /// Returns the same for another setup with the same probe.
    pub(super) fn with_setup(&self, setup: &Setup) -> Self {
        Self { setup: setup.clone(), criterion: criterion(setup), ..self.clone() }
    }

    /// Returns the media of a bone, and the upper bound of every wave's speed, m/s.
    pub(super) fn media(&self, bone: BoneRef<'_>) -> Result<(Media, f64), Failure> {
        let media = Media::new(self.isa, bone, self.setup.layers.bone_thickness);
        let speed = sampling::fastest(&self.setup, media.fastest());
        if !speed.is_finite() {
            return Err(speed_not_finite());
        }
        check_direct_wave(&self.setup, speed)?;
        Ok((media, speed))
    }
}
