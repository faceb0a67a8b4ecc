//! Limits on nesting and content of a text, checked before it is parsed.
//!
//! The parser limits nesting, too, but its error recovery miscounts: `x = { y = 1 z` followed by
//! `[l]`, some thousand times, would exhaust the stack. It has no limit on memory, of which it
//! takes 60 bytes for each word and punctuation mark, and up to a kilobyte for each table.

use osteon_common::limits::TOML_TOKENS_MAX;
use toml_parser::Source;
use toml_parser::lexer::TokenKind;

use crate::document::budget::{Budget, Excess};

/// Maximum number of open brackets: as many as the parser allows in a text without errors.
const OPEN_MAX: usize = 80;

/// Refuses a text that is nested too deeply or has too much content; returns the byte offset of the
/// excess.
pub(super) fn check(text: &str) -> Result<(), (usize, Excess)> {
    let mut counts = ContentCounts { open: Vec::new(), dots: 0, budget: Budget::new() };
    for (count, token) in Source::new(text).lex().enumerate() {
        let within = if count < TOML_TOKENS_MAX { Ok(()) } else { Err(Excess::Tokens) };
        let within = within.and_then(|()| counts.take(token.kind()));
        within.map_err(|excess| (token.span().start(), excess))?;
    }
    Ok(())
}

/// ContentCounts of the text read so far.
struct ContentCounts {
    /// Open brackets. A closing bracket that matches none is ignored, so the count is never below
    /// the parser's nesting depth, however it interprets a malformed text.
    open: Vec<TokenKind>,
    /// Dots since the last punctuation mark: those of `a.b.c` before `=` or `]` open tables.
    dots: usize,
    budget: Budget,
}

impl ContentCounts {
    fn take(&mut self, kind: TokenKind) -> Result<(), Excess> {
        match kind {
            TokenKind::Dot => self.dots += 1,
            TokenKind::LeftSquareBracket | TokenKind::LeftCurlyBracket => {
                if self.open.len() == OPEN_MAX {
                    return Err(Excess::Nesting);
                }
                self.open.push(kind);
                self.dots = 0;
                self.budget.keys(1)?;
            }
            TokenKind::RightSquareBracket => {
                self.close(TokenKind::LeftSquareBracket);
                self.budget.keys(std::mem::take(&mut self.dots))?;
            }
            TokenKind::RightCurlyBracket => self.close(TokenKind::LeftCurlyBracket),
            TokenKind::Equals => self.budget.keys(1 + std::mem::take(&mut self.dots))?,
            TokenKind::Comma => {
                self.dots = 0;
                self.budget.value()?;
            }
            TokenKind::Newline => self.dots = 0,
            _ => {}
        }
        Ok(())
    }

    fn close(&mut self, opening: TokenKind) {
        if self.open.last() == Some(&opening) {
            self.open.pop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bracket_that_is_one_too_many_is_found() {
        let check = |text: &str, offset: Option<usize>| {
            let expected = offset.map_or(Ok(()), |offset| Err((offset, Excess::Nesting)));
            assert_eq!(super::check(text), expected, "{text:.80}");
        };
        check("[a]\nb = [[1], { c = [] }]\n# [[[[\nd = '[[[['\n", None);
        check(&"[a]\nb = [1]\n".repeat(1000), None);
        check(&"[".repeat(80), None);
        check(&"[".repeat(81), Some(80));
        check(&"{".repeat(81), Some(80));
        // A closing bracket of the wrong kind is ignored.
        check(&"{]".repeat(81), Some(160));
        check(&"# [\n'['\n\"[\"\n".repeat(100), None);
    }

    #[test]
    fn a_parser_that_loses_count_is_not_asked() {
        for unit in ["x = { y = 1 z\n[l]\n", "a = { b = [ } ]\n[l]\n", "a = {b=1, c =d e\n[l]\n"] {
            assert!(super::super::parse(&unit.repeat(20_000)).is_err(), "{unit}");
        }
    }

    #[test]
    fn what_is_one_too_many_is_found() {
        use osteon_common::limits::{DATA_VELOCITIES_MAX, DOCUMENT_KEYS_MAX, DOCUMENT_VALUES_MAX};
        let found = |text: &str| check(text).err();
        let keys = "k = 1\n".repeat(DOCUMENT_KEYS_MAX);
        assert_eq!(found(&keys), None);
        assert_eq!(found(&format!("{keys}k = 1\n")), Some((keys.len() + 2, Excess::Keys)));
        for unit in ["[a]\n", "a.b.c.d.e.f=1\n", "[a.b]\n", "a=[1.5]\n", "=\n", "[[]]\n"] {
            let text = unit.repeat(DOCUMENT_KEYS_MAX + 1);
            assert!(matches!(found(&text), Some((_, Excess::Keys))), "{unit}");
        }
        // Decimal points in a list do not count as keys.
        let values = format!("a = [{}]", "    3900.5,\n".repeat(DATA_VELOCITIES_MAX));
        assert_eq!(found(&values), None);
        let values = format!("a = [{}]", "1,".repeat(DOCUMENT_VALUES_MAX + 1));
        assert_eq!(found(&values), Some((values.len() - 2, Excess::Values)));
        let words = "a ".repeat(TOML_TOKENS_MAX / 2 + 1);
        assert_eq!(found(&words), Some((TOML_TOKENS_MAX, Excess::Tokens)));
    }
}
