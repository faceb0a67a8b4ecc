//! What must agree between the processes of one job, and what a result says of the program that
//! computed it.

/// Version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Revision of everything that decides a velocity's bits: ensemble, solver, picking. Raised by
/// whoever changes a bit of a result on purpose.
pub const NUMERICS_REVISION: u32 = 5;

/// Revision of the keys of all results in JSON, and of the columns of the tables beside them. Raised
/// by whoever renames or removes one, or changes what it means; a key that is added leaves it as it is.
pub const RESULT_SCHEMA: u32 = 1;

/// Fingerprint that a worker announces and the coordinator compares with its own.
pub fn fingerprint() -> String {
    format!("osteon {VERSION} numerics {NUMERICS_REVISION}")
}

/// The program that computed a result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    /// Its version.
    pub version: String,
    /// Its [`NUMERICS_REVISION`].
    pub numerics: u32,
    /// The commit that it was built from, with `-dirty` behind it if the sources were modified;
    /// `None` if it was built outside a repository.
    pub commit: Option<String>,
}

impl Program {
    /// This program, built from `commit`.
    pub fn this(commit: Option<&str>) -> Self {
        Self {
            version: VERSION.to_owned(),
            numerics: NUMERICS_REVISION,
            commit: commit.map(str::to_owned),
        }
    }
}
