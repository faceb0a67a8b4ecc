//! Moments of each observable, and how each goes with the velocity.

use osteon_common::observables::{Observable, PerObservable};
use osteon_common::outcome::{FailureCounts, Outcome};
use osteon_common::settings::Extremum;

use super::observation::Observation;

/// Summary of the realizations at one point.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationSummary {
    /// The extremum whose velocity is the other one.
    pub other_extremum: Extremum,
    /// Number of realizations.
    pub realizations: u64,
    /// Realizations without a velocity.
    pub failures: FailureCounts,
    /// Velocity, m/s.
    pub velocity: ObservableMoments,
    /// The other observables, each in its unit.
    pub observables: PerObservable<ObservableMoments>,
}

/// One observable over the realizations that have it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservableMoments {
    /// Number of realizations that have it.
    pub count: u64,
    /// Mean; `None` if no realization has it.
    pub mean: Option<f64>,
    /// Standard deviation, the sum of squares divided by one less than the count; `None` of fewer
    /// than two.
    pub standard_deviation: Option<f64>,
    /// Coefficient of correlation with the velocity; `None` if one of both does not vary.
    pub correlation: Option<f64>,
}

impl ObservationSummary {
    pub(super) fn new(other_extremum: Extremum, rows: &[Observation]) -> Self {
        let outcomes: Vec<Outcome> = rows.iter().map(|row| row.outcome).collect();
        let column = |which: Option<Observable>| {
            let mut sums = Sums::default();
            for row in rows {
                if let (Some(velocity), Some(value)) = (row.value(None), row.value(which)) {
                    sums.add(velocity, value);
                }
            }
            sums.column()
        };
        Self {
            other_extremum,
            realizations: rows.len() as u64,
            failures: FailureCounts::from_outcomes(&outcomes),
            velocity: column(None),
            observables: PerObservable::new(|one| column(Some(one))),
        }
    }

    /// Returns whether any realization has a velocity.
    pub fn has_velocity(&self) -> bool {
        self.velocity.count > 0
    }
}

/// Running means and sums of products about them (Welford, Technometrics 4, 1962), in index order.
#[derive(Debug, Default)]
struct Sums {
    count: u64,
    /// Means of the velocity and of the observable.
    means: [f64; 2],
    /// Sums of squared deviations of both.
    squares: [f64; 2],
    /// Sum of the products of their deviations.
    products: f64,
}

impl Sums {
    fn add(&mut self, velocity: f64, value: f64) {
        self.count += 1;
        let values = [velocity, value];
        let before = [0, 1].map(|i| values[i] - self.means[i]);
        for i in 0..2 {
            self.means[i] += before[i] / self.count as f64;
            self.squares[i] += before[i] * (values[i] - self.means[i]);
        }
        self.products += before[0] * (value - self.means[1]);
    }

    fn column(&self) -> ObservableMoments {
        let spread = (self.squares[0] * self.squares[1]).sqrt();
        ObservableMoments {
            count: self.count,
            mean: (self.count > 0).then_some(self.means[1]),
            standard_deviation: (self.count > 1)
                .then(|| (self.squares[1] / (self.count - 1) as f64).sqrt()),
            correlation: (spread > 0.0).then(|| (self.products / spread).clamp(-1.0, 1.0)),
        }
    }
}
