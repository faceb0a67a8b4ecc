use unicode_width::UnicodeWidthStr as _;

use super::*;
use crate::sample_result::posterior;

#[test]
fn what_the_data_fix_comes_first() {
    insta::assert_snapshot!(text(&posterior()));
}

#[test]
fn doubts_are_told() {
    let said = |change: fn(&mut PosteriorReport)| {
        let mut found = posterior();
        change(&mut found);
        let text = text(&found);
        assert!(text.lines().all(|line| line.width() <= 80), "{text}");
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    assert!(!said(|_| {}).contains("Warning"));
    let vague = said(|found| {
        (found.converged, found.reason) = (false, Some("the evaluations are used up.".to_owned()));
    });
    let warning = "Warning: the posterior did not converge: the evaluations are used up. Its";
    assert!(vague.contains(warning), "{vague}");
    let unexplained = said(|found| found.converged = false);
    assert!(unexplained.contains("did not converge. Its intervals may be off."), "{unexplained}");
    assert!(!unexplained.contains("which the data"), "{unexplained}");
    let share = "An estimated 1.2 % of the velocities are not from the model's law";
    assert!(said(|_| {}).contains(share));
    assert!(!said(|found| found.outlier_share = Some(0.0004)).contains("An estimated"));
    let surprising = said(|found| found.predictive_p_value = Some(0.0042));
    assert!(surprising.contains("does not explain the distribution of the data"), "{surprising}");
}

#[test]
fn numbers_that_are_none_are_unknown() {
    let mut found = posterior();
    found.effective_draws = None;
    found.mean.interval_95 = [None, None];
    found.bulk_velocity.standard_deviation = None;
    let text = text(&found);
    let mut lines = text.lines();
    let unknown = lines.any(|line| line.starts_with("mean velocity") && line.contains("unknown"));
    assert!(unknown && text.contains("? effective draws"), "{text}");
}

#[test]
fn a_posterior_wider_than_its_prior_is_called_so() {
    let mut found = posterior();
    let plain = text(&found);
    found.bulk_velocity.prior_standard_deviation =
        found.bulk_velocity.standard_deviation.map(|deviation| 0.8 * deviation);
    let wider = text(&found);
    let row = wider.lines().find(|line| line.contains("√(c1111/ρ)")).unwrap();
    assert!(row.ends_with("wider") && wider.contains("than the prior"), "{wider}");
    assert!(!plain.contains("wider"), "{plain}");
}
