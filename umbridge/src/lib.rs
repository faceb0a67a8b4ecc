//! A server of the UM-Bridge protocol, version 1.0: the model of a job as functions over HTTP, for
//! samplers and other programs in any language.
//!
//! `listener` accepts connections, within the bounds of `crowd`, `gate` refuses what pages in browsers
//! send, `routes` and `answers` answer requests, `functions` knows what each model computes, and `evaluator` has its
//! realizations computed by the workers of a coordinator.

#![forbid(unsafe_code)]

mod answers;
mod crowd;
mod derivatives;
mod deterministic;
mod evaluator;
mod functions;
mod gate;
mod input_space;
mod listener;
mod model;
mod protocol_error;
mod request_config;
mod request_fields;
mod routes;

pub use self::evaluator::Evaluator;
pub use self::functions::ServedJob;
pub use self::listener::{ModelBindError, ModelListener};
pub use self::routes::router;
pub use osteon_http::OwnHosts;
