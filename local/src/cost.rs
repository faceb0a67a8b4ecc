//! Estimates how long a job will take on this machine, before it is run.
//!
//! A few realizations are computed at the start and at points all over the box. Their times never
//! reach a job or a result.

mod measurement;
mod places;

use osteon_common::job::JobSpecification;
use osteon_search::ExpectedEvaluations;
use osteon_solver::Isa;

pub use self::measurement::{Effort, PlaceCost};

/// The estimated cost of a job.
#[derive(Debug, Clone, PartialEq)]
pub struct JobCost {
    /// Realizations at the start; `None` if not even one ended in time.
    pub start: Option<PlaceCost>,
    /// Those at points of the box; empty if no parameter is free.
    pub places: Vec<PlaceCost>,
    /// Number of points of the box at which none ended in time.
    pub unmeasured: usize,
    /// Longest time that was measured for, s.
    pub limit_s: f64,
    /// Number of evaluations that such a job usually takes.
    pub expected: ExpectedEvaluations,
    /// Number of realizations of each evaluation.
    pub realizations: u64,
    /// Number of threads on which the job would run.
    pub cores: u32,
}

impl JobCost {
    /// Estimates the cost of a job on this many cores.
    pub async fn measure(
        specification: &JobSpecification,
        isa: Isa,
        effort: Effort,
        cores: u32,
    ) -> Self {
        let points = places::points(specification, effort.points);
        let measured = measurement::measure(specification, isa, effort, points).await;
        let mut places = measured.into_iter();
        let start = places.next().flatten();
        let (places, unmeasured) = places.fold((Vec::new(), 0), |(mut found, missing), place| {
            let missing = missing + usize::from(place.is_none());
            found.extend(place);
            (found, missing)
        });
        Self {
            start,
            places,
            unmeasured,
            limit_s: effort.limit.as_secs_f64(),
            expected: ExpectedEvaluations::from_specification(specification),
            realizations: specification.monte_carlo.realizations,
            cores,
        }
    }

    /// Returns the median over the points of the box, s.
    pub fn median_s(&self) -> Option<f64> {
        measurement::median(self.places.iter().map(|place| place.mean_s))
    }

    /// Returns the point of the box whose realizations take longest.
    pub fn worst(&self) -> Option<&PlaceCost> {
        self.places.iter().max_by(|one, other| one.mean_s.total_cmp(&other.mean_s))
    }

    /// Returns the range of processor time, s; `None` if nothing was measured.
    ///
    /// A search leaves the start for points that are nearer to the middle of the box than most of it is:
    /// most of a box of seven dimensions is corners, whose bones take several times as long as usual. The
    /// range is from few evaluations like those at the start, or in the box if they are cheaper there, to
    /// many between these two, in the geometric mean, or like those at the start.
    pub fn processor_s(&self) -> Option<[f64; 2]> {
        let start = self.start.as_ref()?.mean_s;
        let median = self.median_s().unwrap_or(start);
        let evaluation = |realization_s: f64| realization_s * self.realizations as f64;
        Some([
            evaluation(start.min(median)) * self.expected.fewest as f64,
            evaluation(start.max((start * median).sqrt())) * self.expected.most as f64,
        ])
    }

    /// Returns the range of wall time, s. More cores than realizations do not help.
    pub fn wall_s(&self) -> Option<[f64; 2]> {
        let rounds = self.realizations.div_ceil(u64::from(self.cores.max(1)));
        let share = rounds as f64 / self.realizations.max(1) as f64;
        Some(self.processor_s()?.map(|seconds| seconds * share))
    }
}

#[cfg(test)]
mod tests;
