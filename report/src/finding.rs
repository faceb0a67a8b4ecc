//! What was found from one set of data: a whole job without groups, or one group of it.

use std::collections::BTreeMap;

use osteon_common::inference::MomentWeights;
use osteon_common::job::{JobSpecification, Objective, Range};
use osteon_common::moments::{MOMENTS, ObservableEstimates};
use osteon_common::outcome::FailureKind;
use osteon_common::parameters::Parameter;
use osteon_common::results::Status;
use osteon_files::report::{
    Data, EstimatedErrors, Group, Identification, Identified, MeanModel, ParameterProfile,
    PooledEstimate, PosteriorReport, Propagation, QuantityBudget, Solutions, Solver, Velocity,
};

use crate::figure_names;
use crate::input::{JobContext, ModelOutcomes};
use crate::sample::VelocitySample;

/// What was found from one set of data.
#[derive(Debug)]
pub(crate) struct Finding<'a> {
    /// Name of the group, if there are groups.
    pub(crate) group: Option<&'a str>,
    /// Number of the set of data, from 0.
    pub(crate) set: usize,
    /// Where its keys are in `result.json`, as the beginning of a JSON pointer.
    pub(crate) place: String,
    /// How the search ended; `None` of a propagation.
    pub(crate) status: Option<Status>,
    /// Why it ended so.
    pub(crate) reason: Option<&'a str>,
    /// Cost of the best point.
    pub(crate) cost: Option<f64>,
    pub(crate) parameters: &'a MeanModel,
    pub(crate) dispersion: Option<f64>,
    /// Moments of the model.
    pub(crate) velocity: &'a Velocity,
    /// Other observables of the model that were measured.
    pub(crate) observables: ObservableEstimates,
    pub(crate) data: Option<&'a Data>,
    /// Failed realizations by kind.
    pub(crate) failures: &'a BTreeMap<FailureKind, u64>,
    /// What the data determine.
    pub(crate) identified: Option<&'a Identified>,
    /// What makes the variance of each known quantity; empty where the job names no systematic error.
    pub(crate) budget: &'a [QuantityBudget],
    /// The profiles; empty where there are none.
    pub(crate) profiles: Option<&'a BTreeMap<Parameter, ParameterProfile>>,
    /// The solutions from several starts.
    pub(crate) solutions: Option<&'a Solutions>,
    pub(crate) posterior: Option<&'a PosteriorReport>,
    /// Values that were found with the help of other groups, if groups are pooled.
    pub(crate) pooled: Option<&'a BTreeMap<String, PooledEstimate>>,
    pub(crate) realizations: u64,
    /// First evaluation below the sampling noise.
    pub(crate) below_noise_from: Option<u64>,
    /// How the velocities were computed.
    pub(crate) solver: Option<&'a Solver<EstimatedErrors>>,
    /// The measured velocities.
    pub(crate) measured: Option<VelocitySample>,
    /// The velocities of the model, and its failures.
    pub(crate) model: ModelOutcomes,
    /// The job and its tables.
    pub(crate) context: &'a JobContext,
}

impl<'a> Finding<'a> {
    /// Returns the findings of an identification: one, or one for each group.
    pub(crate) fn from_identification(
        result: &'a Identification,
        context: &'a JobContext,
    ) -> Vec<Self> {
        let Some(groups) = &result.groups else {
            return vec![Self::from_whole(result, context)];
        };
        let finding = |(set, group)| Self::from_group(set, group, result, context);
        groups.iter().enumerate().map(finding).collect()
    }

    fn from_whole(result: &'a Identification, context: &'a JobContext) -> Self {
        Self {
            group: None,
            set: 0,
            place: String::new(),
            status: Some(result.status),
            reason: result.reason.as_deref(),
            cost: result.cost,
            parameters: &result.parameters,
            dispersion: result.dispersion,
            velocity: &result.velocity,
            observables: result.observables,
            data: result.data.as_ref(),
            failures: &result.failures,
            identified: result.identified(),
            budget: &result.budget,
            profiles: Some(&result.profiles),
            solutions: result.solutions.as_ref(),
            posterior: result.posterior(),
            pooled: None,
            realizations: result.realizations,
            below_noise_from: result.search.below_noise_from,
            solver: Some(&result.solver),
            measured: measured_sample(context, 0),
            model: model(context, None),
            context,
        }
    }

    fn from_group(
        set: usize,
        group: &'a Group,
        result: &'a Identification,
        context: &'a JobContext,
    ) -> Self {
        Self {
            group: Some(&group.name),
            set,
            place: format!("/groups/{set}"),
            status: Some(group.status),
            reason: group.reason.as_deref(),
            cost: group.cost,
            parameters: &group.parameters,
            dispersion: group.dispersion,
            velocity: &group.velocity,
            observables: group.observables,
            data: Some(&group.data),
            failures: &group.failures,
            identified: group.identified.as_ref(),
            budget: &group.budget,
            profiles: Some(&group.profiles),
            solutions: group.solutions.as_ref(),
            posterior: group.posterior.as_ref(),
            pooled: Some(&group.pooled),
            realizations: result.realizations,
            below_noise_from: None,
            solver: None,
            measured: measured_sample(context, set),
            model: model(context, Some(&group.name)),
            context,
        }
    }

    /// Returns the finding of a propagation.
    pub(crate) fn from_propagation(result: &'a Propagation, context: &'a JobContext) -> Self {
        Self {
            group: None,
            set: 0,
            place: String::new(),
            status: None,
            reason: None,
            cost: None,
            parameters: &result.parameters,
            dispersion: result.dispersion,
            velocity: &result.velocity,
            observables: ObservableEstimates::default(),
            data: None,
            failures: &result.failures,
            identified: None,
            budget: &[],
            profiles: None,
            solutions: None,
            posterior: None,
            pooled: None,
            realizations: result.realizations,
            below_noise_from: None,
            solver: Some(&result.solver),
            measured: None,
            model: model(context, None),
            context,
        }
    }

    pub(crate) fn specification(&self) -> &JobSpecification {
        &self.context.specification
    }

    /// Returns a parameter's range in the search of this set.
    pub(crate) fn range(&self, parameter: Parameter) -> Range {
        let ranges = self.specification().ranges_of(self.set);
        ranges.get(parameter as usize).copied().unwrap_or(Range::AS_IN_SETUP)
    }

    pub(crate) fn free_parameters(&self) -> Vec<Parameter> {
        let free = |parameter: &Parameter| matches!(self.range(*parameter), Range::Free { .. });
        Parameter::ALL.into_iter().filter(free).collect()
    }

    /// Returns the value of a parameter at the best point, and where it is in the result.
    pub(crate) fn value(&self, parameter: Parameter) -> (Option<f64>, String) {
        if parameter == Parameter::Dispersion {
            return (self.dispersion, format!("{}/dispersion", self.place));
        }
        let value = self.parameters.get(parameter);
        (value, format!("{}/parameters/{}", self.place, parameter.name()))
    }

    /// Number of failed realizations at the best point.
    pub(crate) fn failed_realizations(&self) -> u64 {
        self.failures.values().sum()
    }

    /// Returns the cost that sampling noise alone makes, as `search.below_noise_from` has it; `None` for
    /// a cost that does not depend on the moments alone.
    pub(crate) fn noise_level(&self) -> Option<f64> {
        let specification = self.specification();
        if !specification.objective.is_of_moments() || specification.has_priors() {
            return None;
        }
        let (moments, errors) = (&self.velocity.moments, &self.velocity.standard_error);
        let data = specification.data.as_ref();
        let means = data.map(|data| data.compared(self.set).observables).unwrap_or_default();
        let mut relative = [0.0; MOMENTS];
        relative[0] = errors.mean? / moments.mean?;
        relative[1] = errors.coefficient_of_variation? / moments.coefficient_of_variation?;
        for (observable, found) in self.observables.present() {
            relative[2 + observable as usize] = found.standard_error / means[observable]?;
        }
        let weights = data
            .filter(|_| specification.objective == Objective::ChiSquare)
            .and_then(|data| MomentWeights::of_data(data, self.set));
        let level = match weights {
            Some(weights) => weights.of_errors(relative),
            None => relative.iter().map(|error| error * error).sum(),
        };
        (level > 0.0).then_some(level)
    }

    /// Returns the beginning of the names of its figures.
    pub(crate) fn prefix(&self) -> String {
        figure_names::prefix(self.group, self.set)
    }

    /// Returns the end of the titles of its figures.
    pub(crate) fn suffix(&self) -> String {
        figure_names::suffix(self.group)
    }
}

fn measured_sample(context: &JobContext, set: usize) -> Option<VelocitySample> {
    let data = context.specification.data.as_ref()?;
    VelocitySample::new(data.velocities(set)?.to_vec())
}

fn model(context: &JobContext, group: Option<&str>) -> ModelOutcomes {
    context.realizations.as_ref().map(|all| all.outcomes_of_group(group)).unwrap_or_default()
}
