//! Untrusted text on a terminal or in a log: characters that are invisible, or change how the rest
//! is displayed, are escaped.
//!
//! Names of files, keys and values of a job file, names of groups, hosts and clients, and messages
//! of a peer may contain escape sequences, marks that change the direction of writing, and
//! invisible characters. Unescaped, they could hide or forge the displayed text.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

/// Returns `text` as one line, with each character that [`is_hidden`] as an escape such as
/// `\u{202e}`.
pub fn line(text: &str) -> Cow<'_, str> {
    escaped(text, is_hidden)
}

/// Same as [`line()`], but keeps the line feeds of `text`: for messages that have several lines.
pub fn lines(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c != '\n' && is_hidden(c))
}

/// Returns a path as [`line()`] does; bytes that are not UTF-8 are shown as U+FFFD.
pub fn path(path: &Path) -> String {
    line(&path.to_string_lossy()).into_owned()
}

fn escaped(text: &str, hidden: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&hidden) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        // Writing to a string does not fail.
        let _infallible = match c {
            '\n' | '\r' | '\t' if hidden(c) => write!(shown, "{}", c.escape_default()),
            _ if hidden(c) => write!(shown, "{}", c.escape_unicode()),
            _ => shown.write_char(c),
        };
    }
    Cow::Owned(shown)
}

/// Returns whether a character is a control character, ends a line, changes the direction of
/// writing, or is displayed as nothing (Unicode's `Cc`, `Zl`, `Zp`, `Bidi_Control`,
/// `Default_Ignorable_Code_Point`, and the marks of annotations).
pub fn is_hidden(c: char) -> bool {
    c.is_control()
        || matches!(
            c,
            '\u{ad}'
                | '\u{34f}'
                | '\u{61c}'
                | '\u{115f}'..='\u{1160}'
                | '\u{17b4}'..='\u{17b5}'
                | '\u{180b}'..='\u{180f}'
                | '\u{200b}'..='\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}'
                | '\u{3164}'
                | '\u{fe00}'..='\u{fe0f}'
                | '\u{feff}'
                | '\u{ffa0}'
                | '\u{fff0}'..='\u{fffb}'
                | '\u{1bca0}'..='\u{1bca3}'
                | '\u{1d173}'..='\u{1d17a}'
                | '\u{e0000}'..='\u{e0fff}'
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_hides_is_written_out_and_nothing_else() {
        for (text, expected) in [
            ("plain", "plain"),
            ("Größe µ 骨 עצם e\u{301}", "Größe µ 骨 עצם e\u{301}"),
            ("a\\b", "a\\b"),
            ("\u{1b}[31mred\u{7}", "\\u{1b}[31mred\\u{7}"),
            ("c1 \u{9b}2J", "c1 \\u{9b}2J"),
            ("bone\u{202e}lmot.j", "bone\\u{202e}lmot.j"),
            ("\u{2066}a\u{2069}\u{200f}\u{61c}", "\\u{2066}a\\u{2069}\\u{200f}\\u{61c}"),
            ("a\u{200b}\u{feff}\u{ad}\u{3164}b", "a\\u{200b}\\u{feff}\\u{ad}\\u{3164}b"),
            ("a\u{2028}b\u{2029}", "a\\u{2028}b\\u{2029}"),
            ("tag\u{e0041}", "tag\\u{e0041}"),
            ("a\tb\r", "a\\tb\\r"),
            ("nul\0", "nul\\u{0}"),
        ] {
            assert_eq!(line(text), expected);
            assert_eq!(lines(text), expected);
        }
        assert_eq!(line("a\nb"), "a\\nb");
        assert_eq!(lines("a\n\u{1b}b"), "a\n\\u{1b}b");
    }

    #[test]
    fn what_is_shown_hides_nothing() {
        let all: String = ('\0'..=char::MAX).collect();
        assert!(!line(&all).contains(is_hidden));
        assert!(!lines(&all).contains(|c| c != '\n' && is_hidden(c)));
    }

    #[test]
    fn a_text_that_hides_nothing_is_not_copied() {
        assert!(matches!(line("job.toml"), Cow::Borrowed(_)));
        assert!(matches!(lines("two\nlines"), Cow::Borrowed(_)));
    }
}
