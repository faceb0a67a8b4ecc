//! Advice of a search without any velocity.

use osteon_common::outcome::FailureKind::{
    DirectWaveFirst, InconsistentArrival, NoArrival, NoConvergence, NotFinite,
};
use osteon_common::settings::Method;

use super::*;

/// Returns the reason of a search all of whose points have these outcomes.
fn reason(job: &JobSpecification, outcomes: [osteon_common::outcome::Outcome; 10]) -> String {
    let mut search = Search::new(Arc::new(job.clone()));
    while let Step::Evaluate(_) = search.ask() {
        search.tell(outcomes.into(), None);
    }
    let Ending { status, reason, .. } = ending(&search);
    assert_eq!(status, Status::Failed);
    reason.unwrap()
}

fn job() -> JobSpecification {
    let mut job = specification(5);
    job.monte_carlo.realizations = 10;
    job
}

/// Another start, or a larger failure limit, helps if only a few fail.
const A_FEW: &str = "change the starts of [parameters], or allow a larger [monte_carlo] \
                     max_failed_fraction";

#[test]
fn another_start_is_advised_where_a_few_fail() {
    let mut outcomes = [Ok(3900.0); 10];
    outcomes[..3].fill(Err(NoArrival));
    assert!(reason(&job(), outcomes).ends_with(A_FEW), "{}", reason(&job(), outcomes));
    // Most realizations fail, in several ways.
    outcomes[..5].fill(Err(InconsistentArrival));
    outcomes[5..].fill(Err(NoArrival));
    assert!(reason(&job(), outcomes).ends_with(A_FEW), "{}", reason(&job(), outcomes));
}

#[test]
fn where_nearly_all_fail_alike_the_likely_cause_is_named() {
    for (kind, expected) in [
        (DirectWaveFirst, "the wave through the coupling arrives first"),
        (NoArrival, "no wave through such a bone is seen"),
        (InconsistentArrival, "the receivers see different waves first"),
        (NotFinite, "is out of scale. Check their units"),
        (NoConvergence, "lower probe.center_frequency or [solver] refinement"),
    ] {
        let mut outcomes = [Err(kind); 10];
        outcomes[4] = Ok(3900.0);
        let reason = reason(&job(), outcomes);
        assert!(reason.contains(&format!("9 of 10 realizations failed (9 {}", kind.name())));
        assert!(reason.contains(expected), "{reason}");
        assert!(!reason.contains(A_FEW), "{reason}");
    }
    let mut job = job();
    job.setup.solver.method = Method::Hybrid;
    let reason = reason(&job, [Err(NoConvergence); 10]);
    assert!(reason.ends_with("Leave out solver.time_step, or give a larger solver.element_size"));
}

#[test]
fn unusual_numbers_are_named_where_all_fail() {
    let mut job = job();
    job.setup.layers.bone_thickness = 0.4;
    let reason = reason(&job, [Err(NoArrival); 10]);
    assert!(
        reason.ends_with(
            "; layers.bone.thickness: is 0.4 m; usual is 0.0002 to 0.03 m; did you mean 0.4 mm (0.4e-3)?"
        ),
        "{reason}"
    );
}
