//! Limits on the content of a document, because a tree takes many times the memory of its text.

use std::fmt;

use osteon_common::limits::{DOCUMENT_KEYS_MAX, DOCUMENT_VALUES_MAX, TOML_TOKENS_MAX};

/// The limit that a document exceeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Excess {
    /// Number of open brackets.
    Nesting,
    /// Number of values.
    Values,
    /// Number of keys, tables and lists.
    Keys,
    /// Number of words, punctuation marks, spaces, comments and line ends.
    Tokens,
}

impl fmt::Display for Excess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const NEEDED: &str = "more than any job needs";
        match self {
            Self::Nesting => f.write_str("too many nested brackets"),
            Self::Values => {
                write!(f, "this value comes after {DOCUMENT_VALUES_MAX} others, {NEEDED}")
            }
            Self::Keys => write!(
                f,
                "this key, table or list comes after {DOCUMENT_KEYS_MAX} others, {NEEDED}"
            ),
            Self::Tokens => write!(
                f,
                "the text before this place has {TOML_TOKENS_MAX} tokens (words, punctuation, \
                 spaces, comments, line ends), {NEEDED}; data.velocities may name a CSV file"
            ),
        }
    }
}

/// The number of values, keys, tables and lists that a document may still have.
#[derive(Debug)]
pub(super) struct Budget {
    values: usize,
    keys: usize,
}

impl Budget {
    /// Creates the full budget.
    pub(super) fn new() -> Self {
        Self { values: DOCUMENT_VALUES_MAX, keys: DOCUMENT_KEYS_MAX }
    }

    /// Takes one value off the budget.
    ///
    /// # Errors
    /// If there is no more room.
    pub(super) fn value(&mut self) -> Result<(), Excess> {
        self.values = self.values.checked_sub(1).ok_or(Excess::Values)?;
        Ok(())
    }

    /// Takes `count` keys, tables or lists off the budget.
    ///
    /// # Errors
    /// If there is not enough room.
    pub(super) fn keys(&mut self, count: usize) -> Result<(), Excess> {
        self.keys = self.keys.checked_sub(count).ok_or(Excess::Keys)?;
        Ok(())
    }
}
