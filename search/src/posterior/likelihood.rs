//! The likelihood of one set of data as a function of the compared moments of a model.

use osteon_common::data_likelihood::DataLikelihood;
use osteon_common::inference::{ModelAtPoint, MomentWeights, systematic_covariance};
use osteon_common::job::{JobSpecification, Measurements};
use osteon_common::moments::{ComparedMoments, MOMENTS, MomentVector, Moments};
use osteon_common::observables::ObservableSet;
use osteon_common::results::Evaluation;

/// The likelihood of the velocities, times that of the means of the other observables given the
/// velocities.
///
/// The latter are averages, so their law is close to normal; that its covariance is estimated from the
/// same data makes it Student's (A. Gelman et al., Bayesian Data Analysis (2013), Sec. 3.6): with χ² the
/// square of the difference in its standard errors, and n independent parts of the data, the logarithm is
/// -n/2 ln(1 + χ²/(n - 1)).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SetLikelihood {
    pub(super) velocities: DataLikelihood,
    observables: Option<MeasuredMeans>,
    /// The data's moments, to which the model's are relative.
    pub(super) data: ComparedMoments,
}

/// What is known of the means of the observables.
#[derive(Debug, Clone, PartialEq)]
struct MeasuredMeans {
    weights: MomentWeights,
    /// The data's moments in the coordinates of the model's.
    data: MomentVector,
    /// Number of independent parts of the data.
    parts: f64,
}

impl SetLikelihood {
    /// Creates the likelihood of set number `set` of the data; `None` if their noise is unknown.
    pub(crate) fn new(specification: &JobSpecification, set: usize) -> Option<Self> {
        let data = specification.data.as_ref()?;
        let compared = data.compared(set);
        let observables = match data.observables().is_empty() {
            true => None,
            false => Some(MeasuredMeans {
                weights: MomentWeights::of_data(data, set)?,
                data: compared.in_logarithms(&compared),
                parts: data.set(set)?.independent_count() as f64,
            }),
        };
        let velocities = of_velocities(specification, set)?;
        Some(Self { velocities, observables, data: compared })
    }

    /// Returns the likelihood of a model whose setup is not known exactly: its average over the errors of the
    /// velocities' moments that the evaluations of `shifted` setups show, to first order about `best`. `None` if
    /// one was not measured. Jobs with a posterior have systematic errors only without other observables.
    pub(crate) fn with_systematic(
        self,
        specification: &JobSpecification,
        set: usize,
        best: ModelAtPoint<'_>,
        shifted: &[Evaluation],
    ) -> Option<Self> {
        let covariance = systematic_covariance(specification, set, best, shifted)?;
        let [[mean, both, ..], [_, variation, ..], ..] = covariance;
        if mean == 0.0 && variation == 0.0 {
            return Some(self);
        }
        let velocities = self.velocities.with_systematic([[mean, both], [both, variation]]);
        Some(Self { velocities, ..self })
    }

    /// Returns the likelihood of a model whose moments have these relative standard errors, which are the
    /// same at every point, as common germs make them: its average over normal errors.
    #[must_use]
    pub(super) fn with_model_errors(self, errors: MomentVector) -> Self {
        let [mean, variation, ..] = errors;
        let observables = self.observables.map(|observed| MeasuredMeans {
            weights: observed.weights.with_errors_of_observables(&errors),
            ..observed
        });
        let velocities = self.velocities.with_model_errors([mean, variation]);
        Self { velocities, observables, ..self }
    }

    /// Returns the logarithm of the likelihood of a model with these moments, as
    /// [`ComparedMoments::in_logarithms`] of the data, up to a constant, nats.
    pub(super) fn log(&self, values: &MomentVector) -> f64 {
        let of_observables = self.observables.as_ref().map_or(0.0, |observed| {
            let differences: MomentVector = std::array::from_fn(|k| values[k] - observed.data[k]);
            let square = observed.weights.square_given_velocities(differences);
            -0.5 * observed.parts * libm::log1p(square / (observed.parts - 1.0))
        });
        self.velocities.log([values[0], values[1]]) + of_observables
    }

    /// Returns the observables that were measured.
    pub(super) fn observables(&self) -> ObservableSet {
        self.data.observables.which()
    }

    /// Returns rough standard errors of the data's moments with those of the setup, of the observables given the
    /// velocities, as a measure of misfit; infinite of an observable that was not measured.
    pub(super) fn errors(&self) -> MomentVector {
        let mut errors = [f64::INFINITY; MOMENTS];
        let own = errors.iter_mut().zip(self.velocities.errors());
        for ((error, own), systematic) in own.zip(self.velocities.systematic_errors()) {
            *error =
                if systematic == 0.0 { own } else { (own * own + systematic * systematic).sqrt() };
        }
        for (axis, error) in errors.iter_mut().enumerate().skip(2) {
            let mut one = [0.0; MOMENTS];
            one[axis] = 1.0;
            let observed = self.observables.as_ref();
            let weight = observed.map_or(0.0, |observed| observed.weights.square(one));
            *error = 1.0 / weight.sqrt();
        }
        errors
    }
}

fn of_velocities(specification: &JobSpecification, set: usize) -> Option<DataLikelihood> {
    let data = specification.data.as_ref()?;
    let instrument = data.repeatability;
    match (&data.measurements, data.velocities(set), data.subjects(set)) {
        (&Measurements::Moments { mean, coefficient_of_variation, count }, ..) => {
            let moments = Moments { mean, coefficient_of_variation };
            DataLikelihood::from_moments(moments, count?, instrument)
        }
        (_, Some(velocities), Some(subjects)) => {
            DataLikelihood::of_subjects(velocities, subjects, instrument)
        }
        (_, Some(velocities), None) => DataLikelihood::independent(velocities, instrument),
        (_, None, _) => None,
    }
}
