//! What command line and environment mean together.

use std::ffi::OsString;

use clap::Parser as _;
use osteon_client::environment::Environment;

use super::*;
use crate::arguments::{Arguments, Command};

fn run(line: &str, cores: u32, coordinator: Option<&str>) -> Run {
    let words = line.split_whitespace();
    let command = Arguments::try_parse_from(words).unwrap().command;
    let (Command::Identify(arguments) | Command::Propagate(arguments)) = command else {
        panic!("{line} is no run");
    };
    Run::resolve(JobKind::Identification, arguments, &context(coordinator, cores)).unwrap()
}

/// An environment with this coordinator, and files for it.
fn context(coordinator: Option<&str>, cores: u32) -> ProcessContext {
    let files = ["OSTEON_TLS_CA", "OSTEON_TOKEN_FILE"];
    let environment = Environment::read(|name| match name {
        "OSTEON_COORDINATOR" => coordinator.map(OsString::from),
        name => files.contains(&name).then(|| OsString::from("file")),
    });
    ProcessContext { environment: environment.unwrap(), cores }
}

fn here(line: &str, cores: u32) -> (u32, u32) {
    match run(line, cores, None).location {
        RunLocation::Local { workers, threads } => (workers, threads),
        RunLocation::Coordinator(remote) => panic!("{}", remote.endpoint),
    }
}

#[test]
fn threads_share_the_cores() {
    assert_eq!(here("osteon identify a.toml", 8), (2, 4));
    assert_eq!(here("osteon identify a.toml", 1), (2, 1));
    assert_eq!(here("osteon identify a.toml --workers 3", 8), (3, 2));
    assert_eq!(here("osteon identify a.toml --workers 1", 8), (1, 8));
    assert_eq!(here("osteon propagate a.toml --threads 5", 8), (2, 5));
    assert_eq!(here("osteon identify a.toml --workers 16", 8), (16, 1));
}

#[test]
fn the_flag_counts_before_the_environment() {
    let there = |line: &str, environment| match run(line, 2, environment).location {
        RunLocation::Coordinator(remote) => Some(remote.endpoint.to_string()),
        RunLocation::Local { .. } => None,
    };
    let environment = Some("unix:/run/osteon");
    let flag = "osteon identify a.toml --coordinator http://a:1";
    assert_eq!(there("osteon identify a.toml", None), None);
    assert_eq!(there("osteon identify a.toml", Some("")), None);
    assert_eq!(there("osteon identify a.toml", environment), Some("unix:/run/osteon".into()));
    assert_eq!(there(flag, environment), Some("http://a:1".into()));
    assert_eq!(there("osteon identify a.toml --workers 1", environment), None);
}

#[test]
fn an_environment_that_is_no_address_is_bad_input() {
    let words = ["osteon", "identify", "a.toml"];
    let Command::Identify(arguments) = Arguments::try_parse_from(words).unwrap().command else {
        panic!("no run");
    };
    let failure =
        Run::resolve(JobKind::Identification, arguments, &context(Some("nowhere"), 2)).unwrap_err();
    assert_eq!(failure.exit_code(), 2);
    assert!(failure.to_string().contains("OSTEON_COORDINATOR"), "{failure}");
    assert!(failure.to_string().contains("`nowhere`"), "{failure}");
}
