//! Export of spans by OTLP over gRPC, with the standard environment variables of OpenTelemetry.

use std::env;
use std::time::Duration;

use anyhow::Context as _;
use opentelemetry::trace::{
    SpanContext, SpanId, SpanKind, Status, TraceFlags, TraceId, TraceState,
};
use opentelemetry::{InstrumentationScope, KeyValue};
use opentelemetry_otlp::SpanExporter;
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{
    BatchSpanProcessor, SpanData, SpanEvents, SpanLinks, SpanProcessor as _,
};
use osteon_common::version;
use osteon_proto::identity;
use osteon_proto::spans::{AttributeValue, EndedSpan, SpanRecorder, TraceContext};

use crate::exit_status::CommandFailure;

/// Variables that name the collector; without one nothing is exported.
const ENDPOINTS: [&str; 2] = ["OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "OTEL_EXPORTER_OTLP_ENDPOINT"];
/// Variable that names the service.
const SERVICE_NAME: &str = "OTEL_SERVICE_NAME";
/// Longest wait for a collector at the end.
const END_MAX: Duration = Duration::from_secs(2);

/// Sends spans to a collector. Its queue is bounded: what finds no room is dropped.
#[derive(Debug)]
pub(super) struct OtlpRecorder {
    processor: BatchSpanProcessor,
    scope: InstrumentationScope,
}

impl OtlpRecorder {
    /// Begins the export for a service, if the environment names a collector.
    pub(super) fn start(service: &'static str) -> Result<Option<Self>, CommandFailure> {
        let set = |name: &&str| env::var_os(name).is_some_and(|value| !value.is_empty());
        let Some(variable) = ENDPOINTS.into_iter().find(|name| set(name)) else {
            return Ok(None);
        };
        let endpoint = env::var(variable).unwrap_or_default();
        if !endpoint.starts_with("http://") {
            return Err(CommandFailure::BadInput(anyhow::anyhow!(
                "{variable} is {endpoint:?}; only http://HOST:PORT is allowed, e.g. that of a collector \
                 on this machine, which can pass spans on over TLS"
            )));
        }
        let exporter = SpanExporter::builder()
            .with_tonic()
            .build()
            .with_context(|| format!("cannot export spans to {endpoint:?} ({variable})"))
            .map_err(CommandFailure::BadInput)?;
        let mut processor = BatchSpanProcessor::builder(exporter).build();
        processor.set_resource(&resource(service));
        let scope = InstrumentationScope::builder("osteon").with_version(version::VERSION).build();
        Ok(Some(Self { processor, scope }))
    }

    /// Exports what is left; a collector that does not take it in time does not get it.
    pub(super) fn end(&self) {
        drop(self.processor.shutdown_with_timeout(END_MAX));
    }
}

impl SpanRecorder for OtlpRecorder {
    fn record(&self, span: EndedSpan) {
        let EndedSpan { name, context, parent, start, end, attributes, error } = span;
        let attributes = attributes.into_iter().map(|(name, value)| match value {
            AttributeValue::Text(text) => KeyValue::new(name, text),
            AttributeValue::Count(count) => {
                KeyValue::new(name, i64::try_from(count).unwrap_or(i64::MAX))
            }
        });
        let parent_span_id = parent.map_or(SpanId::INVALID, |parent| id(parent.span));
        self.processor.on_end(SpanData {
            span_context: position(context),
            parent_span_id,
            parent_span_is_remote: false,
            span_kind: SpanKind::Internal,
            name: name.into(),
            start_time: start,
            end_time: end,
            attributes: attributes.collect(),
            dropped_attributes_count: 0,
            events: SpanEvents::default(),
            links: SpanLinks::default(),
            status: error.map_or(Status::Unset, Status::error),
            instrumentation_scope: self.scope.clone(),
        });
    }
}

fn position(context: TraceContext) -> SpanContext {
    let trace = TraceId::from_bytes(context.trace.to_be_bytes());
    SpanContext::new(trace, id(context.span), TraceFlags::SAMPLED, false, TraceState::default())
}

fn id(span: u64) -> SpanId {
    SpanId::from_bytes(span.to_be_bytes())
}

/// Describes this process.
fn resource(service: &'static str) -> Resource {
    let described = Resource::builder().with_attributes([
        KeyValue::new("service.version", version::VERSION),
        KeyValue::new("host.name", identity::host_name().unwrap_or_default()),
        KeyValue::new("process.pid", i64::from(std::process::id())),
    ]);
    match env::var_os(SERVICE_NAME) {
        // Taken from there by the builder.
        Some(name) if !name.is_empty() => described.build(),
        _ => described.with_service_name(service).build(),
    }
}
