//! `osteon init`: from a CSV file as a spreadsheet writes it to a job that runs.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;

use support::{Scratch, run, text};

/// Semicolons, decimal commas, km/s, a gap, Latin-1, CRLF: 24 velocities of two groups.
fn spreadsheet() -> Vec<u8> {
    let row = |k: u32| {
        let velocity = 3880 + k * 37 % 180;
        let group = ["a", "b"][k as usize % 2];
        format!("M\u{fc}ller {};{group};{},{:03}\r\n", k / 4, velocity / 1000, velocity % 1000)
    };
    let text = format!(
        "Patient;Gruppe;FAS (km/s)\r\nM\u{fc}ller 9;a;\r\n{}",
        (0..24).map(row).collect::<String>()
    );
    text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect()
}

#[test]
fn a_spreadsheet_becomes_a_job_that_runs() {
    let scratch = Scratch::new();
    let csv = scratch.path("clinic.csv");
    fs::write(&csv, spreadsheet()).unwrap();
    let said = run(&["init", text(&csv)]);
    assert_eq!(said.code, Some(0), "{}", said.stderr);
    let expected = [
        "header in line 1, fields separated by semicolons, decimal commas, windows-1252",
        "24 velocities from line 3 to 26, column 3 \"FAS (km/s)\" (unit km/s), mean 39",
        "1 row is left out: the velocity is \"\"",
        "2 groups in the column \"Gruppe\": a search for each",
        "subjects in the column \"Patient\"",
        "osteon identify",
    ];
    for expected in expected {
        assert!(said.stdout.contains(expected), "{expected} is not in: {}", said.stdout);
    }
    let job = scratch.path("clinic.toml");
    let checked = run(&["check", text(&job), "--json"]);
    assert_eq!(checked.code, Some(0), "{}", checked.stderr);
    assert_eq!(checked.json()["sets"], 2);
    let printed = run(&["init", text(&csv), "-o", "-"]);
    assert!(printed.stdout.starts_with("# Identifies"), "{}", printed.stdout);
    let again = run(&["init", text(&csv)]);
    assert_eq!(again.code, Some(2));
    assert!(again.stderr.contains("already exists and is not overwritten"), "{}", again.stderr);
}

#[test]
fn what_cannot_be_run_yet_is_said_at_once() {
    let scratch = Scratch::new();
    let csv = scratch.write("v.csv", "velocity\n3900\n3950\n39000\n3920\n");
    let said = run(&["init", text(&csv)]);
    assert_eq!(said.code, Some(2));
    assert!(said.stderr.contains("line 4: velocity is 39000.0"), "{}", said.stderr);
    assert!(!scratch.path("v.toml").exists());
    let printed = run(&["init", text(&csv), "-o", "-"]);
    assert_eq!(printed.code, Some(2));
    assert!(printed.stderr.contains("line 4: velocity is 39000.0"), "{}", printed.stderr);
    let nothing = run(&["init", text(&scratch.write("w.csv", "a,b\nx,y\n"))]);
    assert_eq!(nothing.code, Some(2));
    assert!(!scratch.path("w.toml").exists());
}

#[test]
fn a_schema_for_editors_is_written_once_for_all_jobs_beside_it() {
    let scratch = Scratch::new();
    let csv = scratch.write("v.csv", "velocity\n3900\n3950\n3920\n");
    let schema = scratch.path("job.schema.json");
    for name in ["first.toml", "second.toml"] {
        let job = scratch.path(name);
        let said = run(&["init", text(&csv), "--schema", "-o", text(&job)]);
        assert_eq!(said.code, Some(0), "{}", said.stderr);
        let written = fs::read_to_string(&job).unwrap();
        assert!(written.starts_with("#:schema job.schema.json\n# Identifies"), "{written}");
        assert_eq!(run(&["check", text(&job)]).code, Some(0));
        assert_eq!(fs::read_to_string(&schema).unwrap(), run(&["schema", "job"]).stdout);
    }
    let printed = run(&["init", text(&csv), "--schema", "-o", "-"]);
    assert_eq!(printed.code, Some(2));
    assert!(printed.stderr.contains("-o must name one"), "{}", printed.stderr);
}
