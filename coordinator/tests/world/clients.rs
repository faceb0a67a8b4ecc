//! Clients and their small jobs.

use std::sync::Arc;

use osteon_common::job::{Data, Group, JobSpecification, Search, SearchMethod};
use osteon_common::known_quantities::KnownQuantities;
use osteon_common::parameters::Parameter;
use osteon_coordinator::core::ids::JobId;

use crate::fake;

/// A client with one job.
pub(super) struct Client {
    pub(super) specification: Arc<JobSpecification>,
    pub(super) request_id: String,
    pub(super) job: Option<JobId>,
    /// It will cancel its job at some time.
    pub(super) cancels: bool,
    /// It has not received the end of its job yet.
    pub(super) wants_end: bool,
    /// Its job has ended, was checked, and is deleted.
    pub(super) pruned: bool,
}

/// Returns an identification, one in three by `newton`, which needs at least two realizations.
fn searched(method: u64, realizations: u64, evaluations: u64, seed: u64) -> JobSpecification {
    let mut specification = fake::identification(realizations, evaluations, seed);
    if method == 0 {
        specification.monte_carlo.realizations = realizations.max(2);
        let by = Search::by(SearchMethod::Newton);
        specification.search = Search { max_evaluations: evaluations, ..by };
    }
    // One in four has two groups, one in eight with thicknesses of their own; one in four has two starts,
    // one in two has derivatives.
    if seed.is_multiple_of(4) {
        let group = |name: &str, velocity: f64, thickness: f64| {
            let known = Some(thickness).filter(|_| seed.is_multiple_of(8));
            let known = KnownQuantities::new(
                Parameter::OF_SETUP.map(|one| known.filter(|_| one == Parameter::BoneThickness)),
            );
            Group { known, ..Group::new(name, vec![0.97 * velocity, 1.03 * velocity]) }
        };
        let groups = vec![group("left", 3900.0, 3e-3), group("right", 4000.0, 5e-3)];
        specification.data = Some(Data::from_groups(groups));
    }
    specification.search.starts = 1 + u64::from(seed % 4 == 1);
    specification.search.sensitivities = !seed.is_multiple_of(3);
    specification
}

/// Returns one to three clients with small jobs.
pub(super) fn some(seed: u64, draw: &mut impl FnMut(u64) -> u64) -> Vec<Client> {
    (0..1 + draw(3))
        .map(|number| {
            let specification = match draw(4) {
                0 => fake::propagation(1 + draw(60), 4 * seed + number),
                _ => searched(draw(3), 1 + draw(40), 2 + draw(12), 4 * seed + number),
            };
            let request_id = format!("request {number}");
            let cancels = draw(6) == 0;
            Client {
                specification: Arc::new(specification),
                request_id,
                job: None,
                cancels,
                wants_end: cancels,
                pruned: false,
            }
        })
        .collect()
}
