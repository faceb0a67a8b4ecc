//! Spans from a submission to the computation of its batches, at a collector that is part of the test.
//! Only with the feature `otel`: `cargo xtask test tracing`.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use opentelemetry_proto::tonic::collector::trace::v1::trace_service_server::{
    TraceService, TraceServiceServer,
};
use opentelemetry_proto::tonic::collector::trace::v1::{
    ExportTraceServiceRequest, ExportTraceServiceResponse,
};
use opentelemetry_proto::tonic::common::v1::any_value::Value;
use opentelemetry_proto::tonic::trace::v1::Span;
use osteon_common::job::JobKind;
use osteon_files::job_file;
use osteon_proto::specification;
use osteon_proto::v1::SubmitRequest;
use osteon_transport::connection;
use support::{Finished, Owned, Scratch, eventually, job, osteon, text};
use tokio::net::TcpListener;
use tokio::runtime::Runtime;
use tokio_stream::wrappers::TcpListenerStream;
use tonic::transport::Server;
use tonic::{Request, Response, Status};

/// Spans by their ids, each with the name of its service.
type Spans = BTreeMap<Vec<u8>, (String, Span)>;

/// A collector of OTLP over gRPC.
#[derive(Clone, Default)]
struct Collector(Arc<Mutex<Spans>>);

#[tonic::async_trait]
impl TraceService for Collector {
    async fn export(
        &self,
        request: Request<ExportTraceServiceRequest>,
    ) -> Result<Response<ExportTraceServiceResponse>, Status> {
        for of_process in request.into_inner().resource_spans {
            let attributes = of_process.resource.unwrap_or_default().attributes;
            let mut names = attributes.into_iter().filter(|it| it.key == "service.name");
            let service = match names.next().and_then(|it| it.value?.value) {
                Some(Value::StringValue(name)) => name,
                other => format!("{other:?}"),
            };
            for span in of_process.scope_spans.into_iter().flat_map(|scope| scope.spans) {
                self.0.lock().unwrap().insert(span.span_id.clone(), (service.clone(), span));
            }
        }
        Ok(Response::new(ExportTraceServiceResponse::default()))
    }
}

impl Collector {
    /// Serves on a free port of this machine until the runtime ends; returns the endpoint.
    fn serve(&self, runtime: &Runtime) -> String {
        let listener = runtime.block_on(TcpListener::bind("127.0.0.1:0")).unwrap();
        let endpoint = format!("http://{}", listener.local_addr().unwrap());
        let router = Server::builder().add_service(TraceServiceServer::new(self.clone()));
        runtime.spawn(router.serve_with_incoming(TcpListenerStream::new(listener)));
        endpoint
    }

    fn spans(&self) -> Spans {
        self.0.lock().unwrap().clone()
    }
}

/// Returns a command for the program, which sends its spans to `endpoint`.
fn traced(endpoint: &str) -> Command {
    let mut command = osteon();
    command.env("OTEL_EXPORTER_OTLP_ENDPOINT", endpoint).env("OTEL_BSP_SCHEDULE_DELAY", "100");
    command.env_remove("OTEL_SERVICE_NAME").env("RUST_LOG", "warn");
    command
}

/// Returns the spans with a name, and checks that they are of this service.
fn named<'a>(spans: &'a Spans, name: &str, service: &str) -> Vec<&'a Span> {
    let found = spans.values().filter(|(_, span)| span.name == name);
    found
        .map(|(of, span)| {
            assert_eq!(of, service, "{name}");
            span
        })
        .collect()
}

fn ids(spans: &[&Span]) -> BTreeSet<Vec<u8>> {
    spans.iter().map(|span| span.span_id.clone()).collect()
}

fn parents(spans: &[&Span]) -> BTreeSet<Vec<u8>> {
    spans.iter().map(|span| span.parent_span_id.clone()).collect()
}

#[test]
fn a_trace_leads_from_the_submission_to_the_computation_of_each_batch() {
    let runtime = Runtime::new().unwrap();
    let collector = Collector::default();
    let endpoint = collector.serve(&runtime);
    let scratch = Scratch::new();
    let mut command = traced(&endpoint);
    command.args(["coordinator", "--listen", "127.0.0.1:0", "--audit-fraction", "0"]);
    let mut coordinator = Owned::spawn(command.arg("--store").arg(scratch.path("store")));
    let url = coordinator.line();
    let mut command = traced(&endpoint);
    command.args(["worker", "--threads", "1", "--coordinator", &url]);
    let mut worker = Owned::spawn(command.env("OTEL_SERVICE_NAME", "named"));
    let file = scratch.write("job.toml", &job(40, 3));
    let arguments = ["identify", text(&file), "--json", "--coordinator", &url];
    let result = Finished::of(traced(&endpoint).args(arguments).output().unwrap()).json();
    assert_eq!(result["evaluations"], 3);
    // What ends, exports what is left.
    worker.signal("TERM");
    assert_eq!(worker.code(), Some(0));
    coordinator.signal("TERM");
    assert_eq!(coordinator.code(), Some(0));

    let spans = collector.spans();
    let submissions = named(&spans, "osteon.submit", "osteon");
    let jobs = named(&spans, "osteon.job", "osteon-coordinator");
    let evaluations = named(&spans, "osteon.evaluation", "osteon-coordinator");
    let batches = named(&spans, "osteon.batch", "osteon-coordinator");
    let computed = named(&spans, "osteon.compute", "named");
    assert_eq!((submissions.len(), jobs.len()), (1, 1), "{spans:?}");
    assert!(evaluations.len() >= 3 && batches.len() >= 3, "{spans:?}");
    assert_eq!(parents(&submissions), [Vec::new()].into());
    assert_eq!(parents(&jobs), ids(&submissions));
    assert_eq!(parents(&evaluations), ids(&jobs));
    assert_eq!(parents(&batches), ids(&evaluations));
    // A batch in advance that no search asks for is revoked, and perhaps never computed.
    let answered: Vec<&Span> = batches
        .into_iter()
        .filter(|batch| batch.status.as_ref().is_none_or(|it| it.code == 0))
        .collect();
    assert!(computed.len() >= 3, "{spans:?}");
    assert!(ids(&answered).is_superset(&parents(&computed)), "{spans:?}");
    let traces: BTreeSet<&[u8]> = spans.values().map(|(_, span)| &span.trace_id[..]).collect();
    assert_eq!(traces.len(), 1);
    for child in spans.values().map(|(_, span)| span) {
        let ended = child.end_time_unix_nano;
        assert!(child.start_time_unix_nano <= ended, "{child:?}");
    }
}

#[test]
fn a_collector_that_is_not_there_does_no_harm() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &job(20, 1));
    // A port on which nobody listens.
    let mut command = traced("http://127.0.0.1:1");
    let output = command.args(["identify", text(&file), "--json"]).output().unwrap();
    assert_eq!(Finished::of(output).json()["evaluations"], 1);
}

#[test]
fn an_endpoint_that_cannot_be_used_is_named() {
    let mut command = traced("collector:4317");
    command.args(["jobs", "--coordinator", "unix:/nonexistent"]);
    let finished = Finished::of(command.output().unwrap());
    assert_eq!(finished.code, Some(2), "{finished:?}");
    let says =
        "OTEL_EXPORTER_OTLP_ENDPOINT is \"collector:4317\"; only http://HOST:PORT is allowed";
    assert!(finished.stderr.contains(says), "{finished:?}");
}

#[test]
fn a_client_of_any_language_is_the_parent_of_its_job() {
    let runtime = Runtime::new().unwrap();
    let collector = Collector::default();
    let endpoint = collector.serve(&runtime);
    let scratch = Scratch::new();
    let mut command = traced(&endpoint);
    command.args(["coordinator", "--listen", "127.0.0.1:0"]);
    let mut coordinator = Owned::spawn(command.arg("--store").arg(scratch.path("store")));
    let url = coordinator.line();
    let file = scratch.write("job.toml", &job(20, 1));
    let submit = |flags: &str| {
        let parent = format!("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-{flags}");
        runtime.block_on(submit_with(&url, &file, &parent))
    };
    let submitted = [submit("00"), submit("01")];
    coordinator.signal("TERM");
    assert_eq!(coordinator.code(), Some(0));
    eventually("the job is exported", || !collector.spans().is_empty());
    let spans = collector.spans();
    // The first is not recorded, because its client records nothing either.
    let jobs = named(&spans, "osteon.job", "osteon-coordinator");
    assert_eq!(jobs.len(), 1, "{spans:?}");
    let id = jobs[0].attributes.iter().find(|it| it.key == "job");
    let id = id.and_then(|it| it.value.clone()?.value).unwrap();
    assert_eq!(id, Value::StringValue(submitted[1].clone()));
    assert_eq!(jobs[0].trace_id, 0x4bf9_2f35_77b3_4da6_a3ce_929d_0e0e_4736_u128.to_be_bytes());
    assert_eq!(jobs[0].parent_span_id, 0x00f0_67aa_0ba9_02b7_u64.to_be_bytes());
}

/// Submits a job with this trace context; returns its id.
async fn submit_with(url: &str, file: &Path, parent: &str) -> String {
    let specification = job_file::read(file, JobKind::Identification).unwrap();
    let mut request = Request::new(SubmitRequest {
        specification: Some(specification::to_message(&specification)),
        ..SubmitRequest::default()
    });
    request.metadata_mut().insert("traceparent", parent.parse().unwrap());
    let channel =
        connection::connect(&url.parse().unwrap(), Duration::from_secs(10)).await.unwrap();
    connection::jobs_client(channel).submit(request).await.unwrap().into_inner().job
}
