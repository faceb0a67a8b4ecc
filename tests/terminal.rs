//! What a run shows: on a terminal, which is that of the program `script`, and elsewhere.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::process::Command;

use support::{Scratch, job, osteon, remove_settings, run, text};

/// Runs the program on a terminal of 80 columns; returns all that it sent there. `None` where
/// there is no `script` of util-linux.
fn on_terminal(arguments: &[&str], variables: &[(&str, &str)]) -> Option<String> {
    let known = Command::new("script").arg("--version").output().ok()?;
    if !String::from_utf8_lossy(&known.stdout).contains("util-linux") {
        return None;
    }
    let program = osteon();
    let mut line = format!("stty columns 80; exec {}", text(program.get_program().as_ref()));
    for argument in arguments {
        line.push_str(&format!(" '{argument}'"));
    }
    let mut command = Command::new("script");
    command.args(["--quiet", "--return", "--command", &line, "/dev/null"]);
    remove_settings(&mut command);
    command.env("TERM", "xterm");
    let output = command.envs(variables.iter().copied()).output().unwrap();
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Returns a text without what moves the cursor.
fn visible(shown: &str) -> String {
    let mut parts = shown.split("\u{1b}[");
    let first = parts.next().unwrap_or_default().to_owned();
    let after = |part: &str| {
        let end = part.find(|c: char| c.is_ascii_alphabetic()).map_or(part.len(), |at| at + 1);
        part[end..].to_owned()
    };
    first + &parts.map(after).collect::<String>()
}

/// Whether a text sets colours.
fn is_coloured(shown: &str) -> bool {
    let ends =
        |part: &str| part.find(|c: char| c.is_ascii_alphabetic()).map(|at| part.as_bytes()[at]);
    shown.split("\u{1b}[").skip(1).any(|part| ends(part) == Some(b'm'))
}

#[test]
fn a_terminal_shows_progress_that_overwrites_itself() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(400, 6));
    let Some(shown) = on_terminal(&["identify", text(&file)], &[]) else { return };
    // Moves to the beginning of lines, and clears them.
    assert!(shown.contains("evaluation ") && shown.contains("\u{1b}[2K"), "{shown:?}");
    assert!(!is_coloured(&shown), "{shown:?}");
    let result = visible(shown.rsplit("\u{1b}[2K").next().unwrap());
    assert!(result.contains("digest "), "{shown:?}");
    assert!(result.lines().all(|line| line.trim_end().chars().count() <= 80), "{result}");
    let quiet = on_terminal(&["identify", text(&file), "--quiet"], &[]).unwrap();
    assert!(!quiet.contains("evaluation ") && !quiet.contains('\u{1b}'), "{quiet:?}");
}

#[test]
fn no_colour_is_shown_to_those_who_want_none() {
    let wrong = ["identify", "--wrong"];
    let Some(coloured) = on_terminal(&wrong, &[]) else { return };
    assert!(is_coloured(&coloured), "{coloured:?}");
    for (name, value) in [("NO_COLOR", "1"), ("TERM", "dumb")] {
        let plain = on_terminal(&wrong, &[(name, value)]).unwrap();
        assert!(plain.contains("--wrong") && !is_coloured(&plain), "{name}: {plain:?}");
    }
    assert!(!is_coloured(&run(&wrong).stderr));
}

#[test]
fn a_summary_is_shorter_and_details_say_more() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(30, 20));
    let of = |options: &[&str]| {
        let words: Vec<&str> =
            ["identify", text(&file)].into_iter().chain(options.iter().copied()).collect();
        run(&words)
    };
    let (usual, quiet, verbose) = (of(&[]), of(&["-q"]), of(&["-v"]));
    let (usual_text, quiet_text) = (usual.succeeded(), quiet.succeeded());
    let verbose_text = verbose.succeeded();
    for shown in [usual_text, quiet_text, verbose_text] {
        assert!(shown.lines().all(|line| line.chars().count() <= 80), "{shown}");
        assert!(shown.contains("mean velocity (m/s)") && shown.contains("dispersion"), "{shown}");
    }
    // The first line says how it ended, in all of them.
    assert_eq!(quiet_text.lines().next(), usual_text.lines().next());
    assert!(!quiet_text.contains("digest") && !quiet_text.contains("solver"), "{quiet_text}");
    assert_eq!(quiet.stderr, "");
    for detail in
        ["seed         7", "search       simplex", "numerics", "if a parameter grows by 1 %"]
    {
        assert!(
            verbose_text.contains(detail) && !usual_text.contains(detail),
            "{detail}: {verbose_text}"
        );
    }
    // Lines of the search, and without -v none in so short a time.
    assert!(verbose.stderr.contains("evaluation "), "{verbose:?}");
    assert!(!usual.stderr.contains("evaluation "), "{usual:?}");
    // What programs read is the same.
    let json = |option: &str| of(&["--json", option]).json();
    assert_eq!(json("-q"), json("-v"));
    let both = of(&["-q", "-v"]);
    assert_eq!(both.code, Some(2), "{both:?}");
}
