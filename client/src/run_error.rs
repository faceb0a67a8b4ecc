//! Why a run, or the use of a directory of results, did not get to its end.

use std::io;

use thiserror::Error;

use crate::error::ClientError;

/// Reason why a run did not get to its end.
#[derive(Debug, Error)]
pub enum RunError {
    /// The job, an option or a directory named by the user cannot be used; nothing was started.
    #[error(transparent)]
    BadInput(anyhow::Error),
    /// Any other reason.
    #[error(transparent)]
    Failed(anyhow::Error),
}

impl RunError {
    /// Creates the error of bad usage or bad input.
    pub fn bad_input(error: impl Into<anyhow::Error>) -> Self {
        Self::BadInput(error.into())
    }

    /// Creates an error that is not caused by the user's input.
    pub fn failed(error: impl Into<anyhow::Error>) -> Self {
        Self::Failed(error.into())
    }

    /// Creates the error of a path that cannot be used: bad input if another path could be, failed if the
    /// machine is the cause, as with a full disk.
    pub fn unusable_path(error: io::Error, context: String) -> Self {
        use io::ErrorKind;
        let of_the_path = matches!(
            error.kind(),
            ErrorKind::NotFound
                | ErrorKind::PermissionDenied
                | ErrorKind::AlreadyExists
                | ErrorKind::NotADirectory
                | ErrorKind::IsADirectory
                | ErrorKind::ReadOnlyFilesystem
                | ErrorKind::InvalidFilename
                | ErrorKind::InvalidInput
        );
        let error = anyhow::Error::new(error).context(context);
        if of_the_path { Self::BadInput(error) } else { Self::Failed(error) }
    }
}

impl From<ClientError> for RunError {
    fn from(error: ClientError) -> Self {
        if error.is_bad_input() { Self::bad_input(error) } else { Self::failed(error) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_bad_input_where_another_would_do() {
        let of = |kind| RunError::unusable_path(io::Error::from(kind), "cannot write DIR".into());
        for kind in [
            io::ErrorKind::PermissionDenied,
            io::ErrorKind::NotADirectory,
            io::ErrorKind::ReadOnlyFilesystem,
        ] {
            assert!(matches!(of(kind), RunError::BadInput(_)), "{kind}");
        }
        for kind in [io::ErrorKind::StorageFull, io::ErrorKind::QuotaExceeded] {
            assert!(matches!(of(kind), RunError::Failed(_)), "{kind}");
        }
        assert_eq!(of(io::ErrorKind::NotFound).to_string(), "cannot write DIR");
    }
}
