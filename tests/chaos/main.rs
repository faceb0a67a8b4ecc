//! Coordinator, workers and clients under all faults of a cluster, with real processes and real
//! sockets. In each test the job ends with the digest of an undisturbed run, or the user concerned
//! gets a message that says what is wrong and what to do.
//!
//! Nothing here waits for a guessed time: faults come after observed progress, and states are
//! polled until a deadline. Random choices are determined by a seed that is printed.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that cannot go on fails, and says what it survived"
)]

#[path = "../support/altering.rs"]
mod altering;
#[path = "../support/api.rs"]
mod api;
#[path = "../support/peer.rs"]
mod peer;
#[path = "../support/proxy.rs"]
mod proxy;
#[path = "../support/random.rs"]
mod random;
#[path = "../support/service.rs"]
mod service;
#[expect(dead_code, reason = "each test file uses a part of it")]
#[path = "../support/mod.rs"]
mod support;

mod answers;
mod broken;
mod clients;
mod crowd;
mod disk;
mod kills;
mod network;
mod resumed;
mod stopped;
