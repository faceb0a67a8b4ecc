//! Where spans go: by OTLP to a collector, if the program is built with the feature `otel` and the
//! environment names one.

#[cfg(feature = "otel")]
mod otlp;

use std::sync::{Arc, OnceLock};

use osteon_proto::spans::SpanRecorder;

use crate::exit_status::CommandFailure;

static RECORDER: OnceLock<Arc<dyn SpanRecorder>> = OnceLock::new();

/// Returns the place for ended spans, if spans are recorded.
pub(crate) fn recorder() -> Option<Arc<dyn SpanRecorder>> {
    RECORDER.get().cloned()
}

/// Exports the spans of this process, and ends the export when it is dropped.
#[derive(Debug)]
pub(crate) struct Telemetry {
    #[cfg(feature = "otel")]
    exporter: Option<Arc<otlp::OtlpRecorder>>,
}

impl Telemetry {
    /// Begins the export, if it is wanted, under `name` unless the environment gives another one. Must be
    /// called within a runtime.
    ///
    /// # Errors
    /// If the environment asks for what is not possible.
    #[cfg(feature = "otel")]
    pub(crate) fn start(name: &'static str) -> Result<Self, CommandFailure> {
        let exporter = otlp::OtlpRecorder::start(name)?.map(Arc::new);
        if let Some(exporter) = &exporter {
            // Set once only, at the start.
            let _first = RECORDER.set(Arc::<otlp::OtlpRecorder>::clone(exporter));
        }
        Ok(Self { exporter })
    }

    /// Begins nothing: this program is built without the feature `otel`.
    #[cfg(not(feature = "otel"))]
    pub(crate) fn start(_: &'static str) -> Result<Self, CommandFailure> {
        Ok(Self {})
    }

    /// Exports what is left, within a limited time. Must be called outside of the runtime, which has to
    /// run still.
    pub(crate) fn end(self) {
        #[cfg(feature = "otel")]
        if let Some(exporter) = self.exporter {
            exporter.end();
        }
    }
}
