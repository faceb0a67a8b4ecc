//! Rust programs that use the client crate.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

#[path = "../client/examples/propagate.rs"]
#[expect(dead_code, reason = "its main function is for the command line")]
mod propagate;
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::path::Path;

use support::{Coordinator, Scratch, run};

#[tokio::test(flavor = "multi_thread")]
async fn the_example_computes_what_the_command_line_does() {
    let scratch = Scratch::new();
    let coordinator = Coordinator::start(&scratch.path("store"));
    let _worker = coordinator.worker(1);
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/quick.toml"));
    let (mean, digest) = propagate::propagate(&coordinator.url, file).await.unwrap();
    let expected = run(&["propagate", file.to_str().unwrap(), "--json"]).json();
    assert_eq!(expected["digest"], digest.as_str());
    assert_eq!(expected["velocity"]["mean"], mean);
}
