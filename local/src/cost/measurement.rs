//! Times of single realizations.

use std::time::{Duration, Instant};

use osteon_common::job::JobSpecification;
use osteon_common::parameters::Point;
use osteon_common::realization::Ensemble;
use osteon_solver::{Isa, Solver, Workspace};
use tokio::sync::mpsc;

/// A realization that takes this long, s, is not computed a second time.
const ONCE_S: f64 = 0.02;
/// Realizations at the start for each one at a point of the box: few realizations take much longer than
/// the others, and where a search begins their share matters most.
const START_SHARE: u64 = 4;
/// Most realizations of which the times are kept, whatever the effort.
const SAMPLES_MAX: usize = 1024;

/// How much is computed for an estimate.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Number of realizations at the start before any other.
    pub(super) first: u64,
    /// Number of points of the box.
    pub(super) points: usize,
    /// Number of realizations at each point; at the start [`START_SHARE`] times as many.
    pub(super) rounds: u64,
    /// Longest wall time.
    pub(super) limit: Duration,
}

impl Effort {
    /// What a user waits for: some tenths of a second for usual jobs.
    pub const THOROUGH: Self =
        Self { first: 16, points: 13, rounds: 8, limit: Duration::from_millis(2000) };
    /// What is not noticed before a run: a few ms.
    pub const BRIEF: Self =
        Self { first: 6, points: 0, rounds: 0, limit: Duration::from_millis(500) };
}

/// Times of the realizations of one point.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaceCost {
    /// The point.
    pub point: Point,
    /// Mean time of a realization, s.
    pub mean_s: f64,
    /// Median time, s.
    pub median_s: f64,
    /// Number of realizations measured, at least one.
    pub measured: usize,
    /// Number of them that failed.
    pub failed: usize,
}

/// The time of one realization.
#[derive(Debug, Clone, Copy)]
struct TimedRealization {
    /// Number of its point.
    place: usize,
    seconds: f64,
    failed: bool,
}

/// Measures realizations at `points`, the first of which is the start, and returns their times; `None`
/// for points at which none ended in time.
pub(super) async fn measure(
    specification: &JobSpecification,
    isa: Isa,
    effort: Effort,
    points: Vec<Point>,
) -> Vec<Option<PlaceCost>> {
    let end = tokio::time::Instant::now() + effort.limit;
    let (sender, mut received) = mpsc::channel(SAMPLES_MAX);
    let specification = specification.clone();
    let places = points.clone();
    // On another thread, because a single realization may take longer than the limit. It then ends with
    // that realization, or with this process.
    tokio::task::spawn_blocking(move || compute(&specification, isa, effort, &places, &sender));
    let mut samples: Vec<TimedRealization> = Vec::new();
    while let Ok(Some(sample)) = tokio::time::timeout_at(end, received.recv()).await {
        samples.push(sample);
    }
    let of_place = |(place, point): (usize, Point)| {
        PlaceCost::from_samples(point, samples.iter().filter(|sample| sample.place == place))
    };
    points.into_iter().enumerate().map(of_place).collect()
}

/// Computes realizations, those at the start first, until all are done or nobody waits for them.
fn compute(
    specification: &JobSpecification,
    isa: Isa,
    effort: Effort,
    points: &[Point],
    sender: &mpsc::Sender<TimedRealization>,
) {
    let setup = &specification.setup;
    let Some(start) = points.first() else { return };
    let ensembles: Vec<Option<Ensemble>> =
        points.iter().map(|point| specification.ensemble(point).ok()).collect();
    let mut solver = Solver::with_isa(&start.setup(setup), isa);
    let mut workspace = Workspace::default();
    let Effort { first, rounds, .. } = effort;
    let at_start = (0..first).map(|index| (0, index));
    let everywhere = (0..rounds).flat_map(|round| {
        let more = first + START_SHARE * round..first + START_SHARE * (round + 1);
        let at_start = more.map(|index| (0, index));
        at_start.chain((1..points.len()).map(move |place| (place, round)))
    });
    for (place, index) in at_start.chain(everywhere) {
        let Some(ensemble) = &ensembles[place] else { continue };
        if index >= specification.monte_carlo.realizations {
            continue;
        }
        solver.change_setup(&points[place].setup(setup));
        let mut solve = || {
            let begun = Instant::now();
            let solved = solver.realization(ensemble, index, &mut workspace);
            (begun.elapsed().as_secs_f64(), solved.outcome.is_err())
        };
        let (mut seconds, failed) = solve();
        // The first time includes tables that all realizations share.
        if seconds < ONCE_S {
            seconds = seconds.min(solve().0);
        }
        if sender.blocking_send(TimedRealization { place, seconds, failed }).is_err() {
            return;
        }
    }
}

impl PlaceCost {
    fn from_samples<'a>(
        point: Point,
        samples: impl Iterator<Item = &'a TimedRealization> + Clone,
    ) -> Option<Self> {
        let measured = samples.clone().count();
        let seconds = samples.clone().map(|sample| sample.seconds);
        Some(Self {
            point,
            mean_s: seconds.clone().sum::<f64>() / measured as f64,
            median_s: median(seconds)?,
            measured,
            failed: samples.filter(|sample| sample.failed).count(),
        })
    }
}

/// Returns the median, the larger of the middle two if there are two; `None` of nothing.
pub(super) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
