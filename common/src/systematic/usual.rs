//! How far quantities of the setup usually are from what a job says: judgements, whose reasons and sources
//! docs/how-to-systematic.md names.

use crate::case::Setup;
use crate::random_quantities::RandomDistribution::{self, LogNormal, Normal};
use crate::shift::SystematicQuantity;

/// Quality factor that a bone has whose job says nothing of losses: 4.5 dB/cm at 1 MHz and 4000 m/s.
pub const QUALITY_FACTOR: f64 = 15.0;

/// Part of the mean porosity by which the difference of both sides is usually off.
const GRADIENT_OF_MEAN: f64 = 0.5;

/// Returns the usual law of a quantity about its value in a setup, and its spread, as those of a job; `None` where
/// the setup has no such quantity.
pub fn law(quantity: SystematicQuantity, setup: &Setup) -> Option<(RandomDistribution, f64)> {
    Some(match quantity {
        SystematicQuantity::BoneThickness => (LogNormal, 0.1),
        SystematicQuantity::BoneQualityFactor => (LogNormal, 0.4),
        SystematicQuantity::CouplingSoundSpeed => (LogNormal, 0.03),
        SystematicQuantity::MarrowSoundSpeed => (LogNormal, 0.02),
        SystematicQuantity::SourceHeight | SystematicQuantity::ReceiverHeight => (LogNormal, 0.1),
        SystematicQuantity::FirstReceiver => (Normal, 1e-3),
        SystematicQuantity::Pitch => (LogNormal, 0.002),
        SystematicQuantity::CenterFrequency => (LogNormal, 0.1),
        // Half a degree.
        SystematicQuantity::Tilt => (Normal, 8.73e-3),
        SystematicQuantity::PorosityGradient => {
            (Normal, GRADIENT_OF_MEAN * setup.structure.mean_porosity()?)
        }
        SystematicQuantity::VelocityOffset => (Normal, 10.0),
    })
}
