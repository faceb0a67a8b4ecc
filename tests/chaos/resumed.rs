//! Recomputation after a coordinator was killed.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, mpsc};

use osteon_common::job::JobKind;
use osteon_proto::batch::Work;
use osteon_proto::parameter_values::point_to_message;
use osteon_proto::v1::fetch_response::Part;
use osteon_proto::v1::{JobState, ParameterValues};

use crate::api::{Api, specification};
use crate::peer::{self, Peer, hello};
use crate::random::Random;
use crate::service::{Service, undisturbed};
use crate::support::{DEADLINE, Scratch, job};

const SEED: u64 = 5;
const KILLS: usize = 8;
const REALIZATIONS: u32 = 40;
const EVALUATIONS: u32 = 10;
/// Maximum number of batches between two kills; an evaluation has 8 to 12.
const BATCHES: usize = 14;

/// The computed batches, each with the run of the coordinator that requested it.
type Computed = Arc<Mutex<Vec<(usize, Work)>>>;

/// Computes for all runs of a coordinator, records every batch, and reports it.
async fn work(url: String, life: Arc<AtomicUsize>, computed: Computed, told: mpsc::Sender<()>) {
    loop {
        let Ok(mut peer) = Peer::attach(&url, hello(1)).await else { continue };
        while let Ok((batch, work)) = peer.batch().await {
            let solved = peer::solve(&work);
            computed.lock().unwrap().push((life.load(Ordering::SeqCst), work));
            peer.answer(batch, &solved).await;
            // The test may be over.
            let _ = told.send(());
        }
    }
}

#[test]
fn a_resumed_job_repeats_no_more_than_the_evaluation_in_flight() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(REALIZATIONS, EVALUATIONS));
    let digest = undisturbed("identify", &file);
    // Speculative evaluations are not on the path of the search.
    let mut service = Service::start(&scratch, &["--audit-fraction", "0", "--no-speculation"]);
    let mut api = Api::new(service.url());
    let id = api.submit(&specification(&file, JobKind::Identification), "").unwrap();

    let (life, computed) = (Arc::new(AtomicUsize::new(0)), Computed::default());
    let (told, batches) = mpsc::channel();
    let worker = work(service.url().to_owned(), Arc::clone(&life), Arc::clone(&computed), told);
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
    runtime.spawn(worker);
    let mut random = Random::new(SEED);
    // Number of evaluations acknowledged before each kill.
    let mut stored = Vec::new();
    while stored.len() < KILLS {
        for _ in 0..=random.below(BATCHES) {
            batches.recv_timeout(DEADLINE).unwrap();
        }
        let seen = api.job(&id);
        assert_ne!(seen.state(), JobState::Ended, "too few evaluations for so many kills");
        stored.push(seen.evaluations as usize);
        service.kill();
        life.fetch_add(1, Ordering::SeqCst);
        service.start_again();
        // Batches of the previous run do not count.
        while batches.try_recv().is_ok() {}
    }
    assert_eq!(api.end(&id).digest(), digest);
    runtime.shutdown_background();

    let points: Vec<Option<ParameterValues>> =
        api.parts(&id).into_iter().flat_map(points).collect();
    // Two more evaluations measure derivatives.
    let evaluations = EVALUATIONS + 2;
    assert_eq!(points.len(), evaluations as usize);
    let computed = computed.lock().unwrap();
    for (life, work) in computed.iter().filter(|(life, _)| *life > 0) {
        let point = Some(point_to_message(&work.evaluation.point));
        let number = points.iter().position(|known| *known == point).unwrap();
        let known = stored[life - 1];
        assert!(number >= known, "seed {SEED}: {number} of {known} stored again in life {life}");
    }
    let total: u32 = computed.iter().map(|(_, work)| work.count).sum();
    let once = REALIZATIONS * evaluations;
    println!("{KILLS} kills: {total} realizations for {once}");
    assert!(total >= once && total <= once + REALIZATIONS * KILLS as u32, "{total}");
}

fn points(part: Part) -> Vec<Option<ParameterValues>> {
    match part {
        Part::History(block) => block.rows.into_iter().map(|row| row.point).collect(),
        _ => Vec::new(),
    }
}
