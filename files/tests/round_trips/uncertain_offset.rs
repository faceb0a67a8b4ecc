//! A systematic error, an uncertain offset of the velocities, for random jobs.

use osteon_common::random_quantities::RandomDistribution;
use osteon_common::systematic::{Systematic, SystematicLaw, SystematicQuantity};

/// Returns an uncertain offset of the velocities, where the job allows any.
pub(crate) fn uncertain_offset(allowed: bool, spread: f64) -> Systematic {
    let mut systematic = Systematic::default();
    if allowed {
        let distribution = RandomDistribution::Uniform;
        systematic.laws[SystematicQuantity::VelocityOffset as usize] =
            SystematicLaw { spread: Some(spread), distribution, center: Some(0.0) };
    }
    systematic
}
