//! Searches as ask/tell state machines: which point to evaluate next, what its outcomes mean, and
//! when to stop.
//!
//! [`Search`] decides the path of a job. It asks a method ([`simplex`] or [`newton`]) for points in
//! the box of the free parameters ([`search_box`]). [`identify()`] runs a whole job in one call,
//! for programs that compute the realizations themselves. Nothing here depends on a solver, a
//! worker, a clock or a file: a search is a function of its specification and of the outcomes
//! passed to it.

#![forbid(unsafe_code)]

mod expected;
mod identify;
pub mod newton;
mod posterior;
pub mod proposal;
mod search;
pub mod search_box;
pub mod simplex;

pub use expected::ExpectedEvaluations;
pub use identify::{CompletedJob, IdentifyError, Realizations, identify};
pub use posterior::{PosteriorDensity, prior_deviation};
pub use search::{Assessment, Branch, Ending, ReplayError, Search, Step, Summary, same_point};
