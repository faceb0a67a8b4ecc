//! Notes for the user, and spans, which a client passes to the program that uses it.

use std::fmt::Debug;
use std::sync::Arc;

use osteon_proto::spans::SpanRecorder;

/// Receives a client's notes for the user, and says where its spans are recorded.
pub trait RunListener: Debug + Send + Sync {
    /// Takes a note for the user, for instance that the coordinator does not answer yet: one or several lines
    /// without a line break at the end.
    fn note(&self, text: &str);

    /// Returns where spans of requests are recorded, if they are.
    fn spans(&self) -> Option<Arc<dyn SpanRecorder>> {
        None
    }
}

/// Ignores all notes.
#[derive(Debug, Clone, Copy)]
pub struct Silent;

impl RunListener for Silent {
    fn note(&self, _: &str) {}
}
