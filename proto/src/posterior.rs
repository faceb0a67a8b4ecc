//! Posteriors as messages, and their draws, which come in blocks of their own.

use osteon_common::job::{DRAWS_MAX, POSTERIOR_EVALUATIONS_MAX};
use osteon_common::parameters::Parameter;
use osteon_common::posterior::{Posterior, PosteriorDraw, PosteriorSummary, QUANTILE_LEVELS};

use crate::choice::PARAMETER;
use crate::malformed::{Malformed, present};
use crate::matrix_entry::{entry_number, place};
use crate::parameter_values::{
    point_from_message, point_to_message, some_from_message, some_to_message,
};
use crate::v1;

/// Returns the message of a posterior without its draws.
pub(crate) fn to_message(posterior: &Posterior) -> v1::Posterior {
    let Posterior { free, parameters, correlation, entries, .. } = posterior;
    let parameters = free.iter().zip(parameters).map(|(parameter, summary)| {
        let parameter = PARAMETER.number(*parameter);
        v1::ParameterPosterior { parameter, posterior: Some(summary_to_message(summary)) }
    });
    let entries = entries.iter().map(|(row, column, summary)| v1::EntryPosterior {
        row: entry_number(*row),
        column: entry_number(*column),
        posterior: Some(summary_to_message(summary)),
    });
    v1::Posterior {
        converged: posterior.converged,
        reason: posterior.reason.clone(),
        evaluations: posterior.evaluations,
        effective_draws: posterior.effective_draws,
        checked_draws: posterior.checked_draws,
        model_error: posterior.model_error,
        check_efficiency: posterior.check_efficiency,
        pareto_k: posterior.pareto_k,
        sampling_error: posterior.sampling_error,
        parameters: parameters.collect(),
        correlations: correlation.iter().map(|row| some_to_message(free, row)).collect(),
        bulk_velocity: Some(summary_to_message(&posterior.bulk_velocity)),
        mean: Some(summary_to_message(&posterior.mean)),
        coefficient_of_variation: Some(summary_to_message(&posterior.coefficient_of_variation)),
        mandel: entries.collect(),
        predictive_p_value: posterior.predictive_p_value,
        outlier_share: posterior.outlier_share,
        draws: posterior.draws.len() as u64,
    }
}

/// Returns the posterior of a message, with the `draws` that came after it.
///
/// # Errors
/// If a required field is absent, if fields contradict each other, or if there are more or fewer
/// draws than the message says.
pub(crate) fn from_message(
    message: &v1::Posterior,
    draws: Vec<PosteriorDraw>,
) -> Result<Posterior, Malformed> {
    counts(message, draws.len())?;
    let of_parameter = |one: &v1::ParameterPosterior| {
        Ok((
            PARAMETER.required(one.parameter, "parameter")?,
            summary(one.posterior.as_ref(), "posterior")?,
        ))
    };
    let known: Vec<(Parameter, PosteriorSummary)> =
        message.parameters.iter().map(of_parameter).collect::<Result<_, Malformed>>()?;
    let (free, parameters): (Vec<Parameter>, Vec<PosteriorSummary>) = known.into_iter().unzip();
    let (found, expected) = (message.correlations.len(), free.len());
    if found != expected {
        return Err(Malformed::WrongLength { field: "correlations", found, expected });
    }
    let correlation = message.correlations.iter().map(|row| some_from_message(&free, row));
    let entry = |one: &v1::EntryPosterior| {
        let row = place(one.row, 1, "row")?;
        let column = place(one.column, one.row, "column")?;
        Ok((row, column, summary(one.posterior.as_ref(), "posterior")?))
    };
    let variation = message.coefficient_of_variation.as_ref();
    Ok(Posterior {
        converged: message.converged,
        reason: message.reason.clone(),
        evaluations: message.evaluations,
        effective_draws: message.effective_draws,
        checked_draws: message.checked_draws,
        model_error: message.model_error,
        check_efficiency: message.check_efficiency,
        pareto_k: message.pareto_k,
        sampling_error: message.sampling_error,
        correlation: correlation.collect::<Result<_, _>>()?,
        free,
        parameters,
        mean: summary(message.mean.as_ref(), "mean")?,
        coefficient_of_variation: summary(variation, "coefficient_of_variation")?,
        bulk_velocity: summary(message.bulk_velocity.as_ref(), "bulk_velocity")?,
        entries: message.mandel.iter().map(entry).collect::<Result<_, Malformed>>()?,
        predictive_p_value: message.predictive_p_value,
        outlier_share: message.outlier_share,
        draws,
    })
}

/// Checks the numbers of evaluations and draws.
fn counts(message: &v1::Posterior, found: usize) -> Result<(), Malformed> {
    let bounded = [
        ("evaluations", message.evaluations, POSTERIOR_EVALUATIONS_MAX, "at most 2000"),
        ("draws", message.draws, DRAWS_MAX, "at most 20 000"),
    ];
    for (field, value, most, allowed) in bounded {
        if value > most {
            return Err(Malformed::OutOfRange { field, value: value as f64, allowed });
        }
    }
    let expected = usize::try_from(message.draws).unwrap_or(usize::MAX);
    if found != expected {
        return Err(Malformed::WrongLength { field: "draws", found, expected });
    }
    Ok(())
}

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

fn summary_to_message(summary: &PosteriorSummary) -> v1::QuantityPosterior {
    v1::QuantityPosterior {
        mean: Some(summary.mean),
        standard_deviation: Some(summary.standard_deviation),
        quantiles: summary.quantiles.to_vec(),
        prior_standard_deviation: Some(summary.prior_standard_deviation),
    }
}

fn summary(
    message: Option<&v1::QuantityPosterior>,
    field: &'static str,
) -> Result<PosteriorSummary, Malformed> {
    let message = present(message, field)?;
    let (found, expected) = (message.quantiles.len(), QUANTILE_LEVELS.len());
    let wrong = Malformed::WrongLength { field: "quantiles", found, expected };
    let prior = message.prior_standard_deviation;
    Ok(PosteriorSummary {
        mean: present(message.mean, "mean")?,
        standard_deviation: present(message.standard_deviation, "standard_deviation")?,
        quantiles: <[f64; 7]>::try_from(message.quantiles.as_slice()).map_err(|_| wrong)?,
        prior_standard_deviation: present(prior, "prior_standard_deviation")?,
    })
}

#[cfg(test)]
pub(crate) mod tests;
