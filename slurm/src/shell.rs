//! Words of shell scripts.

use std::path::Path;

use osteon_common::visible;

use super::SlurmError;

/// Returns a word that bash reads as `text`.
pub(crate) fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:=@%+,".contains(c);
    match !text.is_empty() && text.chars().all(plain) {
        true => text.to_owned(),
        false => format!("'{}'", text.replace('\'', r"'\''")),
    }
}

/// Returns a path as the text of a script, absolute, because a job may begin in any directory.
///
/// # Errors
/// If it is not UTF-8, contains control characters, or if the present directory is unknown.
pub(crate) fn absolute(path: &Path) -> Result<String, SlurmError> {
    let absolute = std::path::absolute(path).map_err(|_| SlurmError::NotText(path.to_owned()))?;
    let text = absolute.to_str().ok_or_else(|| SlurmError::NotText(path.to_owned()))?;
    without_controls(text)?;
    Ok(text.to_owned())
}

/// Checks that a text does not end its line.
///
/// # Errors
/// If it does.
pub(crate) fn without_controls(text: &str) -> Result<(), SlurmError> {
    match text.chars().any(char::is_control) {
        true => Err(SlurmError::ControlCharacter { word: visible::line(text).into_owned() }),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bash_reads_quoted_words_as_they_were() {
        for word in
            ["plain-1.2_x/y", "", "two words", "it's", "$HOME", "`id`", "a\\b", "ü", "#", "*"]
        {
            let script = format!("printf %s {}", quoted(word));
            let output = std::process::Command::new("bash").args(["-c", &script]).output().unwrap();
            assert_eq!(String::from_utf8(output.stdout).unwrap(), word);
        }
    }

    #[test]
    fn paths_are_absolute_text() {
        assert!(absolute(Path::new("a")).unwrap().ends_with("/a"));
        assert_eq!(absolute(Path::new("/a b")).unwrap(), "/a b");
        assert!(matches!(absolute(Path::new("/a\nb")), Err(SlurmError::ControlCharacter { .. })));
        let latin1 = std::os::unix::ffi::OsStrExt::from_bytes(b"/a\xff");
        let latin1: &std::ffi::OsStr = latin1;
        assert!(matches!(absolute(Path::new(latin1)), Err(SlurmError::NotText(_))));
    }
}
