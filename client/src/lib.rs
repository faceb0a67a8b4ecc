//! A client of osteon: submits jobs to a coordinator, follows them, fetches their results and keeps them in
//! directories; or runs a coordinator and workers in this process for one job.
//!
//! ```no_run
//! use std::path::Path;
//! use std::sync::Arc;
//!
//! use osteon_client::client::{Client, ClientError, Remote, SubmitOptions};
//! use osteon_client::listener::Silent;
//! use osteon_client::request_id::RequestId;
//! use osteon_common::job::JobKind;
//! use osteon_files::job_file;
//!
//! # async fn example() -> Result<(), Box<dyn std::error::Error>> {
//! let job = job_file::read(Path::new("job.toml"), JobKind::Identification)?;
//! let remote = Remote::at("http://127.0.0.1:7878".parse()?);
//! let mut client = Client::connect(&remote, Arc::new(Silent)).await?;
//! let id = client.submit(&job, &RequestId::new()?, SubmitOptions::default()).await?;
//! client.watch(&id, |_| Ok::<_, ClientError>(())).await?;
//! println!("{}", client.fetch(&id).await?.result.digest());
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]

pub mod client;
pub mod embedded;
pub mod environment;
pub mod error;
pub mod fetched;
#[cfg(test)]
mod fuzz;
pub mod job_point;
pub mod listener;
pub mod operators;
pub mod other_version;
mod parts;
mod peer;
pub mod remote;
#[cfg(feature = "report")]
pub mod report_directory;
pub mod request_id;
pub mod result_files;
pub mod result_status;
pub mod results_directory;
pub mod run;
pub mod run_error;
#[cfg(test)]
mod sample_result;
pub mod simulation_directory;
