//! The fields of a line of a CSV file.

use super::csv_format::Separator;
use super::problem::Problem;

/// Marks with which programs begin a comment.
pub(super) const COMMENT_MARKS: [char; 5] = ['#', '%', '!', '*', '/'];

/// Returns the fields of one line, without surrounding space and quotes.
pub(super) fn csv_fields(line: &str, separator: Separator) -> Result<Vec<String>, Problem> {
    match separator.character() {
        Some(character) => separated(line, character),
        None => blank_separated(line, if separator == Separator::Space { 1 } else { 2 }),
    }
}

/// Returns fields without empty ones at the end beyond a count.
pub(super) fn trimmed(mut fields: Vec<String>, count: usize) -> Vec<String> {
    while fields.len() > count && fields.last().is_some_and(String::is_empty) {
        fields.pop();
    }
    fields
}

fn separated(line: &str, separator: char) -> Result<Vec<String>, Problem> {
    let is_space = |c: char| c.is_whitespace() && c != separator;
    let mut fields = Vec::new();
    let mut rest = line;
    loop {
        let quoted = rest.trim_start_matches(is_space).strip_prefix('"');
        let (field, after) = match quoted {
            Some(quoted) => quoted_field(quoted, |after| {
                let after = after.trim_start_matches(is_space);
                (after.is_empty() || after.starts_with(separator)).then_some(after)
            })?,
            // A quote inside of a field is a character as any other: an inch, or a second.
            None => {
                let end = rest.find(separator).unwrap_or(rest.len());
                (rest[..end].trim().to_owned(), &rest[end..])
            }
        };
        fields.push(field);
        match after.strip_prefix(separator) {
            Some(next) => rest = next,
            None => return Ok(fields),
        }
    }
}

/// Returns the fields between runs of at least so many blanks, or of a tab.
fn blank_separated(line: &str, least: usize) -> Result<Vec<String>, Problem> {
    let mut fields = Vec::new();
    let mut rest = line.trim();
    while !rest.is_empty() {
        let (field, after) = match rest.strip_prefix('"') {
            Some(quoted) => quoted_field(quoted, |after| {
                (after.is_empty() || after.starts_with(char::is_whitespace)).then_some(after)
            })?,
            None => {
                let end = first_run(rest, least);
                (rest[..end].to_owned(), &rest[end..])
            }
        };
        fields.push(field);
        rest = after.trim_start();
    }
    if fields.is_empty() {
        fields.push(String::new());
    }
    Ok(fields)
}

/// Returns where the first run of at least so many blanks, or of a tab, begins.
fn first_run(text: &str, least: usize) -> usize {
    let mut begin = None;
    let mut count = 0;
    for (at, c) in text.char_indices() {
        if c == ' ' || c == '\t' {
            count += if c == '\t' { least } else { 1 };
            let begin = *begin.get_or_insert(at);
            if count >= least {
                return begin;
            }
        } else {
            (begin, count) = (None, 0);
        }
    }
    text.len()
}

/// Reads a field after its opening quote; returns it and the text after its closing quote, of which `ends`
/// says what follows the field, if a field can end there.
fn quoted_field(
    mut rest: &str,
    ends: impl Fn(&str) -> Option<&str>,
) -> Result<(String, &str), Problem> {
    let mut field = String::new();
    loop {
        let (before, after) = rest.split_once('"').ok_or(Problem::Quote)?;
        field.push_str(before);
        // A doubled quote stands for one.
        if let Some(after) = after.strip_prefix('"') {
            field.push('"');
            rest = after;
            continue;
        }
        return match ends(after) {
            Some(after) => Ok((field.trim().to_owned(), after)),
            None => Err(Problem::Quote),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_separated_as_the_file_says() {
        let check = |line, separator, expected: &[&str]| {
            assert_eq!(csv_fields(line, separator).ok().unwrap_or_default(), expected, "{line}");
        };
        check("a, \"b, \"\"c\"\"\" ,d", Separator::Comma, &["a", "b, \"c\"", "d"]);
        check("5\" probe,1,", Separator::Comma, &["5\" probe", "1", ""]);
        check("a;\tb", Separator::Semicolon, &["a", "b"]);
        check("a\t\tb", Separator::Tab, &["a", "", "b"]);
        check("   1   3908.5 ", Separator::Space, &["1", "3908.5"]);
        check("\"a b\" 1", Separator::Space, &["a b", "1"]);
        check("Sound speed   T [C]\tx", Separator::Spaces, &["Sound speed", "T [C]", "x"]);
        check("", Separator::Space, &[""]);
        check("\"open", Separator::Comma, &[]);
        check("\"a\"b,c", Separator::Comma, &[]);
    }
}
