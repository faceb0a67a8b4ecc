//! What is solved in the process that asks, without a coordinator: [`simulation`] is one case, [`modes`] are
//! the guided waves of its bone in a [`frequency_band`] and [`shapes`] their fields across it, [`cost`]
//! estimates how long a job will take, [`design`] which measurement would tell most, [`reach`] which data are out of reach of its bounds, and
//! [`observations`] are the observables of its realizations, and [`synthesis`] records the signals of bones drawn by its law. None of it reaches a job or its result.

#![forbid(unsafe_code)]

pub mod cost;
pub mod design;
pub mod frequency_band;
pub mod modes;
pub mod observations;
pub mod reach;
pub mod shapes;
pub mod simulation;
pub mod source_traces;
pub mod synthesis;
