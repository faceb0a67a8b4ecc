//! A bound on nesting, held before a text is parsed.
//!
//! The parser has one, too, but its recovery from errors loses count: `x = { y = 1 z` followed by
//! `[l]`, some thousand times, would take all of the stack.

use toml_parser::Source;
use toml_parser::lexer::TokenKind;

/// Most brackets that may be open: as many as the parser allows in a text without errors.
const OPEN_MAX: usize = 80;

/// Byte offset of the first bracket that opens a level too many, if there is one.
///
/// A bracket that closes what is not open closes nothing. So the count is never below the number
/// of levels that a parser is in, whatever it takes a wrong text for.
pub(super) fn too_deep(text: &str) -> Option<usize> {
    let mut open = Vec::new();
    for token in Source::new(text).lex() {
        let kind = token.kind();
        let opening = match kind {
            TokenKind::LeftSquareBracket | TokenKind::LeftCurlyBracket => {
                if open.len() == OPEN_MAX {
                    return Some(token.span().start());
                }
                open.push(kind);
                continue;
            }
            TokenKind::RightSquareBracket => TokenKind::LeftSquareBracket,
            TokenKind::RightCurlyBracket => TokenKind::LeftCurlyBracket,
            _ => continue,
        };
        if open.last() == Some(&opening) {
            open.pop();
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bracket_that_is_one_too_many_is_found() {
        let check = |text: &str, expected| assert_eq!(too_deep(text), expected, "{text:.80}");
        check("[a]\nb = [[1], { c = [] }]\n# [[[[\nd = '[[[['\n", None);
        check(&"[a]\nb = [1]\n".repeat(1000), None);
        check(&"[".repeat(80), None);
        check(&"[".repeat(81), Some(80));
        check(&"{".repeat(81), Some(80));
        // What closes something else closes nothing.
        check(&"{]".repeat(81), Some(160));
        check(&"# [\n'['\n\"[\"\n".repeat(100), None);
    }

    #[test]
    fn a_parser_that_loses_count_is_not_asked() {
        for unit in ["x = { y = 1 z\n[l]\n", "a = { b = [ } ]\n[l]\n", "a = {b=1, c =d e\n[l]\n"] {
            assert!(super::super::parse(&unit.repeat(20_000)).is_err(), "{unit}");
        }
    }
}
