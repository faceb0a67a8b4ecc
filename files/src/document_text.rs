//! A text of a job or case file, with the settings of a command line: what its readers start from.

use std::ops::Range;

use crate::document::{self, FieldSpans, Format, Node, SyntaxError};
use crate::excerpt::Excerpt;
use crate::setting::Setting;

/// A text, and settings that replace or add values.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DocumentText<'a> {
    text: &'a str,
    format: Format,
    settings: &'a [Setting],
}

impl<'a> DocumentText<'a> {
    /// Takes a text, with or without a byte order mark.
    pub(crate) fn new(text: &'a str, format: Format) -> Self {
        Self { text: without_byte_order_mark(text), format, settings: &[] }
    }

    /// Adds settings; the last for a key counts.
    pub(crate) fn with_settings(self, settings: &'a [Setting]) -> Self {
        Self { settings, ..self }
    }

    /// Parses the text into a tree, and applies the settings.
    ///
    /// # Errors
    /// Position and description of the syntax error.
    pub(crate) fn tree(&self) -> Result<Node, SyntaxError> {
        let mut root = document::parse(self.text, self.format)?;
        for setting in self.settings {
            setting.apply(&mut root);
        }
        Ok(root)
    }

    /// Returns the setting from which the field at `path` has its value.
    pub(crate) fn setting_of(&self, path: &str) -> Option<&'a Setting> {
        self.settings.iter().rfind(|setting| setting.has(path))
    }

    /// Finds the places of all fields.
    pub(crate) fn spans(&self) -> FieldSpans<'a> {
        document::spans(self.text, self.format)
    }

    /// Returns the line with these bytes.
    pub(crate) fn excerpt(&self, span: Range<usize>) -> Excerpt {
        Excerpt::new(self.text, span)
    }
}

/// Returns a text without its byte order mark, if it has one.
pub(crate) fn without_byte_order_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}
