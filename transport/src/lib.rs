//! Connections between the processes of osteon: endpoints, TLS and tokens, the files that hold them, and how long a
//! peer is waited for.

#![forbid(unsafe_code)]

pub mod certificates;
pub mod connection;
pub mod credential_file;
pub mod credentials;
pub mod endpoint;
mod error_causes;
pub mod patience;
mod pipe;
pub mod tls_failure;
pub mod token;
