//! The log on stderr: lines for people, or one JSON object in each line.

use std::io::{self, Write};

use osteon_common::visible;
use tracing_subscriber::fmt::MakeWriter;

use crate::arguments::LogFormat;
use crate::exit_status::CommandFailure;
use crate::log_filter;
use crate::progress;

/// Sends logs to stderr; `RUST_LOG` overrides the level.
///
/// # Errors
/// If `RUST_LOG` is not a valid filter.
pub(crate) fn start(default_level: &str, format: LogFormat) -> Result<(), CommandFailure> {
    let filter = log_filter::read(std::env::var_os(log_filter::VARIABLE), default_level)?;
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_ansi(false).with_target(false);
    match format {
        LogFormat::Text => log.with_writer(progress::LogWriter).init(),
        LogFormat::Json => {
            let flat = log.with_writer(JsonLogWriter).json().flatten_event(true);
            flat.with_current_span(false).with_span_list(false).init();
        }
    }
    Ok(())
}

/// Reports on stderr why the program ends, in the format of its log.
pub(crate) fn report(failure: &CommandFailure, format: LogFormat) {
    let message = failure.to_string();
    match format {
        LogFormat::Text => {
            // If stderr is closed as well, nothing more can be done.
            let _closed = writeln!(io::stderr(), "osteon: {}", visible::lines(&message));
        }
        LogFormat::Json => {
            let exit_code = failure.exit_code();
            tracing::error!(reason = message, exit_code, "the program ends with an error");
        }
    }
}

/// Writer of JSON lines.
#[derive(Debug, Clone, Copy)]
struct JsonLogWriter;

impl<'a> MakeWriter<'a> for JsonLogWriter {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        *self
    }
}

impl Write for JsonLogWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // A closed stderr must not end a computation.
        drop(io::stderr().write_all(shown(bytes).as_bytes()));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Returns an event, a line of JSON, with its hidden characters escaped as JSON does it. Such
/// characters occur in strings only.
fn shown(event: &[u8]) -> String {
    let mut line = String::with_capacity(event.len());
    for c in String::from_utf8_lossy(event).chars() {
        if c != '\n' && visible::is_hidden(c) {
            for unit in c.encode_utf16(&mut [0; 2]) {
                line.push_str(&format!("\\u{unit:04x}"));
            }
        } else {
            line.push(c);
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_characters_are_escaped_and_the_line_stays_the_same_json() {
        for name in ["left tibia", "a\u{202e}b", "tag\u{e0041}", "\u{1b}[31m\n", "Größe 骨"] {
            let event = format!("{}\n", serde_json::json!({ "name": name }));
            let line = shown(event.as_bytes());
            assert!(!line.trim_end_matches('\n').contains(visible::is_hidden), "{line:?}");
            let read: serde_json::Value = serde_json::from_str(&line).unwrap();
            assert_eq!(read["name"], name);
        }
    }
}
