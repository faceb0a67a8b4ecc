//! Conclusions from the data as messages.

use osteon_common::inference::{
    Conclusions, DerivedQuantity, Direction, Inference, NoiseErrors, Profile, Sensitivity,
    Solution, Solutions, Spread, Spreads, Uncertainty,
};
use osteon_common::parameters::{BONE_PARAMETERS, Parameter};
use osteon_common::posterior::PosteriorDraw;

use crate::choice::PARAMETER;
use crate::interval::{interval_from_message, interval_to_message};
use crate::malformed::{Malformed, present};
use crate::matrix_entry::{entry_number, place};
use crate::moments::{moments_from_message, moments_to_message};
use crate::parameter_values::{
    point_from_message, point_to_message, some_from_message, some_to_message,
};
use crate::posterior;
use crate::v1;

/// The fields of a result that hold its conclusions.
pub(crate) struct ConclusionFields {
    pub(crate) sensitivities: Vec<v1::Sensitivity>,
    pub(crate) identified: Option<v1::Identified>,
    pub(crate) profiles: Vec<v1::Profile>,
    pub(crate) solutions: Option<v1::Solutions>,
    pub(crate) posterior: Option<v1::Posterior>,
}

/// The same fields, borrowed from a message.
pub(crate) struct FieldsOf<'a> {
    pub(crate) sensitivities: &'a [v1::Sensitivity],
    pub(crate) identified: Option<&'a v1::Identified>,
    pub(crate) profiles: &'a [v1::Profile],
    pub(crate) solutions: Option<&'a v1::Solutions>,
    pub(crate) posterior: Option<&'a v1::Posterior>,
}

pub(crate) fn to_message(conclusions: &Conclusions) -> ConclusionFields {
    let Conclusions { inference, profiles, solutions, posterior } = conclusions;
    let sensitivities = inference.iter().flat_map(|found| &found.sensitivities);
    ConclusionFields {
        sensitivities: sensitivities.map(sensitivity_to_message).collect(),
        identified: inference.as_ref().map(identified_to_message),
        profiles: profiles.iter().map(profile_to_message).collect(),
        solutions: solutions.as_ref().map(solutions_to_message),
        posterior: posterior.as_ref().map(posterior::to_message),
    }
}

/// Returns the conclusions of a result, with the `draws` from its posterior.
///
/// # Errors
/// If a required field is absent, if fields contradict each other, or if there are draws and no
/// posterior.
pub(crate) fn from_message(
    fields: &FieldsOf<'_>,
    draws: Vec<PosteriorDraw>,
) -> Result<Conclusions, Malformed> {
    if fields.posterior.is_none() && !draws.is_empty() {
        return Err(Malformed::Missing { field: "posterior" });
    }
    let sensitivities =
        fields.sensitivities.iter().map(sensitivity_from_message).collect::<Result<Vec<_>, _>>()?;
    let inference =
        fields.identified.map(|message| identified_from_message(message, sensitivities));
    Ok(Conclusions {
        inference: inference.transpose()?,
        profiles: fields.profiles.iter().map(profile_from_message).collect::<Result<_, _>>()?,
        solutions: fields.solutions.map(solutions_from_message).transpose()?,
        posterior: fields
            .posterior
            .map(|message| posterior::from_message(message, draws))
            .transpose()?,
    })
}

fn sensitivity_to_message(one: &Sensitivity) -> v1::Sensitivity {
    v1::Sensitivity {
        parameter: PARAMETER.number(one.parameter),
        mean: Some(one.mean),
        coefficient_of_variation: Some(one.coefficient_of_variation),
        decay: one.decay,
    }
}

fn sensitivity_from_message(message: &v1::Sensitivity) -> Result<Sensitivity, Malformed> {
    let variation = message.coefficient_of_variation;
    Ok(Sensitivity {
        parameter: PARAMETER.required(message.parameter, "parameter")?,
        mean: present(message.mean, "mean")?,
        coefficient_of_variation: present(variation, "coefficient_of_variation")?,
        decay: message.decay,
    })
}

fn identified_to_message(found: &Inference) -> v1::Identified {
    let quantity = |(parameter, quantity): &(Parameter, DerivedQuantity)| v1::ParameterQuantity {
        parameter: PARAMETER.number(*parameter),
        quantity: Some(quantity_to_message(quantity)),
    };
    let direction = |direction: &Direction| v1::Direction {
        singular_value: direction.singular_value,
        components: Some(some_to_message(&found.free, &direction.components)),
    };
    let free = found.undetermined.iter().map(|one| some_to_message(&found.free, one));
    v1::Identified {
        matched: found.matched,
        level: found.level,
        data_noise: found.noise.data.as_ref().map(moments_to_message),
        sampling_noise: Some(moments_to_message(&found.noise.sampling)),
        bulk_velocity: Some(quantity_to_message(&found.bulk_velocity)),
        dispersion: Some(quantity_to_message(&found.dispersion)),
        parameters: found.parameters.iter().map(quantity).collect(),
        directions: found.fixed.iter().map(direction).collect(),
        free_directions: free.collect(),
    }
}

fn identified_from_message(
    message: &v1::Identified,
    sensitivities: Vec<Sensitivity>,
) -> Result<Inference, Malformed> {
    let free: Vec<Parameter> = sensitivities.iter().map(|one| one.parameter).collect();
    let quantity = |one: &v1::ParameterQuantity| {
        let found = quantity_from_message(one.quantity.as_ref(), "quantity")?;
        Ok((PARAMETER.required(one.parameter, "parameter")?, found))
    };
    let direction = |one: &v1::Direction| {
        let components = present(one.components.as_ref(), "components")?;
        let components = some_from_message(&free, components)?;
        Ok(Direction { singular_value: one.singular_value, components })
    };
    let sampling = present(message.sampling_noise.as_ref(), "sampling_noise")?;
    let undetermined = message.free_directions.iter().map(|one| some_from_message(&free, one));
    Ok(Inference {
        matched: message.matched,
        level: message.level,
        noise: NoiseErrors {
            data: message.data_noise.as_ref().map(moments_from_message),
            sampling: moments_from_message(sampling),
        },
        fixed: message.directions.iter().map(direction).collect::<Result<_, Malformed>>()?,
        undetermined: undetermined.collect::<Result<_, _>>()?,
        bulk_velocity: quantity_from_message(message.bulk_velocity.as_ref(), "bulk_velocity")?,
        dispersion: quantity_from_message(message.dispersion.as_ref(), "dispersion")?,
        parameters: message.parameters.iter().map(quantity).collect::<Result<_, Malformed>>()?,
        free,
        sensitivities,
    })
}

fn quantity_to_message(quantity: &DerivedQuantity) -> v1::Quantity {
    v1::Quantity {
        value: Some(quantity.value),
        standard_error: quantity.known.map(|known| known.standard_error),
        interval: quantity.known.map(|known| interval_to_message(known.interval)),
        free_share: quantity.known.map(|known| known.free_share),
    }
}

/// The uncertainty of a quantity must be given completely or not at all.
fn quantity_from_message(
    message: Option<&v1::Quantity>,
    field: &'static str,
) -> Result<DerivedQuantity, Malformed> {
    let message = present(message, field)?;
    let known = match (message.standard_error, &message.interval, message.free_share) {
        (None, None, None) => None,
        (standard_error, interval, free_share) => Some(Uncertainty {
            standard_error: present(standard_error, "standard_error")?,
            interval: interval_from_message(interval.as_ref())?,
            free_share: present(free_share, "free_share")?,
        }),
    };
    Ok(DerivedQuantity { value: present(message.value, "value")?, known })
}

fn profile_to_message(profile: &Profile) -> v1::Profile {
    v1::Profile {
        parameter: PARAMETER.number(profile.parameter),
        values: profile.values.clone(),
        costs: profile.costs.clone(),
    }
}

fn profile_from_message(message: &v1::Profile) -> Result<Profile, Malformed> {
    let (found, expected) = (message.costs.len(), message.values.len());
    if found != expected {
        return Err(Malformed::WrongLength { field: "costs", found, expected });
    }
    Ok(Profile {
        parameter: PARAMETER.required(message.parameter, "parameter")?,
        values: message.values.clone(),
        costs: message.costs.clone(),
    })
}

fn solutions_to_message(solutions: &Solutions) -> v1::Solutions {
    let Solutions { points, matching, spread } = solutions;
    let point = |one: &Solution| v1::Solution {
        start: one.start,
        point: Some(point_to_message(&one.point)),
        cost: Some(one.cost),
        evaluations: one.evaluations,
    };
    let parameters = spread.iter().flat_map(|spread| &spread.parameters);
    let parameters = parameters.map(|(parameter, spread)| v1::ParameterSpread {
        parameter: PARAMETER.number(*parameter),
        spread: Some(spread_to_message(spread)),
    });
    let entries = spread.iter().flat_map(|spread| &spread.entries);
    let entries = entries.map(|(row, column, spread)| v1::EntrySpread {
        row: entry_number(*row),
        column: entry_number(*column),
        spread: Some(spread_to_message(spread)),
    });
    v1::Solutions {
        points: points.iter().map(point).collect(),
        matching: *matching,
        parameters: parameters.collect(),
        mandel: entries.collect(),
    }
}

fn solutions_from_message(message: &v1::Solutions) -> Result<Solutions, Malformed> {
    let point = |one: &v1::Solution| {
        Ok(Solution {
            start: one.start,
            point: point_from_message(one.point.as_ref())?,
            cost: present(one.cost, "cost")?,
            evaluations: one.evaluations,
        })
    };
    let points = message.points.iter().map(point).collect::<Result<Vec<_>, Malformed>>()?;
    let spread = match (message.parameters.is_empty(), message.mandel.is_empty()) {
        (true, true) => None,
        _ => Some(spreads_from_message(message)?),
    };
    Ok(Solutions { points, matching: message.matching, spread })
}

fn spreads_from_message(message: &v1::Solutions) -> Result<Spreads, Malformed> {
    let spread = |one: &v1::ParameterSpread| {
        Ok((
            PARAMETER.required(one.parameter, "parameter")?,
            spread_from_message(one.spread.as_ref())?,
        ))
    };
    let parameters =
        message.parameters.iter().map(spread).collect::<Result<Vec<_>, Malformed>>()?;
    let names = parameters.iter().map(|(parameter, _)| *parameter);
    let is_complete = names.clone().take(BONE_PARAMETERS).eq(Parameter::OF_BONE);
    if !is_complete || !names.is_sorted_by(|one, next| one < next) {
        let (field, found) = ("parameters", parameters.len());
        return Err(Malformed::WrongLength { field, found, expected: BONE_PARAMETERS });
    }
    let entry = |one: &v1::EntrySpread| {
        let row = place(one.row, 1, "row")?;
        Ok((row, place(one.column, one.row, "column")?, spread_from_message(one.spread.as_ref())?))
    };
    let entries = message.mandel.iter().map(entry).collect::<Result<_, Malformed>>()?;
    Ok(Spreads { parameters, entries })
}

fn spread_to_message(spread: &Spread) -> v1::Spread {
    v1::Spread {
        smallest: Some(spread.smallest),
        largest: Some(spread.largest),
        mean: Some(spread.mean),
    }
}

fn spread_from_message(message: Option<&v1::Spread>) -> Result<Spread, Malformed> {
    let message = present(message, "spread")?;
    Ok(Spread {
        smallest: present(message.smallest, "smallest")?,
        largest: present(message.largest, "largest")?,
        mean: present(message.mean, "mean")?,
    })
}
