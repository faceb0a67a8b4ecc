//! Errors of reading a result, and of looking something up in it.

use osteon_common::field_path::quoted;
use osteon_common::version::RESULT_SCHEMA;
use thiserror::Error;

/// Longest cause that a message repeats: it may hold a value of the file.
const CAUSE_CHARACTERS_MAX: usize = 300;

/// Why a text is not the result of a job.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The text is not JSON.
    #[error("not valid JSON: {0}")]
    Syntax(serde_json::Error),
    /// The keys are those of another revision.
    #[error(
        "`schema` is {found}, and this program reads {RESULT_SCHEMA}; use the version of osteon that \
         wrote it"
    )]
    Schema {
        /// The revision of the file.
        found: u64,
    },
    /// The file is the result of something that is not a job.
    #[error("`kind` is {found}; it must be {allowed}")]
    Kind {
        /// The kind, in quotes.
        found: String,
        /// Those that can be read.
        allowed: &'static str,
    },
    /// The value of a key is not what it must be.
    #[error("{path}: {cause}")]
    Key {
        /// The keys that lead to the value, in backquotes, or that it is the whole.
        path: String,
        /// The reason, with line and column.
        cause: String,
    },
}

impl ReadError {
    pub(super) fn unknown_kind(kind: &str, allowed: &'static str) -> Self {
        Self::Kind { found: quoted(kind), allowed }
    }
}

impl From<serde_path_to_error::Error<serde_json::Error>> for ReadError {
    fn from(error: serde_path_to_error::Error<serde_json::Error>) -> Self {
        // A path without a key is a dot.
        let path = match error.path().iter().len() {
            0 => "the object".to_owned(),
            // A key that is no name has none to show.
            _ => {
                format!("`{}`", shortened(error.path().to_string().trim_end_matches(".?")))
            }
        };
        let cause = error.into_inner();
        if cause.is_data() {
            Self::Key { path, cause: shortened(&cause.to_string()) }
        } else {
            Self::Syntax(cause)
        }
    }
}

/// Why a result has no point to give.
#[derive(Debug, Error)]
pub enum BestPointError {
    /// There is no group of this name.
    #[error("there is no group {name:?}; the groups are {}", listed(.names))]
    UnknownGroup {
        /// The name.
        name: String,
        /// The names of the groups.
        names: Vec<String>,
    },
    /// A number of the point is null.
    #[error("the result has no best point: no evaluated point was feasible")]
    NoPointFound,
}

impl BestPointError {
    pub(super) fn unknown_group<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Self {
        Self::UnknownGroup { name: name.to_owned(), names: names.map(str::to_owned).collect() }
    }
}

/// Most groups that a message lists.
const LISTED_MAX: usize = 20;

/// Names in a message.
pub fn listed(names: &[String]) -> String {
    let mut shown: Vec<String> =
        names.iter().take(LISTED_MAX).map(|name| format!("{name:?}")).collect();
    if names.len() > LISTED_MAX {
        shown.push(format!("and {} more", names.len() - LISTED_MAX));
    }
    if shown.is_empty() { "none".to_owned() } else { shown.join(", ") }
}

/// The beginning and the end of a long text; the end has line and column.
fn shortened(text: &str) -> String {
    let count = text.chars().count();
    if count <= CAUSE_CHARACTERS_MAX {
        return text.to_owned();
    }
    let half = CAUSE_CHARACTERS_MAX / 2;
    let begin: String = text.chars().take(half).collect();
    let end: String = text.chars().skip(count - half).collect();
    format!("{begin}…{end}")
}
