//! The fields of a line of a CSV file.

use super::problem::Problem;

/// Returns the fields of one line, without surrounding space and quotes.
pub(crate) fn csv_fields(line: &str, separator: char) -> Result<Vec<String>, Problem> {
    let is_space = |c: char| c.is_whitespace() && c != separator;
    let mut fields = Vec::new();
    let mut rest = line;
    loop {
        let (field, after) = match rest.trim_start_matches(is_space).strip_prefix('"') {
            Some(quoted) => quoted_field(quoted, separator)?,
            None => {
                let end = rest.find(separator).unwrap_or(rest.len());
                if rest[..end].contains('"') {
                    return Err(Problem::Quote);
                }
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

/// Reads a field after its opening quote; returns it and the text after its closing quote, which is
/// empty or begins with a separator.
fn quoted_field(mut rest: &str, separator: char) -> Result<(String, &str), Problem> {
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
        let after = after.trim_start_matches(|c: char| c.is_whitespace() && c != separator);
        if after.is_empty() || after.starts_with(separator) {
            return Ok((field.trim().to_owned(), after));
        }
        return Err(Problem::Quote);
    }
}
