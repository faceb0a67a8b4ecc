//! Derives information from successive snapshots of a job.

use std::time::Duration;

use osteon_proto::v1::{JobKind, JobSnapshot, JobState};

use super::display::JobProgress;

/// An evaluation that takes this long gets a bar; for a shorter one it would only flicker.
const LONG: Duration = Duration::from_secs(3);

/// Observes the snapshots of one job, in their order.
#[derive(Debug, Default)]
pub(super) struct Observer {
    derivatives: u64,
    /// Time of the first observed progress, and the progress at that time in evaluations.
    begun: Option<(Duration, f64)>,
    present: Option<CurrentEvaluation>,
    /// Duration of the last complete evaluation.
    last_took: Duration,
}

/// The current evaluation.
#[derive(Debug, Clone, Copy)]
struct CurrentEvaluation {
    evaluations: u64,
    since: Duration,
    /// Largest number of outcomes seen so far; the number falls if some are computed again.
    furthest: u64,
}

impl Observer {
    /// Creates the observer of a job that would measure this many derivatives.
    pub(super) fn new(derivatives: u64) -> Self {
        Self { derivatives, ..Self::default() }
    }

    /// Returns the data known with this snapshot, which arrived at `now`.
    pub(super) fn observe(&mut self, snapshot: &JobSnapshot, now: Duration) -> JobProgress {
        let evaluation_s = self.pace(snapshot, now);
        let mut present = match self.present {
            Some(present) if present.evaluations == snapshot.evaluations => present,
            before => {
                let ended = before.map(|before| {
                    let count = snapshot.evaluations.saturating_sub(before.evaluations).max(1);
                    now.saturating_sub(before.since).div_f64(count as f64)
                });
                self.last_took = ended.unwrap_or_default();
                CurrentEvaluation { evaluations: snapshot.evaluations, since: now, furthest: 0 }
            }
        };
        present.furthest = present.furthest.max(snapshot.realizations_done);
        self.present = Some(present);
        let is_long = self.last_took >= LONG || now.saturating_sub(present.since) >= LONG;
        let only_one = snapshot.kind() == JobKind::Propagation;
        let shown = snapshot.state() == JobState::Running && (only_one || is_long);
        let bar = shown.then_some(present.furthest);
        JobProgress { derivatives: self.derivatives, bar, evaluation_s }
    }

    /// Returns the mean duration of an evaluation so far, s. It is steadier than the rate of the
    /// last seconds, which jumps from point to point.
    fn pace(&mut self, snapshot: &JobSnapshot, now: Duration) -> Option<f64> {
        let all = snapshot.realizations.max(1) as f64;
        let far = snapshot.evaluations as f64 + snapshot.realizations_done as f64 / all;
        let idle = snapshot.state() != JobState::Running || snapshot.realizations_per_second <= 0.0;
        match self.begun {
            // A job whose evaluations are computed again may be behind its starting point.
            Some((since, from)) if far >= from => {
                let done = far - from;
                (done >= 1.0).then(|| now.saturating_sub(since).as_secs_f64() / done)
            }
            _ => {
                self.begun = (!idle).then_some((now, far));
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn snapshot(evaluations: u64, done: u64) -> JobSnapshot {
        JobSnapshot {
            kind: JobKind::Identification.into(),
            state: JobState::Running.into(),
            evaluations,
            realizations_done: done,
            realizations: 100,
            realizations_per_second: 50.0,
            ..JobSnapshot::default()
        }
    }

    /// Returns the bars of snapshots at these times (s), each with its evaluations and outcomes.
    fn bars(seen: &[(u64, u64, u64)]) -> Vec<Option<u64>> {
        let mut observer = Observer::default();
        let observe = |&(at, evaluations, done): &(u64, u64, u64)| {
            observer.observe(&snapshot(evaluations, done), Duration::from_secs(at)).bar
        };
        seen.iter().map(observe).collect()
    }

    #[test]
    fn only_a_long_evaluation_has_a_bar_and_it_stays() {
        let quick = [(0, 0, 10), (1, 1, 90), (1, 2, 5), (2, 3, 50), (2, 40, 20)];
        assert_eq!(bars(&quick), [None; 5]);
        let slow =
            [(0, 0, 10), (2, 0, 40), (3, 0, 60), (5, 0, 99), (6, 1, 3), (7, 1, 30), (9, 2, 0)];
        let expected = [None, None, Some(60), Some(99), Some(3), Some(30), Some(0)];
        assert_eq!(bars(&slow), expected);
    }

    #[test]
    fn a_bar_never_runs_backwards() {
        let again = [(0, 0, 10), (4, 0, 80), (5, 0, 20), (6, 0, 81)];
        assert_eq!(bars(&again), [None, Some(80), Some(80), Some(81)]);
    }

    #[test]
    fn a_propagation_has_its_bar_from_the_start() {
        let mut observer = Observer::default();
        let propagation = JobSnapshot { kind: JobKind::Propagation.into(), ..snapshot(0, 7) };
        assert_eq!(observer.observe(&propagation, Duration::ZERO).bar, Some(7));
        let waiting = JobSnapshot { state: JobState::Waiting.into(), ..propagation };
        assert_eq!(observer.observe(&waiting, Duration::ZERO).bar, None);
    }

    #[test]
    fn the_pace_is_that_of_all_evaluations_seen() {
        let mut observer = Observer::new(7);
        let mut pace = |at, evaluations, done| {
            let observed = observer.observe(&snapshot(evaluations, done), Duration::from_secs(at));
            assert_eq!(observed.derivatives, 7);
            observed.evaluation_s
        };
        assert_eq!(pace(10, 5, 0), None);
        assert_eq!(pace(11, 5, 50), None);
        assert_eq!(pace(12, 6, 0), Some(2.0));
        assert_eq!(pace(16, 8, 0), Some(2.0));
        // One slow point has little effect.
        assert_eq!(pace(26, 9, 0), Some(4.0));
        // After a repair the measurement starts again.
        assert_eq!(pace(27, 2, 0), None);
        assert_eq!(pace(28, 3, 0), Some(1.0));
    }
}
