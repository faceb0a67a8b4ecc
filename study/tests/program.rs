//! The program as who measures meets it.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use std::process::{Command, Output};

use osteon_solver::Isa;

fn run(arguments: &[&str], variables: &[(&str, &str)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_osteon-study"));
    command.env_remove(Isa::VARIABLE).args(arguments).envs(variables.iter().copied());
    command.output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

#[test]
fn a_study_is_the_same_on_any_number_of_threads() {
    let study = ["failures", "--realizations", "3", "--seed", "5"];
    let finished = run(&study, &[]);
    let lines: Vec<&str> = text(&finished.stdout).lines().collect();
    assert!(lines[0].starts_with("`osteon-study failures --realizations 3 --seed 5` (osteon "));
    assert_eq!(lines.len(), 2 + 2 + 15, "{lines:?}");
    assert_eq!(text(&finished.stderr).lines().count(), 15, "progress: {finished:?}");
    for threads in ["1", "3"] {
        let again = run(&study, &[("RAYON_NUM_THREADS", threads)]);
        assert_eq!(again.stdout, finished.stdout);
    }
}

#[test]
fn an_unknown_instruction_set_is_refused() {
    let refused = run(&["failures"], &[(Isa::VARIABLE, "sse9")]);
    assert_eq!((refused.status.code(), text(&refused.stdout)), (Some(2), ""));
    let message = text(&refused.stderr);
    assert!(
        message.starts_with("osteon-study: in OSTEON_INSTRUCTION_SET: \"sse9\" is"),
        "{message}"
    );
}

#[test]
fn help_lists_every_study() {
    let help = run(&["--help"], &[("COLUMNS", "80")]);
    insta::assert_snapshot!(text(&help.stdout));
}
