//! Fuzzing of Slurm's lists: they are read or refused, without ever panicking.

use osteon_fuzz::{bounded, damaged_text, properties, texts};

use crate::queue;

/// Reads a list of Slurm's queue: ids are never options or anything else for `scancel`.
fn check_queue(text: &str) {
    let Ok(workers) = bounded(text.len(), || queue::parse(text)) else { return };
    assert!(workers.len() <= text.lines().count());
    assert!(workers.iter().all(|worker| worker.id.starts_with(|c: char| c.is_ascii_digit())));
}

#[test]
fn every_seed_is_read() {
    texts("squeue").iter().for_each(|text| assert!(queue::parse(text).is_ok(), "{text}"));
}

#[test]
fn long_lists_take_no_more_than_their_share() {
    check_queue(&"1|n|PENDING|0:00|r\n".repeat(20_000));
    check_queue(&"|".repeat(400_000));
}

properties! {
    fn damaged_lists_of_slurm_are_read_or_refused(text in damaged_text(texts("squeue"))) {
        check_queue(&text);
    }
}
