use super::*;

/// A search half way through.
fn search() -> JobSnapshot {
    JobSnapshot {
        job: "1".to_owned(),
        kind: JobKind::Identification.into(),
        state: JobState::Running.into(),
        evaluations: 41,
        max_evaluations: 407,
        realizations_done: 1747,
        realizations: 2747,
        best_cost: Some(1.25e-5),
        best_mean: Some(3906.27),
        best_coefficient_of_variation: Some(0.02708),
        realizations_per_second: 1000.0,
        workers: 2,
        ..JobSnapshot::default()
    }
}

fn propagation() -> JobSnapshot {
    JobSnapshot {
        kind: JobKind::Propagation.into(),
        evaluations: 0,
        max_evaluations: 1,
        best_cost: None,
        best_mean: None,
        ..search()
    }
}

const OBSERVED: JobProgress = JobProgress { derivatives: 7, bar: None, evaluation_s: None };

fn shown(snapshot: &JobSnapshot, observed: JobProgress, width: usize) -> Vec<String> {
    let lines = lines(snapshot, &observed, width);
    for line in &lines {
        assert!(line.chars().count() <= width, "{width}: {line}");
    }
    lines
}

#[test]
fn a_search_shows_what_the_width_allows() {
    let check = |width: usize, expected: [&str; 2]| {
        assert_eq!(shown(&search(), OBSERVED, width), expected, "{width}");
    };
    check(40, ["evaluation 42, up to 17 min left", "best cost 1.25e-5, mean 3906.3 m/s"]);
    let best = "best cost 1.25e-5, mean 3906.3 m/s, CV 0.02708";
    check(80, ["evaluation 42 of at most 400 + 7, 1000 realizations/s, up to 17 min left", best]);
    let all = "evaluation 42 of at most 400 + 7 for derivatives, 1000 realizations/s, up to 17 min left \
               if all evaluations are used";
    check(120, [all, best]);
    check(200, [all, best]);
    let most = "evaluation 42 of at most 400 + 7, 1000 realizations/s, up to 17 min left \
                if all evaluations are used";
    check(110, [most, best]);
}

/// Uses the largest numbers that a job can have.
#[test]
fn what_matters_is_seen_at_every_width_from_40_on() {
    let large = JobSnapshot {
        evaluations: 999_998,
        max_evaluations: 1_000_007,
        realizations: 10_000_000,
        realizations_done: 9_999_999,
        best_cost: Some(-12_345.678_901),
        realizations_per_second: 1_234_567.0,
        ..search()
    };
    for snapshot in [search(), large] {
        for width in 40..=200 {
            let text = shown(&snapshot, OBSERVED, width).join("\n");
            let mut expected = vec!["evaluation ", " left", "best cost "];
            if width >= 80 {
                expected.extend(["realizations/s", "m/s"]);
            }
            for part in expected {
                assert!(text.contains(part), "{part} at {width}: {text}");
            }
        }
    }
}

#[test]
fn a_long_evaluation_has_a_bar() {
    let observed = JobProgress { bar: Some(1747), ..OBSERVED };
    let at = |width| shown(&search(), observed, width).pop().unwrap();
    assert_eq!(at(40), "█████░░░ 63 % of this evaluation");
    assert_eq!(at(80), "██████████░░░░░░ 63 % of this evaluation, 1747 of 2747 realizations");
    // An incomplete evaluation is never shown as 100 %.
    let almost = JobProgress { bar: Some(2746), ..OBSERVED };
    assert!(shown(&search(), almost, 80)[2].contains("░ 99 %"));
}

#[test]
fn a_propagation_is_a_bar() {
    let observed = JobProgress { bar: Some(1747), ..JobProgress::default() };
    let check = |width: usize, expected: &str| {
        assert_eq!(shown(&propagation(), observed, width), [expected], "{width}");
    };
    check(40, "█████░░░ 63 %, 1.0 s left");
    let all = "██████████░░░░░░ 63 %, 1747 of 2747 realizations, 1000 realizations/s, 1.0 s left";
    check(80, "██████████░░░░░░ 63 %, 1000 realizations/s, 1.0 s left");
    check(120, all);
    check(200, all);
}

#[test]
fn the_mean_of_evaluations_counts_before_the_rate() {
    let observed = JobProgress { evaluation_s: Some(10.0), ..OBSERVED };
    let first = shown(&search(), observed, 80).remove(0);
    // 365 further evaluations and the rest of this one, of 10 s each.
    assert!(first.ends_with("up to 61 min left"), "{first}");
}

#[test]
fn what_is_waited_for_has_its_own_line() {
    let begun = JobSnapshot {
        evaluations: 0,
        realizations_done: 0,
        best_cost: None,
        best_mean: None,
        best_coefficient_of_variation: None,
        realizations_per_second: 0.0,
        waiting_for: "no worker is attached (since 7 s)".to_owned(),
        ..search()
    };
    let expected = [
        "evaluation 1 of at most 400 + 7 for derivatives, 0 realizations/s",
        "waiting: no worker is attached (since 7 s)",
    ];
    assert_eq!(shown(&begun, OBSERVED, 80), expected);
    let long = JobSnapshot { waiting_for: "its turn ".repeat(20), ..begun.clone() };
    assert!(shown(&long, OBSERVED, 40)[1].ends_with('…'));
    let infeasible = JobSnapshot { best_cost: Some(f64::INFINITY), ..begun.clone() };
    assert!(!shown(&infeasible, OBSERVED, 80).concat().contains("cost"));
    let waiting = JobSnapshot { state: JobState::Waiting.into(), ..begun };
    assert_eq!(shown(&waiting, OBSERVED, 80), ["waiting: no worker is attached (since 7 s)"]);
}

#[test]
fn one_line_has_it_all_or_what_fits() {
    assert_eq!(
        line(&search(), &OBSERVED, usize::MAX),
        "evaluation 42 of at most 400 + 7 for derivatives, 1000 realizations/s, up to 17 min left if \
         all evaluations are used, best cost 1.25e-5, mean 3906.3 m/s, CV 0.02708, \
         1747 of 2747 realizations"
    );
    for width in 40..=200 {
        let text = line(&search(), &OBSERVED, width);
        assert!(text.chars().count() <= width && text.starts_with("evaluation 42"), "{text}");
        assert!(width < 53 || text.contains("1.25e-5") && text.contains("left"), "{width}: {text}");
    }
    let ended = JobSnapshot { state: JobState::Ended.into(), ..search() };
    assert_eq!(
        line(&ended, &JobProgress::default(), 80),
        "41 evaluations, best cost 1.25e-5, mean 3906.3 m/s, CV 0.02708"
    );
    assert_eq!(
        line(&propagation(), &JobProgress::default(), 80),
        "1747 of 2747 realizations, 1000 realizations/s, 1.0 s left"
    );
}

#[test]
fn a_likelihoods_cost_has_the_digits_that_change() {
    for (cost, expected) in [(6.071647123, "best cost 6.071647,"), (-2.5, "best cost -2.500000,")] {
        let best = &shown(&JobSnapshot { best_cost: Some(cost), ..search() }, OBSERVED, 80)[1];
        assert!(best.contains(expected), "{best}");
    }
}

#[test]
fn spans_read_well() {
    let cases = [
        (0.0, "0.0 s"),
        (9.94, "9.9 s"),
        (9.96, "10 s"),
        (99.6, "2 min"),
        (3600.0, "60 min"),
        (7200.0, "2.0 h"),
        (1e6, "12 days"),
    ];
    for (seconds, expected) in cases {
        assert_eq!(span(seconds), expected);
    }
}
