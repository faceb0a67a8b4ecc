//! Protocol buffers of `osteon.v1`, the one place where messages are converted to and from
//! `osteon-common` types.
//!
//! Messages from a peer are never trusted. A client's message is checked field by field, and all its
//! [violations](osteon_common::violations::Violations) are reported at once. A message from a coordinator or
//! a worker is well formed, or refused with a typed [`malformed::Malformed`].

#![forbid(unsafe_code)]

pub mod announced;
pub mod batch;
mod bone_sublayers;
pub mod choice;
pub mod draws;
pub mod evaluation;
mod fields;
pub mod history;
pub mod identity;
pub mod malformed;
pub mod observed;
pub mod parameter_values;
mod posterior_settings;
mod pulse;
pub mod realizations;
pub mod setup;
pub mod spans;
pub mod specification;
pub mod status;
pub mod timestamp;

/// The generated messages, clients and servers of package `osteon.v1`.
#[expect(
    clippy::large_enum_variant,
    clippy::allow_attributes,
    reason = "generated from the .proto files"
)]
pub mod v1 {
    tonic::include_proto!("osteon.v1");

    /// Encoded `FileDescriptorSet` of the package, for gRPC reflection.
    pub const FILE_DESCRIPTOR_SET: &[u8] =
        include_bytes!(concat!(env!("OUT_DIR"), "/osteon.v1.bin"));
}
