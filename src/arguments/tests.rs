use clap::CommandFactory as _;

use super::services::lease;
use super::*;

#[test]
fn the_definition_is_sound() {
    Arguments::command().debug_assert();
}

fn refusal(line: &str) -> String {
    let parsed = Arguments::try_parse_from(line.split_whitespace());
    let error = parsed.expect_err(line);
    assert_eq!(error.exit_code(), 2, "{line}");
    error.to_string()
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let check = |line: &str, expected: &str| {
        let message = refusal(line);
        assert!(message.contains(expected), "{line}: {message}");
    };
    check("osteon identify", "<JOB>");
    check("osteon identify a.toml --workers 0", "0 is not in 1..=256");
    check("osteon identify a.toml --workers 257", "257 is not in 1..=256");
    check("osteon identify a.toml --threads 4097", "4097 is not in 1..=4096");
    check("osteon identify a.toml --workers two", "invalid digit");
    check("osteon identify a.toml --coordinator https://a", "https://HOST:PORT");
    check("osteon identify a.toml --coordinator http://a:1 --workers 2", "cannot be used with");
    check("osteon identify a.toml --coordinator http://a:1 --threads 2", "cannot be used with");
    check("osteon identify a.toml --tokens list", "unexpected argument");
    check("osteon coordinator --listen a:1 --store s --tls-cert c", "--tls-key");
    check("osteon coordinator --listen a:1 --store s --insecure --tokens t", "cannot be used with");
    check("osteon certs", "<DIR>");
    check("osteon certs d --days 4000", "4000 is not in 1..=3650");
    check("osteon token a --role write --out t", "[possible values: read, submit, admin]");
    check("osteon token a --role read", "--out");
    check("osteon simulate a.toml --duration 0", "it must be a number above 0");
    check("osteon simulate a.toml --duration nan", "it must be a number above 0");
    check("osteon simulate a.toml --time-step -1e-8", "unexpected argument");
    check("osteon simulate a.toml --time-step inf", "it must be a number above 0");
    check("osteon study variance", "unrecognized subcommand");
    check("osteon job submit a.toml --priority 10", "10 is not in 0..=9");
    for (age, unit) in
        [("30", ""), ("x", ""), ("-1", "d"), ("3", "w"), ("1e3", "s"), ("9999999", "d")]
    {
        check(
            &format!("osteon job prune --older-than={age}{unit}"),
            "it must be a number with the unit",
        );
    }
    for fraction in ["-0.1", "1.1", "nan", "half"] {
        let line = format!("osteon coordinator --listen a:1 --store b --audit-fraction={fraction}");
        check(&line, "it must be a number from 0 to 1");
    }
    check("osteon draw a.toml", "--index");
    check("osteon draw a.toml --index -1", "unexpected argument");
    check("osteon draw a.toml --index 1.5", "invalid digit");
    check("osteon worker --coordinator somewhere", "http://HOST:PORT or unix:PATH");
    check("osteon worker --coordinator unix:a --give-up-after 0", "above 0");
    check("osteon worker --coordinator unix:a --time-limit 1e9", "at most");
    check("osteon coordinator --listen 127.0.0.1:0", "--store");
    check("osteon job submit a.toml --coordinator unix:a --request-id=", "1 to 256 bytes");
    let long = "n".repeat(257);
    check(&format!("osteon job submit a.toml --name {long}"), "at most 256 bytes");
    check("osteon identify a.toml --name a\u{7}b", "no control characters");
    check("osteon coordinator health --timeout 0", "from 0.1 to 60");
    check("osteon coordinator health --timeout 61", "from 0.1 to 60");
    check("osteon worker drain one", "invalid digit");
    check("osteon coordinator backup", "<DIR>");
    check("osteon coordinator --store s health", "'health'");
    check("osteon worker --threads 1 list", "'list'");
    check("osteon worker lists", "'lists'");
    check("osteon job fetch 1 --coordinator unix:a", "--out");
    check("osteon report", "<DIR>...");
    check("osteon frobnicate", "unrecognized subcommand");
    check("osteon", "Usage");
}

#[test]
fn words_of_services_run_them_or_ask_them() {
    let parse = |line: &str| Arguments::try_parse_from(line.split_whitespace()).unwrap().command;
    let service = parse("osteon worker");
    assert!(matches!(service, Command::Worker(Noun::Service(_))), "{service:?}");
    let service = parse("osteon coordinator --listen a:1 --store s");
    assert!(matches!(service, Command::Coordinator(Noun::Service(_))), "{service:?}");
    let list = worker(parse("osteon worker list --json"));
    assert!(matches!(&list, WorkerCommand::List(list) if list.json), "{list:?}");
    let health = parse("osteon coordinator health");
    assert!(matches!(health, Command::Coordinator(Noun::Command(_))), "{health:?}");
}

fn worker(command: Command) -> WorkerCommand {
    match command {
        Command::Worker(Noun::Command(command)) => command,
        Command::Earlier(command) => worker(command.into()),
        other => panic!("{other:?}"),
    }
}

#[test]
fn options_before_an_operation_on_workers_go_on() {
    for line in [
        "osteon workers --coordinator unix:a --json drain 3",
        "osteon workers --coordinator unix:b drain 3 --coordinator unix:a --json",
    ] {
        let parsed = Arguments::try_parse_from(line.split_whitespace()).unwrap().command;
        let WorkerCommand::Drain(drain) = worker(parsed) else { panic!("{line}") };
        assert_eq!((drain.worker, drain.json), (3, true), "{line}");
        assert_eq!(drain.client.coordinator.unwrap().to_string(), "unix:a", "{line}");
    }
}

#[test]
fn ages_have_units() {
    for (text, seconds) in
        [("45s", 45.0), ("90min", 5400.0), ("1.5h", 5400.0), ("30d", 2_592_000.0), ("0s", 0.0)]
    {
        assert_eq!(age(text).unwrap().as_secs_f64(), seconds, "{text}");
    }
}

#[test]
fn leases_last_for_a_second_to_an_hour() {
    for (text, seconds) in [("1", 1.0), ("2.5", 2.5), ("3600", 3600.0)] {
        assert_eq!(lease(text).unwrap().as_secs_f64(), seconds, "{text}");
    }
    for text in ["0.9", "3601", "-1", "NaN", "inf", "1s", ""] {
        assert!(lease(text).unwrap_err().contains("from 1 to 3600"), "{text}");
    }
}
