//! Whether a coordinator answers.

use std::time::{Duration, Instant};

use osteon_client::client::Remote;
use osteon_client::operators;

use super::Diagnosis;

use crate::user;

const CHECK: &str = "coordinator";
/// Longest wait for the answer.
const LIMIT: Duration = Duration::from_secs(10);
/// An answer that takes longer slows down a search, which waits for workers in each evaluation.
const SLOW: Duration = Duration::from_millis(250);

/// Asks the coordinator for its health.
pub(super) async fn examine(coordinator: &Remote) -> Diagnosis {
    let endpoint = &coordinator.endpoint;
    let begun = Instant::now();
    match operators::health(coordinator, LIMIT, user::listener()).await {
        Ok(true) if begun.elapsed() > SLOW => Diagnosis::warning(
            CHECK,
            format!("{endpoint} serves, after {:.0} ms", 1e3 * begun.elapsed().as_secs_f64()),
            "look at the network: batches and answers take as long",
        ),
        Ok(true) => Diagnosis::good(CHECK, format!("{endpoint} serves")),
        Ok(false) => Diagnosis::problem(
            CHECK,
            format!("{endpoint} answers that it is not serving"),
            "look at the log of the coordinator",
        ),
        Err(error) => Diagnosis::problem(
            CHECK,
            error.to_string(),
            "check address and credentials, and that the coordinator runs there (docs/network.md)",
        ),
    }
}
