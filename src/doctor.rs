//! What `doctor` examines: this machine, the directory of a store, and a coordinator.

mod machine;
mod numerics;
mod reachable;
mod storage;

use std::path::PathBuf;
use std::time::Duration;

use osteon_client::client::Remote;
use osteon_solver::Isa;

/// Longest wait for a directory, which may be on a server that does not answer.
const DIRECTORY_LIMIT: Duration = Duration::from_secs(30);

/// What a check says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Fitness {
    /// All is as it should be.
    Good,
    /// It works, but not as well as it might.
    Warning,
    /// It does not work.
    Problem,
}

impl Fitness {
    /// Returns the name for people and programs.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Good => "ok",
            Self::Warning => "warning",
            Self::Problem => "problem",
        }
    }
}

/// The outcome of one check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Diagnosis {
    /// Name of the check.
    pub(crate) check: &'static str,
    /// What it says.
    pub(crate) verdict: Fitness,
    /// What was found.
    pub(crate) found: String,
    /// What to do about it.
    pub(crate) advice: Option<String>,
}

impl Diagnosis {
    fn good(check: &'static str, found: impl Into<String>) -> Self {
        Self { check, verdict: Fitness::Good, found: found.into(), advice: None }
    }

    fn warning(check: &'static str, found: impl Into<String>, advice: impl Into<String>) -> Self {
        let advice = Some(advice.into());
        Self { check, verdict: Fitness::Warning, found: found.into(), advice }
    }

    fn problem(check: &'static str, found: impl Into<String>, advice: impl Into<String>) -> Self {
        let advice = Some(advice.into());
        Self { check, verdict: Fitness::Problem, found: found.into(), advice }
    }
}

/// What is to be examined.
#[derive(Debug)]
pub(crate) struct Patient {
    /// Directory of a store, if there is to be one.
    pub(crate) store: Option<PathBuf>,
    /// The coordinator to ask, if there is one.
    pub(crate) coordinator: Option<Remote>,
    /// The instruction set on which this machine computes.
    pub(crate) isa: Isa,
}

/// Runs all checks.
pub(crate) async fn examine(patient: Patient) -> Vec<Diagnosis> {
    let isa = patient.isa;
    let mut diagnoses = vec![machine::program(), machine::cores(), machine::instruction_set(isa)];
    let numerics = tokio::task::spawn_blocking(move || numerics::examine(isa)).await;
    diagnoses.push(numerics.unwrap_or_else(|error| {
        Diagnosis::problem("numerics", error.to_string(), "please report this")
    }));
    diagnoses.push(machine::open_files());
    diagnoses.push(machine::clock(std::time::SystemTime::now()));
    let temporary = std::env::temp_dir();
    diagnoses.push(within_limit("temporary", move || storage::temporary(&temporary)).await);
    if let Some(store) = patient.store {
        diagnoses.push(within_limit("store", move || storage::examine(&store)).await);
    }
    if let Some(coordinator) = &patient.coordinator {
        diagnoses.push(reachable::examine(coordinator).await);
    }
    diagnoses
}

/// Returns the worst verdict.
pub(crate) fn worst(diagnoses: &[Diagnosis]) -> Fitness {
    diagnoses.iter().map(|diagnosis| diagnosis.verdict).max().unwrap_or(Fitness::Good)
}

/// Runs a check of a directory, or says that it does not answer.
async fn within_limit(
    check: &'static str,
    examine: impl FnOnce() -> Diagnosis + Send + 'static,
) -> Diagnosis {
    let examined = tokio::task::spawn_blocking(examine);
    match tokio::time::timeout(DIRECTORY_LIMIT, examined).await {
        Ok(Ok(diagnosis)) => diagnosis,
        Ok(Err(error)) => Diagnosis::problem(check, error.to_string(), "please report this"),
        Err(_) => Diagnosis::problem(
            check,
            format!("no answer within {} s", DIRECTORY_LIMIT.as_secs()),
            "choose a directory on a disk of this machine",
        ),
    }
}
