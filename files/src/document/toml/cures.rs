//! What to write instead of frequent mistakes in TOML, which the parser's messages do not say.

/// Longer lines are not looked at: cures quote parts of them.
const LINE_BYTES_MAX: usize = 200;

/// A line that the parser refuses.
struct RefusedLine<'a> {
    /// The line up to a comment.
    line: &'a str,
    /// Its text before `=`.
    key: &'a str,
    /// Its text after `=`, if it has one.
    value: Option<&'a str>,
}

/// Returns what to write instead of what is at this byte offset.
pub(super) fn cure(text: &str, offset: usize, message: &str) -> Option<String> {
    let offset = text.floor_char_boundary(offset);
    let start = text[..offset].rfind('\n').map_or(0, |at| at + 1);
    let line = text[start..].lines().next().unwrap_or_default().trim();
    let line = line.split('#').next().unwrap_or_default().trim();
    if line.len() > LINE_BYTES_MAX {
        return None;
    }
    let (key, value) = match line.split_once('=') {
        Some((key, value)) => (key.trim(), Some(value.trim())),
        None => (line, None),
    };
    let mistake = RefusedLine { line, key, value };
    if message.contains("duplicate key") {
        return Some("each section and key may occur once; put the two together".to_owned());
    }
    if message.contains("leading zero") && mistake.value.is_some_and(|value| value.contains(',')) {
        return Some("numbers have a decimal point, not a comma".to_owned());
    }
    mistake.quotation().or_else(|| mistake.of_value()).or_else(|| mistake.of_line())
}

impl RefusedLine<'_> {
    fn quotation(&self) -> Option<String> {
        if self.line.contains(['“', '”', '„', '‘', '’', '«', '»']) {
            return Some("write straight quotation marks: \"…\"".to_owned());
        }
        let value = self.value?;
        if value.starts_with('"') && value.contains('\\') {
            let path =
                "in \"…\" a backslash begins an escape; write / instead, or '…' around the text";
            return Some(path.to_owned());
        }
        None
    }

    fn of_value(&self) -> Option<String> {
        // Of several keys on one line the last is looked at.
        let value = self.value?.rsplit('=').next()?.trim();
        let value = value.trim_end_matches(['}', ']', ' ']);
        if value.is_empty() {
            return Some("there must be a value after `=`".to_owned());
        }
        if let Some((whole, fraction)) = value.split_once(',')
            && is_digits(whole.trim_start_matches(['-', '+']))
            && fraction.starts_with(|c: char| c.is_ascii_digit())
        {
            return Some(format!("numbers have a decimal point, not a comma: {whole}.{fraction}"));
        }
        if let Some(fraction) = value.strip_prefix('.')
            && fraction.starts_with(|c: char| c.is_ascii_digit())
        {
            return Some(format!("write a digit before the decimal point: 0.{fraction}"));
        }
        if let Some(whole) = value.strip_suffix('.')
            && is_digits(whole)
        {
            return Some(format!("write a digit after the decimal point: {whole}.0"));
        }
        for (word, meant) in [("yes", "true"), ("no", "false"), ("on", "true"), ("off", "false")] {
            if value.eq_ignore_ascii_case(word) || value.eq_ignore_ascii_case(meant) {
                return Some(format!("write {meant}"));
            }
        }
        let number_length = value.find(|c: char| !c.is_ascii_digit() && !".-+eE".contains(c));
        if let Some(length) = number_length.filter(|&length| length > 0) {
            let (number, rest) = value.split_at(length);
            let number = number.trim_end_matches(['e', 'E']);
            let rest = rest.trim();
            if rest.starts_with(|c: char| c.is_alphabetic() || c == '%' || c == '°')
                && number.parse::<f64>().is_ok()
            {
                let unit = rest.split(' ').next().unwrap_or(rest);
                return Some(format!(
                    "write the number without {unit}, in the unit of this key (m, s, Hz, kg/m³, Pa)"
                ));
            }
            if rest.starts_with(|c: char| c.is_ascii_digit() || c == '\'') {
                return Some(
                    "write the digits of a number without gaps, or with _ in them".to_owned(),
                );
            }
        }
        let is_text = value.starts_with(|c: char| c.is_alphabetic() || "/.~".contains(c));
        if is_text && !value.contains(['"', '\'']) {
            return Some(format!("text is in quotation marks: \"{value}\""));
        }
        None
    }

    fn of_line(&self) -> Option<String> {
        if self.line.starts_with("//") || self.line.starts_with(['%', ';', '!']) {
            return Some("comments begin with #".to_owned());
        }
        if self.value.is_none() {
            let (key, value) = self.key.split_once(':')?;
            return Some(format!("write {} = {}", key.trim(), value.trim()));
        }
        None
    }
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_digit())
}
