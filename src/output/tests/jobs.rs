//! Output of `jobs`, `workers` and `watch`.

use super::*;

pub(super) fn jobs() -> Vec<JobSnapshot> {
    let running = JobSnapshot {
        job: "1".to_owned(),
        kind: KindMessage::Identification.into(),
        state: JobState::Running.into(),
        evaluations: 41,
        max_evaluations: 400,
        realizations_done: 1747,
        realizations: 2747,
        best_cost: Some(1.25e-5),
        realizations_per_second: 1000.0,
        workers: 2,
        elapsed_s: 112.7,
        ..JobSnapshot::default()
    };
    let ended = JobSnapshot {
        job: "22".to_owned(),
        kind: KindMessage::Propagation.into(),
        state: JobState::Ended.into(),
        status: JobStatus::Failed.into(),
        reason: "3 of 100 realizations failed".to_owned(),
        realizations_done: 100,
        realizations: 100,
        best_cost: Some(f64::INFINITY),
        elapsed_s: 0.4,
        ..JobSnapshot::default()
    };
    vec![running, ended]
}

#[test]
fn jobs_are_a_table_or_a_list() {
    let shown = printed(OutputFormat::Text, |output| output.jobs(&jobs(), &[]).unwrap());
    insta::assert_snapshot!(shown);
    let shown = printed(OutputFormat::Json, |output| output.jobs(&jobs(), &[]).unwrap());
    insta::assert_snapshot!(shown);
    assert_eq!(printed(OutputFormat::Text, |output| output.jobs(&[], &[]).unwrap()), "no jobs\n");
    let none = printed(OutputFormat::Json, |output| output.jobs(&[], &[]).unwrap());
    assert_eq!(none, "[]\n");
}

#[test]
fn a_snapshot_is_one_line() {
    let lines = printed(OutputFormat::Text, |output| {
        for job in jobs() {
            output.snapshot(&job).unwrap();
        }
    });
    insta::assert_snapshot!(lines);
    let [_, ended]: [JobSnapshot; 2] = jobs().try_into().unwrap();
    let cancelled = JobSnapshot {
        status: JobStatus::Cancelled.into(),
        reason: String::new(),
        best_cost: None,
        ..ended
    };
    let line = printed(OutputFormat::Text, |output| output.snapshot(&cancelled).unwrap());
    assert_eq!(line, "  0.4 s  cancelled\n");
}

#[test]
fn an_id_is_printed_alone() {
    assert_eq!(printed(OutputFormat::Text, |output| output.submitted("7").unwrap()), "7\n");
    let json = printed(OutputFormat::Json, |output| output.submitted("7").unwrap());
    assert_eq!(json, "{\n  \"job\": \"7\"\n}\n");
}

#[test]
fn banned_workers_are_shown_and_forgotten_jobs_listed() {
    let banned = osteon_proto::v1::BannedWorker {
        host: "node3".to_owned(),
        process: 42,
        job: "7".to_owned(),
        reason: "answered realization 5 of job 7 wrongly".to_owned(),
        elapsed_s: 90.0,
    };
    let banned = [banned];
    let shown = printed(OutputFormat::Text, |output| output.jobs(&[], &banned).unwrap());
    let line = "node3 (process 42) answered realization 5 of job 7 wrongly\n";
    assert!(shown.starts_with("no jobs\nbanned ") && shown.ends_with(line), "{shown}");
    let workers = osteon_proto::v1::ListWorkersResponse::default();
    let listed = printed(OutputFormat::Json, |output| output.workers(&workers, &banned).unwrap());
    let listed: serde_json::Value = serde_json::from_str(&listed).unwrap();
    assert_eq!(listed["banned"][0]["host"], "node3");
    assert_eq!(listed["banned"][0]["job"], "7");
    let pruned = ["3".to_owned(), "5".to_owned()];
    assert_eq!(printed(OutputFormat::Text, |output| output.pruned(&pruned).unwrap()), "3\n5\n");
    let json = printed(OutputFormat::Json, |output| output.pruned(&pruned).unwrap());
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(value, serde_json::json!({ "pruned": ["3", "5"] }));
}

/// A coordinator's messages are shown in a form that cannot control the terminal; programs receive
/// them unchanged.
#[test]
fn what_others_say_is_shown_without_hidden_characters() {
    use osteon_common::visible::is_hidden;
    let hostile = "x\u{1b}[2J\u{202e}y";
    let banned = [osteon_proto::v1::BannedWorker {
        host: format!("{hostile}\n"),
        process: 42,
        job: "7".to_owned(),
        reason: hostile.to_owned(),
        elapsed_s: 90.0,
    }];
    let jobs = [JobSnapshot {
        job: hostile.to_owned(),
        kind: KindMessage::Propagation.into(),
        state: JobState::Ended.into(),
        status: JobStatus::Failed.into(),
        reason: hostile.to_owned(),
        waiting_for: hostile.to_owned(),
        ..JobSnapshot::default()
    }];
    let specification = specification(JobKind::Identification, &["dispersion"]);
    let reason = format!("\"failed\", \"reason\": {}", serde_json::json!(hostile));
    let json = RESULT.replace("\"converged\"", &reason);
    assert_ne!(json, RESULT);
    let directory = Path::new(hostile);
    let result = ShownResult {
        specification: &specification,
        usual_shifts: &[],
        result: &identification(&json),
        directory: Some(directory),
        detail: Detail::Usual,
    };
    let print = |format: OutputFormat| {
        printed(format, |output| {
            output.jobs(&jobs, &banned).unwrap();
            output.snapshot(&jobs[0]).unwrap();
            output.pruned(&[hostile.to_owned()]).unwrap();
            output.submitted(hostile).unwrap();
            output.result(&result).unwrap();
        })
    };
    let shown = print(OutputFormat::Text);
    assert!(!shown.contains(|c| c != '\n' && is_hidden(c)), "{shown:?}");
    assert_eq!(shown.matches(r"x\u{1b}[2J\u{202e}y").count(), 11, "{shown}");
    assert!(shown.contains(r"y\n (process 42)"), "{shown}");
    let told = print(OutputFormat::Json);
    assert!(told.contains("\\u001b[2J\u{202e}y"), "{told}");
}
