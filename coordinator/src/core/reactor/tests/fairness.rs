//! Clients share the workers; priorities apply among the jobs of one client.

use super::*;

impl Rig {
    /// Submits and stores a job of a client.
    fn accept_for(&mut self, client: &str, priority: u32, realizations: u64) -> JobId {
        let Event::Requested { reply_id, request } = submit(0, "", propagation(realizations))
        else {
            panic!("no request");
        };
        let Request::Submit { specification, request_id, .. } = request else {
            panic!("no submission");
        };
        let client = client.to_owned();
        let request =
            Request::Submit { specification, request_id, client, priority, name: String::new() };
        let job = JobId(self.state.next_job);
        self.event(Event::Requested { reply_id, request });
        self.event(stored_event(job.0, RecordKey::Job));
        job
    }

    /// Lets worker 1, of one thread, answer its oldest batch, each realization in 10 ms times
    /// `slowness`; returns the job and size of the batch.
    fn answer_one(&mut self, slowness: impl Fn(JobId) -> f64) -> (JobId, u64) {
        let id = self.state.workers[&WorkerId(1)].in_flight[0];
        let assignment = self.state.batches[&id].assignment;
        let (first, count) = (assignment.indices.first, assignment.indices.count);
        let elapsed_s = 0.01 * slowness(assignment.job) * count as f64;
        self.now += Duration::from_secs_f64(elapsed_s);
        // Without the sanity check, because the state is large here.
        react(&mut self.state, answer_in(elapsed_s, 1, id.0, first, count), self.now);
        (assignment.job, count)
    }
}

#[test]
fn large_evaluations_wait_for_room() {
    let mut rig = Rig::new();
    rig.state.config.active_jobs_max = 8;
    rig.state.config.active_realizations_max = 100;
    // A job of any size may begin if no other is active.
    let large = rig.accept_for("a", 0, 150);
    let second = rig.accept_for("a", 0, 1);
    let other = rig.accept_for("b", 0, 50);
    let later = rig.accept_for("c", 0, 1);
    let active = |rig: &Rig| rig.state.active.iter().copied().collect::<Vec<_>>();
    assert_eq!(active(&rig), [large, other]);
    rig.event(request(1, Request::Cancel(other)));
    assert_eq!(active(&rig), [large, later]);
    rig.event(request(2, Request::Cancel(large)));
    assert_eq!(active(&rig), [second, later]);
}

#[test]
fn what_waits_is_bounded_in_bytes() {
    let submit_large = |client: &str, velocities: usize| {
        let mut specification = identification(1);
        specification.data = Some(Data::from_velocities(vec![3900.0; velocities]));
        let (specification, client) = (Arc::new(specification), client.to_owned());
        request(
            0,
            Request::Submit {
                specification,
                request_id: String::new(),
                client,
                priority: 0,
                name: String::new(),
            },
        )
    };
    let mut rig = Rig::new();
    rig.state.config.jobs_bytes_max = 420_000;
    let mut accepted = |client, velocities| {
        let effects = rig.event(submit_large(client, velocities));
        if effects[0].starts_with("answer 0: the specifications of ") {
            return effects[0].split(' ').nth(6).map(str::to_owned);
        }
        assert!(effects[0].starts_with("store job "), "{effects:?}");
        None
    };
    let whose = |word: &str| Some(word.to_owned());
    assert_eq!(accepted("a", 6000), None);
    assert_eq!(accepted("a", 6000), None);
    // One client may use a quarter.
    assert_eq!(accepted("a", 6000), whose("client's"));
    assert_eq!(accepted("a", 1), None);
    for client in ["b", "c", "d"] {
        assert_eq!(accepted(client, 12_000), None, "{client}");
    }
    // A quarter is free, but that is not enough.
    assert_eq!(accepted("e", 12_000), whose("jobs"));
    // A job that ends frees its bytes.
    let job = rig.state.jobs.keys().next_back().copied().unwrap();
    rig.event(stored_event(job.0, RecordKey::Job));
    rig.event(request(1, Request::Cancel(job)));
    rig.event(stored_event(job.0, RecordKey::End));
    let effects = rig.event(submit_large("e", 12_000));
    assert!(effects[0].starts_with("store job "), "{effects:?}");
}

#[test]
fn a_client_with_one_job_gets_as_much_as_one_with_many() {
    let mut rig = Rig::new();
    rig.state.config.active_jobs_max = 8;
    for _ in 0..200 {
        rig.accept_for("many", 0, 20_000);
    }
    rig.event(hello(1, 1));
    for _ in 0..50 {
        rig.answer_one(|_| 1.0);
    }
    // It comes late, finds the limit on active jobs reached, and its realizations take ten times as
    // long.
    let one = rig.accept_for("one", 0, 20_000);
    let slowness = |job| if job == one { 10.0 } else { 1.0 };
    let mut time = [0.0; 2];
    for _ in 0..1000 {
        let (job, count) = rig.answer_one(slowness);
        time[usize::from(job == one)] += slowness(job) * count as f64;
    }
    let share = time[1] / (time[0] + time[1]);
    assert!((0.45..0.55).contains(&share), "{share}");
}

#[test]
fn of_one_client_the_highest_priority_goes_first_and_harms_no_other() {
    let mut rig = Rig::new();
    rig.state.config.active_jobs_max = 8;
    let low = rig.accept_for("one", 1, 10_000);
    let high = rig.accept_for("one", 2, 300);
    let other = rig.accept_for("other", 0, 10_000);
    rig.event(hello(1, 1));
    let mut served: Vec<JobId> = (0..60).map(|_| rig.answer_one(|_| 1.0).0).collect();
    let done = served.iter().rposition(|job| *job == high).unwrap();
    assert!(!served[..done].contains(&low), "{served:?}");
    assert!(served[done..].contains(&low), "{served:?}");
    served.retain(|job| *job == other);
    assert!((20..40).contains(&served.len()), "{}", served.len());
}

#[test]
fn waiting_jobs_begin_in_the_order_of_priority_and_need() {
    let mut rig = Rig::new();
    let begun = |rig: &Rig| rig.state.active.iter().map(|id| id.0).collect::<Vec<_>>();
    for priority in [0, 0, 0, 5, 0] {
        rig.accept_for("one", priority, 10);
    }
    assert_eq!(begun(&rig), [1, 2]);
    // Clients without active jobs may exceed the limit.
    rig.accept_for("second", 0, 10);
    rig.accept_for("third", 0, 10);
    rig.accept_for("fourth", 9, 10);
    assert_eq!(begun(&rig), [1, 2, 6, 7]);
    let ends = [(6, vec![1, 2, 7, 8]), (7, vec![1, 2, 8]), (1, vec![2, 8]), (2, vec![4, 8])];
    for (ends, expected) in ends {
        rig.event(request(0, Request::Cancel(JobId(ends))));
        assert_eq!(begun(&rig), expected, "after the end of {ends}");
    }
}
