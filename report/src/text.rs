//! Texts of users within markup.

/// Returns `text` as the content of an element or of a quoted attribute, in HTML and in SVG. Control
/// characters, which XML does not allow, become U+FFFD.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' => out.push(c),
            c if c.is_control() || is_direction_control(c) => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// Whether a character changes the direction of the text that follows, and so could make one name look
/// like another.
fn is_direction_control(c: char) -> bool {
    matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Returns a name shortened to at most `characters`, the last of which is then `…`.
pub(crate) fn shorten(name: &str, characters: usize) -> String {
    if name.chars().count() <= characters {
        return name.to_owned();
    }
    let kept: String = name.chars().take(characters.saturating_sub(1)).collect();
    kept.trim_end().to_owned() + "…"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_names_is_text() {
        for (text, expected) in [
            ("A & B", "A &amp; B"),
            ("<script>alert(1)</script>", "&lt;script&gt;alert(1)&lt;/script&gt;"),
            ("\" onload='x'", "&quot; onload=&#39;x&#39;"),
            ("a\u{0}b\u{1b}", "a\u{fffd}b\u{fffd}"),
            ("\u{202e}evil", "\u{fffd}evil"),
            ("Müller √(c/ρ)", "Müller √(c/ρ)"),
        ] {
            assert_eq!(escape(text), expected, "{text:?}");
        }
    }

    #[test]
    fn long_names_end_with_an_ellipsis() {
        for (name, characters, expected) in
            [("patient 1", 9, "patient 1"), ("patient 12", 9, "patient…"), ("äöüß", 3, "äö…")]
        {
            assert_eq!(shorten(name, characters), expected);
        }
    }
}
