//! A worker that dies costs nothing but time.

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use support::{Coordinator, Scratch, eventually, job};

#[test]
fn a_worker_killed_mid_evaluation_does_not_change_a_bit() {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", &job(400, 12));
    let digest = |coordinator: &Coordinator, id: &str, name: &str| {
        let out = scratch.path(name);
        coordinator.client(&["fetch", id, "--out", out.to_str().unwrap()]).succeeded();
        std::fs::read(out.join("result.json")).unwrap()
    };
    let wait = |coordinator: &Coordinator, id: &str| {
        let watched = coordinator.client(&["watch", id]);
        watched.succeeded();
        assert!(watched.stdout.lines().count() >= 1, "{watched:?}");
    };

    let alone = Coordinator::start(&scratch.path("alone"));
    let _worker = alone.worker(1);
    let id = alone.submit(&job);
    wait(&alone, &id);
    let expected = digest(&alone, &id, "one");

    let coordinator = Coordinator::start(&scratch.path("two"));
    let mut doomed = coordinator.worker(1);
    let _survivor = coordinator.worker(1);
    let id = coordinator.submit(&job);
    eventually("both workers are in the middle of an evaluation", || {
        let now = coordinator.job(&id);
        assert_eq!(now["status"], serde_json::Value::Null, "ended before the worker was killed");
        let (done, of) = (now["realizations_done"].as_u64(), now["realizations"].as_u64());
        now["workers"] == 2 && now["evaluations"].as_u64() >= Some(2) && done > Some(0) && done < of
    });
    doomed.kill();
    wait(&coordinator, &id);
    assert_eq!(
        String::from_utf8(digest(&coordinator, &id, "killed")).unwrap(),
        String::from_utf8(expected).unwrap()
    );
}
