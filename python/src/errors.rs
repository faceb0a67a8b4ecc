//! Exceptions: the classes are in `osteon/errors.py`.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use osteon_common::violations::Violation;
use osteon_files::file_error::{ContentError, FileError};
use osteon_solver::Failure;
use pyo3::prelude::*;

/// A violation as Python receives it: field, message, line.
type PlainViolation = (String, String, Option<usize>);

/// Creates an exception of the class `name` of `osteon.errors`.
fn exception<'py>(
    py: Python<'py>,
    name: &str,
    arguments: impl pyo3::call::PyCallArgs<'py>,
) -> PyErr {
    let made = py
        .import("osteon.errors")
        .and_then(|module| module.getattr(name))
        .and_then(|class| class.call1(arguments));
    match made {
        Ok(value) => PyErr::from_value(value),
        Err(error) => error,
    }
}

/// Creates an `InputError` about one field; an empty one denotes the whole input.
pub(crate) fn bad_input(field: &str, message: impl Into<String>) -> PyErr {
    let message = message.into();
    let violation = Violation { field: field.to_owned(), message, more: false };
    let text = violation.to_string();
    Python::attach(|py| exception(py, "InputError", (text, vec![plain(None, &violation)])))
}

/// Converts the refusal of a file.
pub(crate) fn of_file(error: &FileError) -> PyErr {
    let message = error.to_string();
    Python::attach(|py| match error {
        FileError::Content { content, .. } => {
            exception(py, "InputError", (message, violations(content)))
        }
        FileError::Unreadable { .. } => exception(py, "UnreadableFileError", (message,)),
        FileError::UnknownFormat { .. }
        | FileError::CaseForJob { .. }
        | FileError::JobForCase { .. }
        | FileError::TooLarge { .. } => {
            exception(py, "InputError", (message, Vec::<PlainViolation>::new()))
        }
    })
}

/// Converts the refusal of a text.
pub(crate) fn of_content(error: &ContentError) -> PyErr {
    let message = error.to_string();
    Python::attach(|py| exception(py, "InputError", (message, violations(error))))
}

fn violations(content: &ContentError) -> Vec<PlainViolation> {
    match content {
        ContentError::Invalid(invalid) => {
            invalid.iter().map(|(line, violation)| plain(line, violation)).collect()
        }
        ContentError::Malformed(_) => Vec::new(),
    }
}

fn plain(line: Option<usize>, violation: &Violation) -> PlainViolation {
    (violation.field.clone(), violation.message.clone(), line)
}

/// Converts the failure of a case.
pub(crate) fn of_failure(failure: &Failure) -> PyErr {
    let Failure { kind, detail } = failure;
    no_velocity(kind.name(), detail)
}

/// Creates the exception for a failure of this kind.
pub(crate) fn no_velocity(kind: &str, detail: &str) -> PyErr {
    Python::attach(|py| exception(py, "simulation_error", (kind, detail)))
}

/// Runs a computation without the interpreter; a panic is an `InternalError`.
pub(crate) fn computed<T: Send>(py: Python<'_>, compute: impl FnOnce() -> T + Send) -> PyResult<T> {
    let result = py.detach(|| catch_unwind(AssertUnwindSafe(compute)));
    result.map_err(|payload| panicked(payload.as_ref()))
}

/// Creates the exception for a panic.
pub(crate) fn panicked(payload: &(dyn Any + Send)) -> PyErr {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    let text = text.unwrap_or("no message").to_owned();
    Python::attach(|py| exception(py, "InternalError", (text,)))
}
