//! What each model computes.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use osteon_common::job::{JobKind, JobSpecification, Range};
use osteon_common::moments::Moments;
use osteon_common::outcomes::Outcomes;
use osteon_common::parameters::Point;
use osteon_search::{PosteriorDensity, Search};
use osteon_solver::Isa;
use tokio::sync::OnceCell;

use super::deterministic::CaseSolver;
use super::evaluator::{Evaluator, PointResult, counted};
use super::input_space::{InputScale, InputSpace};
use super::model::ServedModel;
use super::protocol_error::{ProtocolError, quoted};
use super::request_config::RequestConfig;

/// Logarithm of the density outside of the posterior's domain: finite, as JSON has no infinity and an
/// error would end a sampler; far below any other.
const FLOOR: f64 = -1e300;
/// Maximum number of densities that are kept; each needs the evaluation of one point.
const DENSITIES_MAX: usize = 64;

/// A density for a set of data, a seed and a number of realizations.
type KeptDensity = Arc<OnceCell<PosteriorDensity>>;

/// A job whose models are served.
#[derive(Debug)]
pub struct ServedJob {
    specification: Arc<JobSpecification>,
    evaluator: Evaluator,
    cases: CaseSolver,
    /// The search of the job, for the cost of points; `None` without data, and with groups or other
    /// observables.
    search: Option<Search>,
    has_posterior: bool,
    densities: Mutex<BTreeMap<(usize, u64, u64), KeptDensity>>,
}

/// The value of a model, with what else is known of it.
#[derive(Debug, Clone, Default)]
pub(super) struct ModelValue {
    /// The output vector.
    pub(super) output: Vec<f64>,
    /// Names and values of headers.
    pub(super) notes: Vec<(&'static str, String)>,
}

impl ServedJob {
    /// Creates the models of a job.
    pub fn new(specification: JobSpecification, evaluator: Evaluator, isa: Isa) -> Self {
        let specification = Arc::new(specification);
        let data = specification.data.as_ref();
        let velocities_only = specification.observables().is_empty();
        let has_cost = data.is_some_and(|data| !data.is_grouped() && velocities_only);
        let search = (has_cost && specification.is_searched())
            .then(|| Search::new(Arc::clone(&specification)));
        let mut sets = 0..data.map_or(0, |data| data.sets());
        let has_posterior = specification.kind == JobKind::Identification
            && specification.free().next().is_some()
            && velocities_only
            && sets.any(|set| PosteriorDensity::new(&specification, set).is_some());
        let cases = CaseSolver::new(isa);
        let densities = Mutex::default();
        Self { specification, evaluator, cases, search, has_posterior, densities }
    }

    /// Returns the names of the models.
    pub fn models(&self) -> Vec<&'static str> {
        ServedModel::offered(&self.specification, self.has_posterior)
            .map(ServedModel::name)
            .collect()
    }

    /// Returns the model of this name.
    pub(super) fn model(&self, name: &str) -> Result<ServedModel, ProtocolError> {
        ServedModel::named(name, &self.specification, self.has_posterior)
    }

    /// Returns the length of a model's input.
    pub(super) fn inputs(&self, model: ServedModel) -> usize {
        model.parameters(&self.specification).len()
    }

    /// Returns the space of a request's input.
    pub(super) fn space(
        &self,
        model: ServedModel,
        config: &RequestConfig,
    ) -> Result<InputSpace<'_>, ProtocolError> {
        let scale = match model {
            ServedModel::ForwardSi => InputScale::Si,
            _ => config.inputs.unwrap_or(InputScale::Multiples),
        };
        let parameters = model.parameters(&self.specification);
        let base = match model {
            ServedModel::Posterior => self.specification.start_of(self.set(config)?),
            _ => self.specification.start(),
        };
        Ok(InputSpace::new(&self.specification, base, parameters, scale))
    }

    /// Returns the value of a model at an input; that of the posterior is the floor where it has none.
    pub(super) async fn value(
        &self,
        model: ServedModel,
        config: &RequestConfig,
        input: &[f64],
    ) -> Result<ModelValue, ProtocolError> {
        match self.value_within(model, config, input).await {
            Err(error) if error.no_value && model == ServedModel::Posterior => {
                Ok(ModelValue { output: vec![FLOOR], notes: Vec::new() })
            }
            found => found,
        }
    }

    /// Returns the value of a model at an input.
    ///
    /// # Errors
    /// If it has none: [`ProtocolError::no_value`]; or if it cannot be computed.
    pub(super) async fn value_within(
        &self,
        model: ServedModel,
        config: &RequestConfig,
        input: &[f64],
    ) -> Result<ModelValue, ProtocolError> {
        let space = self.space(model, config)?;
        let point = space.point(input);
        match model {
            ServedModel::Forward | ServedModel::ForwardSi => {
                let result = self.evaluated(&space, &point, config).await?;
                let Moments { mean, coefficient_of_variation } = result.velocity.moments;
                let output = vec![mean, coefficient_of_variation];
                Ok(ModelValue { output, notes: self.notes(&point, result) })
            }
            ServedModel::Velocity => {
                space.propagation(&point, (None, None))?;
                let velocity = self.cases.velocity(&point, &self.specification.setup).await?;
                Ok(ModelValue { output: vec![velocity], notes: Vec::new() })
            }
            ServedModel::Posterior => {
                space.check_units(input)?;
                let density = self.density(&space, config).await?;
                let outside = || {
                    ProtocolError::input("the input is outside the bounds of the job")
                        .without_value()
                };
                density.log_prior(&point).ok_or_else(outside)?;
                let result = self.evaluated(&space, &point, config).await?;
                let log = density.log_density(&point, &result.velocity.moments.into());
                let output = vec![log.ok_or_else(outside)?];
                Ok(ModelValue { output, notes: self.notes(&point, result) })
            }
        }
    }

    async fn evaluated(
        &self,
        space: &InputSpace<'_>,
        point: &Point,
        config: &RequestConfig,
    ) -> Result<PointResult, ProtocolError> {
        let job = space.propagation(point, (config.seed, config.realizations))?;
        self.evaluator.evaluate(&job).await
    }

    /// Returns the density for the data that a request means, whose likelihood is averaged over the
    /// model's sampling errors at the job's own values. These are evaluated at the first request.
    async fn density(
        &self,
        space: &InputSpace<'_>,
        config: &RequestConfig,
    ) -> Result<PosteriorDensity, ProtocolError> {
        let set = self.set(config)?;
        let settings = self.specification.monte_carlo;
        let seed = config.seed.unwrap_or(settings.seed);
        let realizations = config.realizations.unwrap_or(settings.realizations);
        let kept = self.kept((set, seed, realizations));
        let density = kept.get_or_try_init(|| async {
            if !self.specification.systematic.is_empty() {
                return Err(ProtocolError::input(
                    "the posterior by UM-Bridge takes the setup as exactly known; leave [systematic] out of the job",
                ));
            }
            let density = PosteriorDensity::new(&self.specification, set).ok_or_else(|| {
                ProtocolError::input("these data have no likelihood: their noise is not known")
            })?;
            let start = self.specification.start_of(set);
            let found = self.evaluated(space, &start, config).await;
            let errors = found.map(|result| result.velocity.relative_errors());
            match errors {
                Ok(errors) if errors.iter().all(|error| error.is_finite()) => {
                    Ok(density.with_model_errors(errors))
                }
                Ok(_) => Err(ProtocolError::input(
                    "the sampling error of the model is unknown; the posterior needs at least two \
                     realizations",
                )),
                Err(error) => Err(ProtocolError {
                    message: format!(
                        "the model cannot be evaluated at the job's own values, whose sampling \
                         error the posterior needs: {}",
                        error.message
                    ),
                    no_value: false,
                    ..error
                }),
            }
        });
        density.await.cloned()
    }

    fn kept(&self, key: (usize, u64, u64)) -> KeptDensity {
        let mut densities = self.densities.lock().unwrap_or_else(PoisonError::into_inner);
        if densities.len() >= DENSITIES_MAX && !densities.contains_key(&key) {
            densities.clear();
        }
        Arc::clone(densities.entry(key).or_default())
    }

    /// Returns the number of the set of data that a request means.
    fn set(&self, config: &RequestConfig) -> Result<usize, ProtocolError> {
        let data = self.specification.data.as_ref();
        let names: Vec<&str> = data.into_iter().flat_map(|data| data.names()).collect();
        match &config.group {
            None if names.len() > 1 => Err(ProtocolError::input(format!(
                "config.group is missing; the data have the groups {}",
                names.join(", ")
            ))),
            None => Ok(0),
            Some(group) => names.iter().position(|name| name == group).ok_or_else(|| {
                let group = quoted(group);
                let message = match names.is_empty() {
                    true => format!("config.group is {group}, but the data have no groups"),
                    false => format!(
                        "config.group is {group}; the data have the groups {}",
                        names.join(", ")
                    ),
                };
                ProtocolError::input(message)
            }),
        }
    }

    /// Returns what headers say of an evaluation.
    fn notes(&self, point: &Point, result: PointResult) -> Vec<(&'static str, String)> {
        let errors = result.velocity.standard_error;
        let mut notes = vec![
            ("osteon-digest", result.digest),
            ("osteon-realizations", result.outcomes.len().to_string()),
            ("osteon-failures", counted(&result.failures)),
            (
                "osteon-standard-errors",
                format!("{:?}, {:?}", errors.mean, errors.coefficient_of_variation),
            ),
        ];
        let within = |parameter| match self.specification.range(parameter) {
            Range::Free { .. } => true,
            Range::Fixed(value) => point.get(parameter) == value,
        };
        // The cost is a function of the free parameters.
        if let Some(search) = &self.search
            && self.specification.parameters_ranged().all(within)
            && let Some(cost) = search.assess(point, &Outcomes::from(result.outcomes)).cost
        {
            notes.push(("osteon-cost", format!("{cost:?}")));
        }
        notes
    }
}
