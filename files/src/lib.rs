//! The files of osteon's users: they are read, checked and written here.
//!
//! Jobs and cases in TOML or JSON ([`job_file`], [`case_file`]), measured velocities in CSV, and the
//! results of jobs in JSON ([`report`]) and CSV ([`results_csv`]); published stiffness by name
//! ([`materials`]). The checks themselves are in `osteon-common`, because specifications that come as
//! messages must pass them, too.
//!
//! Every file that a user names is opened by [`user_file`].

#![forbid(unsafe_code)]

pub mod arrays;
mod bone_structure;
pub mod case_file;
pub mod document;
mod document_text;
pub mod excerpt;
pub mod file_error;
pub mod file_kind;
pub mod init;
pub mod input_file;
pub mod job_file;
pub mod materials;
pub mod picking_comment;
pub mod posterior_csv;
pub mod probe_file;
mod pulse;
mod pulse_file;
mod reader;
pub mod report;
pub mod results_csv;
pub mod setting;
mod solid;
mod sublayers;
mod toml_text;
pub mod user_file;
mod velocities;
