//! Log filter: the environment variable RUST_LOG, or a default.

use std::ffi::OsString;

use anyhow::anyhow;
use tracing_subscriber::EnvFilter;

use crate::exit_status::CommandFailure;

/// The environment variable with the log filter.
pub(crate) const VARIABLE: &str = "RUST_LOG";

/// The log levels, including the one that turns everything off.
const LEVELS: [&str; 6] = ["off", "error", "warn", "info", "debug", "trace"];

/// Returns the filter described by `value`, or that of `default_level` if it is absent or empty.
///
/// # Errors
/// If it cannot be parsed, or contains a word that is neither a level nor a module with a level:
/// such a word would turn off everything that it does not name.
pub(crate) fn read(
    value: Option<OsString>,
    default_level: &str,
) -> Result<EnvFilter, CommandFailure> {
    let text = value.map(OsString::into_string).transpose();
    let text = text.map_err(|value| wrong(&value.to_string_lossy(), "it is not valid UTF-8"))?;
    let Some(text) = text.filter(|text| !text.trim().is_empty()) else {
        return Ok(EnvFilter::new(default_level));
    };
    for word in text.split(',').map(str::trim) {
        let is_level = LEVELS.iter().any(|level| word.eq_ignore_ascii_case(level));
        let is_number = matches!(word, "0" | "1" | "2" | "3" | "4" | "5");
        if !word.is_empty() && !word.contains(['=', '[']) && !is_level && !is_number {
            return Err(wrong(&text, &format!("`{word}` is not a level")));
        }
    }
    EnvFilter::builder().parse(&text).map_err(|error| wrong(&text, &error.to_string()))
}

fn wrong(text: &str, what: &str) -> CommandFailure {
    CommandFailure::bad_input(anyhow!(
        "RUST_LOG is `{}`: {what}; write a level (error, warn, info, debug, trace, off), or levels of \
         modules: info,osteon_coordinator=debug",
        text.escape_debug()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(value: Option<&str>) -> Result<String, String> {
        let filter = read(value.map(OsString::from), "info");
        filter.map(|filter| filter.to_string()).map_err(|failure| {
            assert_eq!(failure.exit_code(), 2);
            failure.to_string()
        })
    }

    #[test]
    fn what_cannot_be_meant_is_refused_and_never_ignored() {
        for (value, expected) in [
            (None, "info"),
            (Some(""), "info"),
            (Some(" "), "info"),
            (Some("debug"), "debug"),
            (Some("WARN"), "warn"),
            (Some("osteon_coordinator=debug"), "osteon_coordinator=debug"),
        ] {
            assert_eq!(shown(value).as_deref(), Ok(expected), "{value:?}");
        }
        for value in ["inf", "warning", "verbose", "osteon=loud", "info,h2", "a=b=c"] {
            let message = shown(Some(value)).unwrap_err();
            assert!(message.contains(value) && message.contains("write a level"), "{message}");
        }
    }
}
