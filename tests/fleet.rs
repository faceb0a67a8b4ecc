//! A small `cargo xtask bench fleet`: what it measures is not asserted, that it measures the same job is.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[path = "../benches/fleet/arguments.rs"]
mod arguments;
#[path = "../coordinator/tests/fake/mod.rs"]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod fake;
#[path = "../coordinator/tests/fake/grouped.rs"]
mod grouped;
#[path = "../benches/fleet/job.rs"]
mod job;
#[path = "../benches/fleet/measured.rs"]
mod measured;
#[path = "../benches/fleet/process.rs"]
mod process;
#[path = "../benches/service/mod.rs"]
mod service;
#[path = "../benches/fleet/slots.rs"]
mod slots;
#[path = "../benches/fleet/worker.rs"]
mod worker;

use clap::Parser as _;

use arguments::{FleetArguments, Row};
use measured::{HEADER, measure};

fn rows(words: &str) -> Result<Vec<Row>, String> {
    let words = words.split_whitespace();
    let arguments = FleetArguments::try_parse_from(["bench fleet"].into_iter().chain(words));
    arguments.map_err(|error| error.to_string())?.rows().map_err(|error| error.to_string())
}

/// Runs all rows of a table, and checks that each job has the digest that one loop has.
async fn check(words: &str) {
    let rows = rows(words).unwrap();
    let expected = fake::plain_run(&rows[0].job.specification());
    for row in &rows {
        let measured = measure(row).await.unwrap();
        assert_eq!(measured.digest, expected.digest, "{row:?}");
        let columns = |line: &str| line.matches('|').count();
        assert_eq!(columns(&measured.row()), columns(HEADER.lines().next().unwrap()));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn fleets_of_one_and_three_workers_have_the_digest_of_a_plain_loop() {
    check("--workers 1,3 --realizations 2747 --each 10us --slots 2").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn so_has_a_fleet_that_loses_workers_and_one_that_loses_its_coordinator() {
    check("--workers 3 --realizations 2747 --each 1ms --slots 2 --kill 0.5 --restart").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn so_has_an_identification_of_groups() {
    check("--workers 3 --groups 2 --each 1us").await;
}

#[test]
fn arguments_that_make_no_sense_are_refused() {
    let refused = |words: &str, expected: &str| {
        let message = rows(words).unwrap_err();
        assert!(message.contains(expected), "{words}: {message}");
    };
    refused("--workers 0", "1..=4096");
    refused("--workers 4097", "1..=4096");
    refused("--workers 10,x", "invalid digit");
    refused("--slots 0", "1..=4096");
    refused("--each 1", "write a number with the unit us, ms or s");
    refused("--each 0ms", "it must be 1us to 10s");
    refused("--each 11s", "it must be 1us to 10s");
    refused("--each=-1s", "write a number");
    refused("--each nans", "write a number");
    refused("--realizations 0", "1..=10000000");
    refused("--groups 0", "it must be 1 to 1000");
    refused("--groups 5 --realizations 5", "cannot be used with");
    refused("--kill 0", "above 0 and below 1");
    refused("--mute 1", "above 0 and below 1");
    refused("--silent x", "a number between 0 and 1");
    refused("--workers 1 --kill 0.5", "at least one must remain");
    refused("--workers 10 --silent 0.01", "at least one must be concerned");
    refused("--workers 1 --slots 1 --each 10s", "at most 3600s is allowed");
}
