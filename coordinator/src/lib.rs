//! Jobs, simplex, dispatch, reduction and the public gRPC API of osteon.
