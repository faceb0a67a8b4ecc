//! Draws from posteriors as messages.

use osteon_common::posterior::PosteriorDraw;

use crate::malformed::{Malformed, present};
use crate::parameter_values::{point_from_message, point_to_message};
use crate::v1;

/// Returns a block of `draws`, the first of which has number `first`. `group` is the group whose
/// posterior they are from, if there are groups.
pub fn draws_to_message(group: Option<u32>, first: u64, draws: &[PosteriorDraw]) -> v1::DrawBlock {
    let draw = |draw: &PosteriorDraw| v1::PosteriorDraw {
        point: Some(point_to_message(&draw.point)),
        log_density: Some(draw.log_density),
        mean: Some(draw.mean),
        coefficient_of_variation: Some(draw.coefficient_of_variation),
    };
    v1::DrawBlock { group, first, draws: draws.iter().map(draw).collect() }
}

/// Returns the number of the first draw of a block, and the block's draws.
///
/// # Errors
/// If a draw lacks one of its numbers, or if its point is not finite.
pub fn draws_from_message(block: &v1::DrawBlock) -> Result<(u64, Vec<PosteriorDraw>), Malformed> {
    let draw = |draw: &v1::PosteriorDraw| {
        let variation = draw.coefficient_of_variation;
        Ok(PosteriorDraw {
            point: point_from_message(draw.point.as_ref())?,
            log_density: present(draw.log_density, "log_density")?,
            mean: present(draw.mean, "mean")?,
            coefficient_of_variation: present(variation, "coefficient_of_variation")?,
        })
    };
    Ok((block.first, block.draws.iter().map(draw).collect::<Result<_, Malformed>>()?))
}

#[cfg(test)]
mod tests;
