//! Studies that compare the solvers, the sampling methods ([`variance`]) and the search methods
//! ([`searches`]); each returns a [`MarkdownTable`]. The program `osteon-study` prints them. "The
//! paper" is Desceliers, Soize, Grimal, Talmant and Naili; see `docs/physics.md`.
//!
//! A study is a function of its draws alone: realizations are computed on all cores and processed
//! in index order, so that its numbers depend neither on threads nor on the instruction set.

#![forbid(unsafe_code)]

pub mod accuracy;
mod blocks;
pub mod continuity;
pub mod convergence;
pub mod designs;
pub mod digest;
mod draws;
mod error;
pub mod failures;
mod generator;
pub mod hierarchies;
mod identify;
pub mod methods;
pub mod models;
pub mod porosities;
pub mod posteriors;
pub mod refinement;
pub mod searches;
pub mod setup_errors;
pub mod setups;
pub mod signals;
mod spread;
pub mod stacks;
mod table;
pub mod twins;
pub mod variance;

pub use draws::{Draws, OPTIMUM};
pub use error::StudyError;
pub use table::MarkdownTable;

/// Callback that receives every completed row of a table.
pub type RowCallback<'a> = &'a dyn Fn(&str);
