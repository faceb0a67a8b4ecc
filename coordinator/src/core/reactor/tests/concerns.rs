//! What the log, the list of jobs and the live page tell an operator, and when.

use osteon_common::limits::JOBS_MAX;

use super::*;
use crate::core::notice::Notice;

impl Rig {
    /// Lets a second pass; returns what the log is told.
    fn told_concerns(&mut self) -> Vec<String> {
        self.now += Duration::from_secs(1);
        let effects = react(&mut self.state, Event::Tick, self.now).into_iter();
        let told = effects.filter_map(|effect| match effect {
            Effect::Note(Notice::Concern { text }) => Some(text),
            _ => None,
        });
        told.collect()
    }

    /// Returns what is a concern now.
    fn concerns(&mut self) -> Vec<String> {
        let asked = request(1, Request::Concerns);
        match &react(&mut self.state, asked, self.now)[..] {
            [Effect::Answer { answer: Answer::Concerns(concerns), .. }] => concerns.clone(),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_bound_that_is_half_used_is_told_once_and_shown_while_it_is() {
    let mut rig = Rig::new();
    let most = JOBS_MAX as u64;
    let connections = |open| Event::Connections { open, most };
    rig.event(connections(most / 2 - 1));
    assert_eq!((rig.told_concerns(), rig.concerns()), (vec![], vec![]));
    let half = "5000 of at most 10000 connections are open; more have to wait";
    rig.event(connections(most / 2));
    assert_eq!(
        (rig.told_concerns(), rig.concerns()),
        (vec![half.to_owned()], vec![half.to_owned()])
    );
    // It goes up and down around the half.
    for open in [most / 2 - 1, most / 2, most / 2 - 1000, most / 2] {
        rig.event(connections(open));
        assert_eq!(rig.told_concerns(), [""; 0], "{open}");
    }
    rig.event(connections(most / 4));
    assert_eq!((rig.told_concerns(), rig.concerns()), (vec![], vec![]));
    rig.event(connections(most / 2));
    assert_eq!(rig.told_concerns(), [half]);
}

#[test]
fn jobs_their_bytes_and_workers_are_counted() {
    let mut rig = Rig::new();
    rig.event(submit(1, "", propagation(1)));
    rig.state.config.jobs_bytes_max = 2 * rig.state.jobs[&JobId(1)].bytes;
    let [bytes] = &rig.concerns()[..] else { panic!("{:?}", rig.concerns()) };
    assert!(bytes.starts_with("the jobs that wait or run take 0 MiB"), "{bytes}");
    rig.state.config.jobs_bytes_max = u64::MAX;
    for number in 1..=2048 {
        rig.event(hello(number, 1));
        // One host may attach eight workers a second.
        rig.now += Duration::from_millis(125);
    }
    assert_eq!(rig.concerns(), ["2048 of at most 4096 workers are attached; more are refused"]);
}

#[test]
fn a_store_that_refuses_is_a_concern_until_it_stores_something() {
    let mut rig = Rig::new();
    rig.event(submit(1, "", propagation(1)));
    let (job, key) = (JobId(1), RecordKey::Job);
    rig.event(Event::StoreFailed { job, key, error: "the disk is full".to_owned() });
    rig.now += Duration::from_secs(7);
    let expected = "the store has refused records for 7 s, and stored none since: the disk is full";
    assert_eq!(rig.concerns(), [expected]);
    assert_eq!(rig.told_concerns().len(), 1);
    assert_eq!(rig.told_concerns(), [""; 0]);
    rig.accept(propagation(1));
    assert_eq!(rig.concerns(), [""; 0]);
}

#[test]
fn a_log_that_only_grows_is_a_concern_after_a_while() {
    let mut rig = Rig::new();
    rig.event(Event::LogStuck { bytes: 9 << 20 });
    rig.now += Duration::from_secs(59);
    assert_eq!(rig.concerns(), [""; 0]);
    rig.event(Event::LogStuck { bytes: 900 << 20 });
    let [told] = &rig.told_concerns()[..] else { panic!("nothing is told") };
    assert!(told.contains("for 60 s and has 900 MiB"), "{told}");
    rig.event(Event::LogCopied);
    assert_eq!(rig.concerns(), [""; 0]);
}
