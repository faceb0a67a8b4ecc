//! Says before a run that its job takes remarkably long.

use osteon_common::job::JobSpecification;
use osteon_local::cost::{Effort, JobCost};
use osteon_solver::Isa;

use crate::progress::{say, span};

/// Usual time of a realization, s.
const USUAL_S: f64 = 0.25e-3;
/// A realization that takes this many times as long as usual is pointed out before a run.
const REMARKABLE_RATIO: f64 = 10.0;
/// Jobs shorter than this, s of wall time, are run without a word.
const SHORT_S: f64 = 20.0;
/// Jobs longer than this, s of wall time, are announced.
const LONG_S: f64 = 300.0;

/// Says so on stderr if a job that is about to be run on this machine takes remarkably long. For other jobs
/// the measurement takes a few milliseconds.
pub(crate) async fn say_if_remarkable(specification: &JobSpecification, isa: Isa, threads: u32) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let cores = threads.min(u32::try_from(cores).unwrap_or(threads));
    let cost = JobCost::measure(specification, isa, Effort::BRIEF, cores).await;
    if let Some(remark) = remark(&cost) {
        say(&format!("note: {remark}"));
    }
}

/// Returns a sentence for the user who is about to run the job, if it takes remarkably long.
fn remark(cost: &JobCost) -> Option<String> {
    let Some([_, most_s]) = cost.wall_s() else {
        return Some(format!(
            "a realization takes more than {}, thousands of times as long as usual; see `osteon \
             check`",
            span(cost.limit_s)
        ));
    };
    // The median: a thread that had to wait for its processor must not count.
    let ratio = cost.start.as_ref().map_or(0.0, |start| start.median_s) / USUAL_S;
    if ratio > REMARKABLE_RATIO && most_s > SHORT_S {
        return Some(format!(
            "a realization takes some {:.0} ms, {ratio:.0} times as long as usual, and the job up to \
             about {}; see `osteon check`",
            ratio * USUAL_S * 1e3,
            span(most_s)
        ));
    }
    let long = || format!("the job takes up to about {}; see `osteon check`", span(most_s));
    (most_s > LONG_S).then(long)
}

#[cfg(test)]
mod tests {
    use osteon_common::parameters::{PARAMETERS, Point};
    use osteon_local::cost::PlaceCost;
    use osteon_search::ExpectedEvaluations;

    use super::*;

    /// Costs with this time of a realization at the start, s.
    fn cost(start_s: Option<f64>, realizations: u64) -> JobCost {
        let point = Point::new([1.0; PARAMETERS]);
        let place = |mean_s| PlaceCost { point, mean_s, median_s: mean_s, measured: 8, failed: 0 };
        JobCost {
            start: start_s.map(place),
            places: Vec::new(),
            unmeasured: 0,
            limit_s: 2.0,
            expected: ExpectedEvaluations { fewest: 50, most: 100 },
            realizations,
            cores: 2,
        }
    }

    #[test]
    fn only_what_takes_long_is_remarked() {
        assert_eq!(remark(&cost(Some(0.25e-3), 200)), None);
        // Slow realizations of a short job.
        assert_eq!(remark(&cost(Some(1.9e-3), 200)), None);
        assert_eq!(
            remark(&cost(Some(25e-3), 200)).unwrap(),
            "a realization takes some 25 ms, 100 times as long as usual, and the job up to about 4 min; \
             see `osteon check`"
        );
        let many = remark(&cost(Some(0.25e-3), 1_000_000)).unwrap();
        assert_eq!(many, "the job takes up to about 3.5 h; see `osteon check`");
        let unknown = remark(&cost(None, 200)).unwrap();
        assert!(unknown.starts_with("a realization takes more than 2.0 s"), "{unknown}");
    }
}
