//! Version information: the part that must agree between the processes of one job, and the part
//! that a result records about the program that computed it.

/// Version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Revision of everything that influences a velocity's bits: ensemble, solver, picking. It must be
/// incremented with every intended change of a result's bits.
pub const NUMERICS_REVISION: u32 = 12;

/// Revision of the keys of all results in JSON, and of the columns of the accompanying tables. It
/// must be incremented if one is removed or renamed, or changes its meaning; it stays the same if a
/// key is added.
pub const RESULT_SCHEMA: u32 = 1;

/// Returns the fingerprint that a worker announces and that the coordinator compares with its own.
pub fn fingerprint() -> String {
    format!("osteon {VERSION} numerics {NUMERICS_REVISION}")
}

/// The program that computed a result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    /// Its version.
    pub version: String,
    /// Its numerics revision ([`NUMERICS_REVISION`]).
    pub numerics: u32,
    /// The commit from which it was built, with the suffix `-dirty` if the sources were modified;
    /// `None` if it was built outside a repository.
    pub commit: Option<String>,
}

impl Program {
    /// Returns the description of this program, built from `commit`.
    pub fn current(commit: Option<&str>) -> Self {
        Self {
            version: VERSION.to_owned(),
            numerics: NUMERICS_REVISION,
            commit: commit.map(str::to_owned),
        }
    }
}
