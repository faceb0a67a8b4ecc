//! What must agree between the processes of one job.

/// Version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Revision of everything that decides a velocity's bits: ensemble, solver, picking. Raised by
/// whoever changes a bit of a result on purpose.
pub const NUMERICS_REVISION: u32 = 5;

/// Fingerprint that a worker announces and the coordinator compares with its own.
pub fn fingerprint() -> String {
    format!("osteon {VERSION} numerics {NUMERICS_REVISION}")
}
