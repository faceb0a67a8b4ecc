//! Tokens that a coordinator accepts: names, roles and hashes, read from a text. Hashes are
//! compared in constant time, so that the timing does not show how much of one was right.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use osteon_common::limits::{NAME_BYTES_MAX, TOKENS_MAX};
use osteon_common::visible;
use osteon_transport::credential_file::{self, CredentialError};
use osteon_transport::token::{PREFIX, Token, TokenHash};
use thiserror::Error;

/// This many consecutive hexadecimal digits may be a secret: half of those in a token.
const SECRET_DIGITS: usize = 32;

/// Permissions of a token's holder; each role includes those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// See every job and fetch every result.
    Read,
    /// Submit and cancel jobs.
    Submit,
    /// Call every method.
    Admin,
}

/// The accepted tokens.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Tokens(Vec<Entry>);

/// Holder of a token.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TokenHolder {
    /// The name, for logs.
    pub name: String,
    /// The holder's permissions.
    pub role: Role,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Entry {
    holder: TokenHolder,
    hash: TokenHash,
}

/// Error of a file of tokens. Messages contain nothing from the file but names and roles.
#[derive(Debug, Error)]
pub enum TokensError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] CredentialError),
    /// A line cannot be read.
    #[error("{}: line {line} {fault}", visible::path(path))]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The fault of the line.
        fault: LineFault,
    },
    /// The file holds no token, so nobody could use the coordinator.
    #[error("{} holds no tokens; `osteon token` makes one", visible::path(path))]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file holds more tokens than are allowed.
    #[error("{} holds more than {max} tokens", visible::path(path))]
    TooMany {
        /// The file.
        path: PathBuf,
        /// Maximum number of tokens.
        max: usize,
    },
}

/// Fault of a line in a file of tokens.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LineFault {
    /// The line does not have three words.
    #[error("has {words} words; it must be `NAME ROLE HASH`, as `osteon token` prints it")]
    Words {
        /// Number of words.
        words: usize,
    },
    /// The name is unusable.
    #[error(
        "has no usable name; allowed are 1 to {NAME_BYTES_MAX} letters, digits and `.`, `_`, `-`, `@`, \
         without `{PREFIX}` and without {SECRET_DIGITS} hexadecimal digits in a row"
    )]
    Name,
    /// The role is unknown.
    #[error("gives `{name}` an unknown role; allowed are read, submit, admin")]
    Role {
        /// Name of the token.
        name: String,
    },
    /// The token itself stands where its hash should.
    #[error(
        "holds the token of `{name}` itself, not its hash; make a new token with `osteon token`, \
         which prints the hash"
    )]
    TokenItself {
        /// Name of the token.
        name: String,
    },
    /// The hash is not valid.
    #[error("gives `{name}` an invalid hash (it must be `blake3:` and 64 hexadecimal digits)")]
    Hash {
        /// Name of the token.
        name: String,
    },
    /// Another line has the same hash.
    #[error("gives `{name}` a token that line {first} has already")]
    Twice {
        /// Name of the token.
        name: String,
        /// The other line, from 1.
        first: usize,
    },
}

impl Tokens {
    /// Reads the file of tokens at `path`.
    ///
    /// # Errors
    /// When it cannot be read, holds no token, or a line is wrong.
    pub fn read(path: &Path) -> Result<Self, TokensError> {
        let text = credential_file::secret_text(path)?;
        Self::parse(&text, path)
    }

    /// Adds a token with the role `admin`, read from the file that its holder uses too.
    ///
    /// # Errors
    /// When the file cannot be used.
    pub fn with_admin(mut self, path: &Path) -> Result<Self, TokensError> {
        let token = credential_file::token(path)?;
        let holder = TokenHolder { name: "token-file".to_owned(), role: Role::Admin };
        self.0.push(Entry { holder, hash: token.hash() });
        Ok(self)
    }

    /// Returns the number of accepted tokens.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Returns the holder of a token. Every hash is compared, each in constant time.
    pub fn holder(&self, text: &str) -> Option<&TokenHolder> {
        let hash = Token::parse(text).ok()?.hash();
        let mut found = None;
        for entry in &self.0 {
            if entry.hash == hash {
                found = Some(&entry.holder);
            }
        }
        found
    }

    fn parse(text: &str, path: &Path) -> Result<Self, TokensError> {
        let mut entries = Vec::new();
        let mut lines: BTreeMap<String, usize> = BTreeMap::new();
        for (line, words) in text.lines().enumerate() {
            let line = line + 1;
            let words = words.split('#').next().unwrap_or_default();
            if words.trim().is_empty() {
                continue;
            }
            let line_error = |fault| TokensError::Line { path: path.to_owned(), line, fault };
            let entry = entry(words).map_err(line_error)?;
            if let Some(first) = lines.insert(entry.hash.to_string(), line) {
                return Err(line_error(LineFault::Twice { name: entry.holder.name, first }));
            }
            if entries.len() == TOKENS_MAX {
                return Err(TokensError::TooMany { path: path.to_owned(), max: TOKENS_MAX });
            }
            entries.push(entry);
        }
        if entries.is_empty() {
            return Err(TokensError::Empty { path: path.to_owned() });
        }
        Ok(Self(entries))
    }
}

impl Role {
    /// Returns the name as written in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Submit => "submit",
            Self::Admin => "admin",
        }
    }

    /// Returns the role with this name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Read, Self::Submit, Self::Admin].into_iter().find(|role| role.name() == name)
    }
}

/// Returns whether a token can have this name. Names are shown, so one that may be a token, or most
/// of one, is not allowed.
pub fn is_name(name: &str) -> bool {
    let is_allowed = |byte: u8| byte.is_ascii_alphanumeric() || b"._-@".contains(&byte);
    (1..=NAME_BYTES_MAX).contains(&name.len())
        && name.bytes().all(is_allowed)
        && !name.contains(PREFIX)
        && !name.split(|c: char| !c.is_ascii_hexdigit()).any(|run| run.len() >= SECRET_DIGITS)
}

/// Returns a line for a file of tokens.
pub fn line(name: &str, role: Role, hash: &TokenHash) -> String {
    format!("{name} {} {hash}", role.name())
}

fn entry(text: &str) -> Result<Entry, LineFault> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let [name, role, hash] = words[..] else {
        return Err(LineFault::Words { words: words.len() });
    };
    if !is_name(name) {
        return Err(LineFault::Name);
    }
    let name = name.to_owned();
    let Some(role) = Role::named(role) else { return Err(LineFault::Role { name }) };
    if Token::parse(hash).is_ok() {
        return Err(LineFault::TokenItself { name });
    }
    let Some(hash) = TokenHash::parse(hash) else { return Err(LineFault::Hash { name }) };
    Ok(Entry { holder: TokenHolder { name, role }, hash })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Tokens, String> {
        Tokens::parse(text, Path::new("tokens")).map_err(|error| error.to_string())
    }

    #[test]
    fn each_token_has_its_holder() {
        let tokens: Vec<_> = (0..3).map(|_| Token::generate().unwrap()).collect();
        let lines = [("ann", Role::Read), ("bob@lab", Role::Submit), ("root", Role::Admin)];
        let text: String = lines
            .iter()
            .zip(&tokens)
            .map(|((name, role), token)| line(name, *role, &token.hash()) + "  # since May\n\n")
            .collect();
        let read = parse(&format!("# tokens\n{text}")).unwrap();
        for ((name, role), token) in lines.iter().zip(&tokens) {
            let holder = read.holder(token.reveal()).unwrap();
            assert_eq!((holder.name.as_str(), holder.role), (*name, *role));
            let hash = token.hash().to_string();
            assert!(read.holder(&hash).is_none(), "a hash is no token");
        }
        assert_eq!(read.holder(Token::generate().unwrap().reveal()), None);
        assert_eq!(read.holder(""), None);
    }

    #[test]
    fn a_wrong_line_is_named_and_never_shown() {
        let token = Token::generate().unwrap();
        let (secret, hash) = (token.reveal(), token.hash());
        let long = "n".repeat(NAME_BYTES_MAX + 1);
        for (text, expected) in [
            (String::new(), "holds no tokens"),
            ("# nobody\n".to_owned(), "holds no tokens"),
            (format!("\nann read\n{hash}"), "line 2 has 2 words"),
            (format!("ann read {hash} more"), "line 1 has 4 words"),
            (secret.to_owned(), "line 1 has 1 words"),
            (format!("ann/ read {hash}"), "no usable name"),
            (format!("{long} read {hash}"), "no usable name"),
            (format!("{secret} read {hash}"), "no usable name"),
            (format!("{} read {hash}", &secret[..40]), "no usable name"),
            (format!("o{secret} read {hash}"), "no usable name"),
            (format!("{} read {hash}", &secret[7..]), "no usable name"),
            (format!("ann write {hash}"), "gives `ann` an unknown role"),
            (format!("ann {secret} {hash}"), "gives `ann` an unknown role"),
            (format!("ann read {secret}"), "holds the token of `ann` itself"),
            ("ann read blake3:12".to_owned(), "an invalid hash"),
            (
                format!("ann read {hash}\n\nbob read {hash}"),
                "line 3 gives `bob` a token that line 1",
            ),
        ] {
            let error = parse(&text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
            assert!(!error.contains(&secret[..40]), "{error}");
        }
    }

    #[test]
    fn a_file_has_a_bound() {
        let line = |i: usize| format!("n{i} read {}\n", TokenHash::parse(&hash(i)).unwrap());
        let at: String = (0..TOKENS_MAX).map(line).collect();
        assert!(parse(&at).is_ok());
        let error = parse(&(at + &line(TOKENS_MAX))).unwrap_err();
        assert!(error.contains("more than 10000"), "{error}");
    }

    fn hash(i: usize) -> String {
        format!("blake3:{i:064x}")
    }
}
