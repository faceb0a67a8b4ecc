//! Protocol buffers of `osteon.v1`, and the one place where messages become `osteon-common`
//! types and back.

/// The generated messages, clients and servers of package `osteon.v1`.
#[expect(missing_docs, unreachable_pub, reason = "generated; comments come from the .proto files")]
pub mod v1 {
    tonic::include_proto!("osteon.v1");

    /// Encoded `FileDescriptorSet` of the package, for gRPC reflection.
    pub const FILE_DESCRIPTOR_SET: &[u8] =
        include_bytes!(concat!(env!("OUT_DIR"), "/osteon.v1.bin"));
}
