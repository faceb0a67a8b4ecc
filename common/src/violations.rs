//! Violations of an input, collected and reported at once.

use std::fmt;

use crate::visible;

/// One violation of one field.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Violation {
    /// Path of the field in the user's file, e.g. `layers.coupling.density` or
    /// `probe.receivers.count`.
    pub field: String,
    /// The value found and the values allowed, e.g. `is -1.0; it must be above 0 (kg/m³)`.
    pub message: String,
    /// Whether it represents further violations that are not listed.
    pub more: bool,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let message = visible::line(&self.message);
        if self.field.is_empty() {
            f.write_str(&message)
        } else {
            write!(f, "{}: {message}", visible::line(&self.field))
        }
    }
}

/// All violations of one specification, in the order in which they were found.
///
/// A check that relates several fields calls [`Violations::has_at_or_below`] first and reports
/// nothing if one of them is already known to be wrong, so that each mistake is reported once.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Violations(Vec<Violation>);

impl Violations {
    /// Creates an empty list.
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the first of the violations that `record` records.
    pub(crate) fn first_of(record: impl FnOnce(&mut Self)) -> Option<Violation> {
        let mut violations = Self::new();
        record(&mut violations);
        violations.iter().next().cloned()
    }

    /// Records a violation of `field`.
    pub fn add(&mut self, field: impl Into<String>, message: impl Into<String>) {
        self.0.push(Violation { field: field.into(), message: message.into(), more: false });
    }

    /// Records that `field` has more violations than are listed.
    pub fn add_more(&mut self, field: impl Into<String>, message: impl Into<String>) {
        self.0.push(Violation { field: field.into(), message: message.into(), more: true });
    }

    /// Returns whether `field`, or a field inside it, is already known to be wrong.
    pub fn has_at_or_below(&self, field: &str) -> bool {
        self.0.iter().any(|violation| {
            violation.field.strip_prefix(field).is_some_and(|rest| {
                rest.is_empty() || rest.starts_with('.') || rest.starts_with('[')
            })
        })
    }

    /// Returns whether there are no violations.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the violations in the order in which they were found.
    pub fn iter(&self) -> std::slice::Iter<'_, Violation> {
        self.0.iter()
    }

    /// Returns the same violations with other paths of fields.
    #[must_use]
    pub fn with_fields(mut self, rename: impl Fn(&str) -> String) -> Self {
        for violation in &mut self.0 {
            violation.field = rename(&violation.field);
        }
        self
    }

    /// Returns `value` if there are no violations.
    ///
    /// # Errors
    /// `self`, if it is not empty.
    pub fn into_result<T>(self, value: T) -> Result<T, Self> {
        if self.is_empty() { Ok(value) } else { Err(self) }
    }
}

impl fmt::Display for Violations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, violation) in self.0.iter().enumerate() {
            if i > 0 {
                f.write_str("\n")?;
            }
            write!(f, "{violation}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Violations {}
