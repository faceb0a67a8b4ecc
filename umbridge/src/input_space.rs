//! From the numbers of a request to a point of the job, and to the job of that point.

use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{JobKind, JobSpecification, Objective, Range, Search};
use osteon_common::parameters::{AS_IN_SETUP, Parameter, Point};
use osteon_common::systematic::Systematic;
use osteon_common::violations::Violations;

use super::protocol_error::ProtocolError;

/// Multiples and positions between bounds that no point of a job's domain has.
const FARTHEST: f64 = 1000.0;
/// Values in SI units are of the job if they are within this factor of its own.
const CLOSE: f64 = 10.0;

/// What the entries of an input are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum InputScale {
    /// Multiples of the job's values: its fixed and start values.
    Multiples,
    /// Values in SI units.
    Si,
    /// Positions between the bounds: 0 is the lower one, 1 the upper.
    Bounds,
}

impl InputScale {
    /// All scales.
    pub(super) const ALL: [Self; 3] = [Self::Multiples, Self::Si, Self::Bounds];

    /// Returns the name in requests.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Multiples => "multiples",
            Self::Si => "si",
            Self::Bounds => "bounds",
        }
    }
}

/// The inputs of a model: what they stand for, around which point of the job.
#[derive(Debug, Clone)]
pub(super) struct InputSpace<'a> {
    specification: &'a JobSpecification,
    base: Point,
    parameters: Vec<Parameter>,
    scale: InputScale,
}

impl<'a> InputSpace<'a> {
    /// Creates the space in which `parameters` are varied, and all others are as in `base`.
    pub(super) fn new(
        specification: &'a JobSpecification,
        base: Point,
        parameters: Vec<Parameter>,
        scale: InputScale,
    ) -> Self {
        Self { specification, base, parameters, scale }
    }

    /// Returns the point that an input stands for.
    pub(super) fn point(&self, input: &[f64]) -> Point {
        let mut point = self.base;
        for (&parameter, &given) in self.parameters.iter().zip(input) {
            let value = &mut point.0[parameter as usize];
            *value = match (self.scale, self.specification.range(parameter)) {
                (InputScale::Bounds, Range::Free { lower, upper, .. }) => {
                    lower + given * (upper - lower)
                }
                (InputScale::Multiples, _) => given * *value,
                (InputScale::Si | InputScale::Bounds, _) => given,
            };
        }
        point
    }

    /// Refuses an input that is in SI units where it should be multiples, or positions between the bounds: that is no
    /// point outside of the domain, which a sampler may ask for, but a mistake.
    ///
    /// # Errors
    /// If an entry is farther from the job than any, and all are close to it as values in SI units.
    pub(super) fn check_units(&self, input: &[f64]) -> Result<(), ProtocolError> {
        let is_far = |given: &f64| given.abs() > FARTHEST;
        let is_close = |(&parameter, &given): (&Parameter, &f64)| {
            (1.0 / CLOSE..CLOSE).contains(&(given / self.base.get(parameter)))
        };
        let are_close = self.parameters.iter().zip(input).all(is_close);
        if self.scale == InputScale::Si || !input.iter().any(is_far) || !are_close {
            return Ok(());
        }
        let scale = self.scale.name();
        Err(ProtocolError::input(format!(
            "the input is in SI units, and {scale} are meant; give {scale}, or say config.inputs = \"si\""
        )))
    }

    /// Returns the size of each entry of the input, to which steps of differences are relative.
    pub(super) fn sizes(&self, input: &[f64]) -> Vec<f64> {
        let size = |(&parameter, &given): (&Parameter, &f64)| match self.scale {
            InputScale::Bounds => 1.0,
            InputScale::Multiples | InputScale::Si => {
                let base = match self.scale {
                    InputScale::Si => self.base.get(parameter).abs(),
                    InputScale::Multiples | InputScale::Bounds => 1.0,
                };
                let size = given.abs().max(1e-3 * base);
                if size > 0.0 { size } else { 1.0 }
            }
        };
        self.parameters.iter().zip(input).map(size).collect()
    }

    /// Returns the job that evaluates the model at a point, as `propagate` does.
    ///
    /// # Errors
    /// If the model is not defined there: all reasons, named by the entries of the request.
    pub(super) fn propagation(
        &self,
        point: &Point,
        (seed, realizations): (Option<u64>, Option<u64>),
    ) -> Result<JobSpecification, ProtocolError> {
        let mut monte_carlo = self.specification.monte_carlo;
        monte_carlo.seed = seed.unwrap_or(monte_carlo.seed);
        monte_carlo.realizations = realizations.unwrap_or(monte_carlo.realizations);
        let (mut setup, mut parameters) =
            (self.specification.setup.clone(), self.specification.parameters);
        for parameter in Parameter::ALL {
            let value = point.get(parameter);
            let range = &mut parameters[parameter as usize];
            *range = match (parameter.of_setup(), *range) {
                (None, _) => Range::Fixed(value),
                (Some(_), Range::Free { lower, upper, .. }) => {
                    Range::Free { start: value, lower, upper }
                }
                // Known of the group whose data are meant, or as in the setup.
                (Some(quantity), Range::Fixed(_)) => {
                    if value != AS_IN_SETUP {
                        setup = quantity.with(value, setup);
                    }
                    Range::AS_IN_SETUP
                }
            };
        }
        let job = JobSpecification {
            kind: JobKind::Propagation,
            setup,
            data: None,
            parameters,
            random: self.specification.random,
            systematic: Systematic::default(),
            groups: GroupSettings::default(),
            monte_carlo,
            objective: Objective::Moments,
            search: Search::default(),
            posterior: None,
        };
        let violations = job.check();
        match violations.is_empty() {
            true => Ok(job),
            false => Err(self.refusal(violations)),
        }
    }

    /// Returns the error for violations of the rules of jobs. The model has no value at the input, unless
    /// a value of `config` is wrong.
    fn refusal(&self, violations: Violations) -> ProtocolError {
        let of_config = violations.has_at_or_below("monte_carlo");
        let error = ProtocolError::violations(&violations.with_fields(|field| self.name(field)));
        if of_config { error } else { error.without_value() }
    }

    /// Returns the name of a job's field in a request.
    fn name(&self, field: &str) -> String {
        if let Some(key) = field.strip_prefix("monte_carlo.") {
            return format!("config.{key}");
        }
        let Some(rest) = field.strip_prefix("parameters") else { return field.to_owned() };
        let name = rest.trim_start_matches('.').split('.').next().unwrap_or_default();
        match self.parameters.iter().position(|parameter| parameter.name() == name) {
            Some(k) => format!("input[0][{k}] ({name})"),
            None => "input[0]".to_owned(),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use osteon_common::case::Setup;
    use osteon_common::job::MonteCarlo;
    use osteon_common::random_quantities::RandomQuantities;
    use osteon_common::systematic::Systematic;

    use super::*;

    const OPTIMUM: [f64; 7] = [1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029];

    pub(crate) fn job() -> JobSpecification {
        let mut parameters = Range::of_bone(OPTIMUM.map(Range::Fixed));
        parameters[6] = Range::Free { start: 0.1, lower: 0.02, upper: 0.3 };
        JobSpecification {
            kind: JobKind::Propagation,
            setup: Setup::default(),
            data: None,
            parameters,
            random: RandomQuantities::default(),
            systematic: Systematic::default(),
            groups: GroupSettings::default(),
            monte_carlo: MonteCarlo::default(),
            objective: Objective::Moments,
            search: Search::default(),
            posterior: None,
        }
    }

    fn space(job: &JobSpecification, scale: InputScale) -> InputSpace<'_> {
        InputSpace::new(job, job.start(), job.parameters_ranged().collect(), scale)
    }

    #[test]
    fn all_ones_are_the_job_to_the_bit() {
        let job = job();
        let space = space(&job, InputScale::Multiples);
        let point = space.point(&[1.0; 7]);
        assert_eq!(point, job.start());
        assert_eq!(space.propagation(&point, (None, None)).unwrap().start(), job.start());
        assert_eq!(
            space.point(&[1.0, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0]).get(Parameter::ALL[1]),
            35.434e9
        );
    }

    #[test]
    fn bounds_and_units_are_scales_of_their_own() {
        let job = job();
        let of = |scale| InputSpace::new(&job, job.start(), vec![Parameter::Dispersion], scale);
        assert_eq!(of(InputScale::Si).point(&[0.05]).dispersion(), 0.05);
        assert_eq!(of(InputScale::Bounds).point(&[0.0]).dispersion(), 0.02);
        assert!((of(InputScale::Bounds).point(&[0.5]).dispersion() - 0.16).abs() < 1e-15);
        assert_eq!(of(InputScale::Bounds).sizes(&[0.0]), [1.0]);
        assert_eq!(of(InputScale::Si).sizes(&[0.05]), [0.05]);
        assert_eq!(of(InputScale::Si).sizes(&[0.0]), [0.1 * 1e-3]);
    }

    #[test]
    fn values_in_si_units_are_told_from_points_outside() {
        let job = job();
        let base = job.start();
        let check = |scale, input: &[f64; 2], expected: bool| {
            let parameters = vec![Parameter::ALL[1], Parameter::Dispersion];
            let space = InputSpace::new(&job, base, parameters, scale);
            assert_eq!(space.check_units(input).is_err(), expected, "{scale:?} {input:?}");
        };
        check(InputScale::Multiples, &[17.0e9, 0.1], true);
        check(InputScale::Bounds, &[17.0e9, 0.1], true);
        check(InputScale::Si, &[17.0e9, 0.1], false);
        check(InputScale::Multiples, &[1.0, 1.0], false);
        check(InputScale::Multiples, &[1.0, 0.1], false);
        check(InputScale::Multiples, &[5.0, -3.0], false);
        check(InputScale::Multiples, &[1e30, 1.0], false);
    }

    #[test]
    fn refusals_name_entries_of_the_request() {
        let job = job();
        let space = space(&job, InputScale::Multiples);
        let refused = |k: usize, value: f64, config| {
            let mut input = [1.0; 7];
            input[k] = value;
            space.propagation(&space.point(&input), config).unwrap_err()
        };
        for (k, value, expected) in [
            (6, 9.0, "input[0][6] (dispersion): is 0.9"),
            (0, -1.0, "input[0][0] (density): is -1598.8"),
            (2, 2.0, "input[0]: the point of starts and fixed values is not admissible"),
        ] {
            let error = refused(k, value, (None, None));
            assert!(error.message.contains(expected), "{error:?}");
            assert!(error.no_value);
        }
        let error = refused(0, 1.0, (None, Some(0)));
        assert!(error.message.starts_with("config.realizations: is 0"), "{error:?}");
        assert!(!error.no_value);
    }
}
