//! Bearer tokens of clients (256 random bits as text), and the hashes by which a coordinator
//! recognizes them. Nothing here prints a token.

use std::fmt;

use thiserror::Error;
use zeroize::Zeroizing;

use osteon_proto::identity::{self, NoRandomness};

/// Prefix of every token, by which scanners for leaked secrets can find it.
pub const PREFIX: &str = "osteon_";
/// Number of random bytes of a token.
const RANDOM_BYTES: usize = 32;
/// Length of a token in characters: the prefix and two hexadecimal digits for each byte.
const TOKEN_CHARACTERS: usize = PREFIX.len() + 2 * RANDOM_BYTES;
/// Prefix of the hash in a line of the token list.
const HASH_PREFIX: &str = "blake3:";

/// A token. It has so many random bits that a fast hash is safe; therefore only tokens of the form
/// of [`Token::generate`] are accepted, never a password chosen by a person. Its memory is overwritten when it is
/// dropped.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(Zeroizing<String>);

/// The text is not a token. The error does not contain the text, which may be another secret.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "is not a valid osteon token (`{PREFIX}` and {} hexadecimal digits, as `osteon token` makes them)",
    2 * RANDOM_BYTES
)]
pub struct NoToken;

/// The BLAKE3 hash of a token. Comparing two takes the same time wherever they differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TokenHash(blake3::Hash);

impl Token {
    /// Creates a random token.
    ///
    /// # Errors
    /// If the operating system provides no random numbers.
    pub fn generate() -> Result<Self, NoRandomness> {
        let bytes = Zeroizing::new(identity::random_bytes::<RANDOM_BYTES>()?);
        // Long enough from the beginning: a text that moves leaves a copy behind.
        let mut text = Zeroizing::new(String::with_capacity(TOKEN_CHARACTERS));
        text.push_str(PREFIX);
        let digits = bytes.iter().flat_map(|byte| [byte >> 4, byte & 15]);
        text.extend(digits.filter_map(|digit| char::from_digit(u32::from(digit), 16)));
        Ok(Self(text))
    }

    /// Parses a token, without surrounding white space.
    ///
    /// # Errors
    /// If the text is not a token.
    pub fn parse(text: &str) -> Result<Self, NoToken> {
        let text = text.trim();
        let digits = text.strip_prefix(PREFIX).ok_or(NoToken)?;
        let hexadecimal = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
        if text.len() != TOKEN_CHARACTERS || !digits.bytes().all(hexadecimal) {
            return Err(NoToken);
        }
        Ok(Self(Zeroizing::new(text.to_owned())))
    }

    /// Returns the token's hash.
    pub fn hash(&self) -> TokenHash {
        TokenHash(blake3::hash(self.0.as_bytes()))
    }

    /// Returns the token itself, for the one file or the one header that contains it.
    pub fn reveal(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(…)")
    }
}

impl TokenHash {
    /// Parses a hash in the form that [`Display`](fmt::Display) writes.
    pub fn parse(text: &str) -> Option<Self> {
        let digits = text.strip_prefix(HASH_PREFIX)?;
        blake3::Hash::from_hex(digits).ok().map(Self)
    }
}

impl fmt::Display for TokenHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{HASH_PREFIX}{}", self.0.to_hex())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_read_or_refused() {
        let digits = "0123456789abcdef".repeat(4);
        let good = format!("osteon_{digits}");
        assert_eq!(Token::parse(&format!(" {good}\n")).unwrap().reveal(), good);
        for bad in [
            String::new(),
            "secret".to_owned(),
            digits.clone(),
            format!("osteon_{}", &digits[1..]),
            format!("osteon_{digits}0"),
            format!("osteon_{}", digits.to_uppercase()),
            format!("Osteon_{digits}"),
            format!("osteon_{}é", &digits[2..]),
        ] {
            assert_eq!(Token::parse(&bad), Err(NoToken), "{bad}");
        }
    }

    #[test]
    fn two_tokens_differ_and_neither_is_printed() {
        let (one, other) = (Token::generate().unwrap(), Token::generate().unwrap());
        assert_eq!(Token::parse(one.reveal()), Ok(one.clone()));
        assert_ne!(one, other);
        assert_ne!(one.hash(), other.hash());
        assert_eq!(TokenHash::parse(&one.hash().to_string()), Some(one.hash()));
        assert!(!format!("{one:?} {}", one.hash()).contains(&one.reveal()[PREFIX.len()..]));
    }

    #[test]
    fn what_is_no_hash_is_refused() {
        let hash = Token::generate().unwrap().hash().to_string();
        for bad in ["", "blake3:", &hash[1..], &hash[..hash.len() - 1], "blake3:é"] {
            assert_eq!(TokenHash::parse(bad), None, "{bad}");
        }
    }
}
