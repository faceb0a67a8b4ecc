//! Whether to trust a result, in words.

use std::fmt::Write as _;

use osteon_common::results::Status;

use crate::finding::Finding;
use crate::input::{ReportedRun, RunContent};
use crate::number::digits;
use crate::text::escape;

/// Largest share of failed realizations that is no reason for doubt.
const FAILED_MAX: f64 = 0.001;
/// Largest estimated relative error of a velocity that is no reason for doubt.
const SOLVER_ERROR_MAX: f64 = 1e-3;
/// Probability of a test of the data's form or order below which it is a reason for doubt.
const STRIKING: f64 = 0.01;

/// How a finding bears on the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Bearing {
    Good,
    Caution,
    Bad,
}

/// One finding.
#[derive(Debug, Clone, PartialEq)]
struct Verdict {
    bearing: Bearing,
    /// What it is about.
    subject: &'static str,
    /// The finding, a sentence.
    words: String,
}

fn verdict(bearing: Bearing, subject: &'static str, words: impl Into<String>) -> Verdict {
    Verdict { bearing, subject, words: words.into() }
}

/// Returns a sentence on the whole, and a list of what it rests on.
pub(super) fn trust_list(run: &ReportedRun, findings: &[Finding<'_>]) -> String {
    if let RunContent::Simulation(result, _) = &run.content {
        let one = match (&result.velocity, &result.failure) {
            (Some(_), _) => verdict(Bearing::Good, "Velocity", "A first arrival was picked."),
            (None, failure) => {
                let kind = failure.map_or("", |kind| kind.name());
                let detail = result.detail.as_deref().unwrap_or_default();
                verdict(Bearing::Bad, "Velocity", format!("There is none ({kind}): {detail}."))
            }
        };
        return summary_and_items(&[one]);
    }
    if findings.len() > 1 || findings.iter().any(|finding| finding.group.is_some()) {
        let hosts: Vec<Verdict> = hosts_verdict(run).into_iter().collect();
        let above = if hosts.is_empty() { String::new() } else { summary_and_items(&hosts) };
        return above + &group_doubts(findings);
    }
    let of_findings = findings.iter().flat_map(finding_verdicts);
    let verdicts: Vec<Verdict> = hosts_verdict(run).into_iter().chain(of_findings).collect();
    summary_and_items(&verdicts)
}

fn group_doubts(findings: &[Finding<'_>]) -> String {
    let mut out = String::new();
    let worst =
        |finding: &Finding<'_>| finding_verdicts(finding).iter().map(|one| one.bearing as u8).max();
    let without_doubt = findings.iter().filter(|one| worst(one) == Some(0)).count();
    let sentence = if without_doubt == findings.len() {
        format!("Nothing found here speaks against the results of the {without_doubt} groups.")
    } else {
        format!(
            "Of {} groups, {without_doubt} give no reason for doubt; look first at what stands below.",
            findings.len()
        )
    };
    out.push_str(&format!("<p class=\"trust\">{sentence}</p>"));
    for finding in findings {
        let doubts: Vec<Verdict> = finding_verdicts(finding)
            .into_iter()
            .filter(|one| one.bearing != Bearing::Good)
            .collect();
        if !doubts.is_empty() {
            let name = escape(finding.group.unwrap_or_default());
            let _infallible = write!(out, "<h3>{name}</h3>{}", items(&doubts));
        }
    }
    out
}

fn summary_and_items(verdicts: &[Verdict]) -> String {
    let with_bearing =
        |bearing| verdicts.iter().filter(|one| one.bearing == bearing).collect::<Vec<_>>();
    let (bad, caution) = (with_bearing(Bearing::Bad), with_bearing(Bearing::Caution));
    let subjects = |some: &[&Verdict]| {
        let subjects = some.iter().map(|one| one.subject.to_lowercase());
        subjects.collect::<Vec<_>>().join(", ")
    };
    let sentence = match (bad.is_empty(), caution.is_empty()) {
        (true, true) => "Nothing found here speaks against this result.".to_owned(),
        (true, false) => {
            format!("This result can be used with care; look first at: {}.", subjects(&caution))
        }
        _ => format!("Do not use this result without looking at: {}.", subjects(&bad)),
    };
    format!("<p class=\"trust\">{}</p>{}", escape(&sentence), items(verdicts))
}

fn items(verdicts: &[Verdict]) -> String {
    let mut out = "<ul class=\"verdicts\">".to_owned();
    for Verdict { bearing, subject, words } in verdicts {
        let (class, mark) = match bearing {
            Bearing::Good => ("good", "good"),
            Bearing::Caution => ("caution", "take care"),
            Bearing::Bad => ("bad", "problem"),
        };
        let words = escape(words);
        let _infallible = write!(
            out,
            "<li class=\"{class}\"><strong>{subject}</strong> <span class=\"mark\">{mark}</span> {words}</li>"
        );
    }
    out.push_str("</ul>");
    out
}

fn finding_verdicts(finding: &Finding<'_>) -> Vec<Verdict> {
    let mut found = Vec::new();
    found.extend(status_verdict(finding));
    found.extend(match_verdict(finding));
    found.extend(parameters_verdict(finding));
    found.extend(posterior_verdict(finding));
    found.extend(distribution_verdict(finding));
    found.extend(form_verdict(finding));
    found.extend(order_verdict(finding));
    found.extend(starts_verdict(finding));
    found.push(failures_verdict(finding));
    found.extend(outliers_verdict(finding));
    found.extend(few_data_verdict(finding));
    found.extend(solver_verdict(finding));
    found
}

/// Says whether a host that computed a part of the result was banned after the job had ended.
fn hosts_verdict(run: &ReportedRun) -> Option<Verdict> {
    let found = match &run.content {
        RunContent::Identification(result, _) => result.integrity.as_ref()?,
        RunContent::Propagation(result, _) => result.integrity.as_ref()?,
        RunContent::Simulation(..) => return None,
    };
    let bearing = match found.changed {
        None => Bearing::Bad,
        Some(true) => Bearing::Caution,
        Some(false) => Bearing::Good,
    };
    Some(verdict(bearing, "Hosts", format!("{}.", found.statement)))
}

fn status_verdict(finding: &Finding<'_>) -> Option<Verdict> {
    let (bearing, words) = match finding.status? {
        Status::Converged => (Bearing::Good, "It has converged."),
        Status::NotMatched => (Bearing::Bad, "It has ended, but its best point misses the data."),
        Status::MaxEvaluations => {
            (Bearing::Caution, "It used up its evaluations before it converged.")
        }
        Status::Cancelled => (Bearing::Bad, "It was cancelled: the best point so far is shown."),
        Status::Failed => (Bearing::Bad, "It failed."),
    };
    let reason = finding.reason.map(|reason| {
        let line = reason.lines().next().unwrap_or_default().trim_end_matches('.');
        format!(" {line}.")
    });
    Some(verdict(bearing, "Search", format!("{words}{}", reason.unwrap_or_default())))
}

fn match_verdict(finding: &Finding<'_>) -> Option<Verdict> {
    let identified = finding.identified?;
    let noise = match finding.below_noise_from {
        Some(from) => format!(
            " From evaluation {from} on the cost was below what sampling noise alone causes."
        ),
        None => String::new(),
    };
    Some(if identified.matched {
        let words = "The model reproduces mean and scatter of the data within their noise.";
        verdict(Bearing::Good, "Match", format!("{words}{noise}"))
    } else {
        let words = "The model misses mean or scatter of the data by more than their noise, so that no \
                     interval is stated.";
        verdict(Bearing::Bad, "Match", words)
    })
}

fn parameters_verdict(finding: &Finding<'_>) -> Option<Verdict> {
    let identified = finding.identified?;
    let (free, open) = (finding.free_parameters().len(), identified.free_directions.len());
    if open == 0 {
        let words = match free {
            1 => "The data determine the free parameter.".to_owned(),
            _ => format!("The data determine all {free} free parameters."),
        };
        return Some(verdict(Bearing::Good, "Parameters", words));
    }
    let directions = if open == 1 { "direction" } else { "directions" };
    let words = format!(
        "The data determine {} of {free} directions of the free parameters and leave {open} \
         {directions} open: single parameters are not known, whatever their values below.{}",
        identified.directions.len(),
        if finding.posterior.is_some() {
            " The posterior says how far they may lie."
        } else {
            " Fix parameters, add other observables, or ask for a posterior."
        }
    );
    Some(verdict(Bearing::Caution, "Parameters", words))
}

fn posterior_verdict(finding: &Finding<'_>) -> Option<Verdict> {
    let posterior = finding.posterior?;
    Some(if posterior.converged {
        let draws = posterior.effective_draws.unwrap_or(0.0);
        let words = format!("It is as accurate as it must be ({} effective draws).", draws.round());
        verdict(Bearing::Good, "Posterior", words)
    } else {
        let reason = posterior.reason.as_deref().unwrap_or("it did not converge");
        verdict(Bearing::Bad, "Posterior", format!("Its numbers are unreliable: {reason}."))
    })
}

fn distribution_verdict(finding: &Finding<'_>) -> Option<Verdict> {
    let p_value = match finding.posterior.and_then(|found| found.predictive_p_value) {
        Some(p_value) => p_value,
        None => finding.data?.kolmogorov.flatten()?.p_value,
    };
    let shown = digits(p_value, 2);
    Some(if p_value < 0.05 {
        let words = format!(
            "The data do not have the model's distribution (Kolmogorov-Smirnov, p = {shown}): mean and \
             scatter may agree and its form not."
        );
        verdict(Bearing::Caution, "Distribution", words)
    } else {
        let words = format!(
            "The whole distribution agrees with the data (Kolmogorov-Smirnov, p = {shown})."
        );
        verdict(Bearing::Good, "Distribution", words)
    })
}

fn form_verdict(finding: &Finding<'_>) -> Option<Verdict> {
    let tests = finding.data?.form?;
    let named = [("L-skewness", tests.skewness), ("L-kurtosis", tests.kurtosis)];
    let striking = named.into_iter().filter(|(_, test)| test.p_value < STRIKING);
    let parts: Vec<String> = striking
        .map(|(name, test)| {
            let [data, model, p] = [test.data, test.model, test.p_value].map(|x| digits(x, 2));
            format!("{name} {data}, of the model {model}, p = {p}")
        })
        .collect();
    let words = format!("Skewness or tails are not the model's ({}).", parts.join("; "));
    (!parts.is_empty()).then(|| verdict(Bearing::Caution, "Form", words))
}

fn order_verdict(finding: &Finding<'_>) -> Option<Verdict> {
    let test = finding.data?.order.filter(|test| test.p_value < STRIKING)?;
    let words = format!(
        "Velocities that follow each other in the file are alike (Bartels' rank test, p = {}), and the \
         intervals take them for independent. Several may be of one bone, or the device may drift.",
        digits(test.p_value, 2)
    );
    Some(verdict(Bearing::Caution, "Independence", words))
}

fn starts_verdict(finding: &Finding<'_>) -> Option<Verdict> {
    let solutions = finding.solutions?;
    let (matching, all) = (solutions.matching, solutions.points.len());
    let words = format!("{matching} of {all} starts end at a point that matches the data.");
    let bearing = if matching * 2 >= all as u64 { Bearing::Good } else { Bearing::Caution };
    Some(verdict(bearing, "Starts", words))
}

fn failures_verdict(finding: &Finding<'_>) -> Verdict {
    let (failed, all) = (finding.failed_realizations(), finding.realizations);
    if failed == 0 {
        return verdict(Bearing::Good, "Failures", format!("None of {all} realizations failed."));
    }
    let share = failed as f64 / all.max(1) as f64;
    let bearing = if share > FAILED_MAX { Bearing::Caution } else { Bearing::Good };
    let words = format!(
        "{failed} of {all} realizations ({} %) failed and count in no moment.",
        digits(100.0 * share, 2)
    );
    verdict(bearing, "Failures", words)
}

fn outliers_verdict(finding: &Finding<'_>) -> Option<Verdict> {
    let data = finding.data?;
    let count = data.outlier_count?;
    let words = format!(
        "{count} measured velocities lie farther from the median than 6 robust standard deviations; \
         nothing was left out because of it. Check them."
    );
    Some(verdict(Bearing::Caution, "Outliers", words))
}

/// Finds that there is no interval although the data determine every parameter.
fn few_data_verdict(finding: &Finding<'_>) -> Option<Verdict> {
    let identified = finding.identified?;
    let known = finding.posterior.is_some() || identified.bulk_velocity.ends().is_some();
    if known || !identified.matched || !identified.free_directions.is_empty() {
        return None;
    }
    let words = "There are no intervals: fewer than five velocities or subjects, or moments without \
                 their number.";
    Some(verdict(Bearing::Caution, "Number of data", words))
}

fn solver_verdict(finding: &Finding<'_>) -> Option<Verdict> {
    use osteon_files::report::Solver;
    let result = finding.solver?;
    let (Solver::Exact { estimated_error, .. } | Solver::Hybrid { estimated_error, .. }) = result;
    let median = estimated_error.median?;
    let shown = digits(median, 2);
    Some(if median > SOLVER_ERROR_MAX {
        let words =
            format!("The median estimated error of a velocity is {shown}: refine the solver.");
        verdict(Bearing::Caution, "Solver", words)
    } else {
        let words = format!("The median estimated error of a velocity is {shown}, relative.");
        verdict(Bearing::Good, "Solver", words)
    })
}
