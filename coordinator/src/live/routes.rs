//! The paths of the live page.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Path, RawQuery, Request, State};
use axum::http::header::{ALLOW, CONTENT_TYPE, HeaderName, HeaderValue};
use axum::http::{StatusCode, Uri};
use axum::middleware::from_fn_with_state;
use axum::response::Response;
use axum::routing::{get, post};
use axum::{Extension, Router};
use serde_json::Value;
use tonic::Status;

use crate::access::HolderName;
use crate::access::limiter::Caller;
use crate::core::ids::JobId;
use crate::live::assets;
use crate::live::course::FollowedSearch;
use crate::live::events;
use crate::live::gate::{self, Gate, PageCaller};
use crate::live::json;
use crate::live::overview;
use crate::live::query::Shown;
use crate::live::source::PageSource;

/// Tells proxies to pass events on as they come.
const X_ACCEL_BUFFERING: HeaderName = HeaderName::from_static("x-accel-buffering");

type SharedSource = State<Arc<PageSource>>;

/// Returns the paths of the page, behind its gate.
pub(crate) fn router(source: Arc<PageSource>, gate: Gate) -> Router {
    let mut router = Router::new();
    for path in assets::PATHS {
        router = router.route(path, get(async move || assets::file(path).unwrap_or_default()));
    }
    router
        .route("/data/overview", get(overview_data))
        .route("/data/jobs", get(jobs))
        .route("/data/jobs/{job}", get(job))
        .route("/data/jobs/{job}/figures", get(figures))
        .route("/data/jobs/{job}/cancel", post(cancel))
        .route("/events", get(stream))
        .fallback(answer_unknown_path)
        .method_not_allowed_fallback(answer_wrong_method)
        .with_state(source)
        .layer(from_fn_with_state(gate, gate::guard))
}

async fn overview_data(State(source): SharedSource) -> Response {
    respond(overview::newest(&source).await.and_then(|text| {
        serde_json::from_str(&text).map_err(|error| Status::internal(error.to_string()))
    }))
}

async fn jobs(State(source): SharedSource, RawQuery(query): RawQuery) -> Response {
    let shown = match Shown::parse(query.as_deref().unwrap_or_default()) {
        Ok(shown) => shown,
        Err(error) => return json::error(StatusCode::BAD_REQUEST, &error),
    };
    respond(source.list(&shown).await.map(|(snapshots, more_after)| {
        json::jobs(&snapshots, more_after.map(|job| job.to_string()))
    }))
}

async fn job(State(source): SharedSource, Path(job): Path<String>) -> Response {
    let Some(id) = JobId::parse(&job) else { return no_job_response(&job) };
    respond(events::detail(&source, id).await)
}

async fn figures(
    State(source): SharedSource,
    Path(job): Path<String>,
    request: Request,
) -> Response {
    let Some(id) = JobId::parse(&job) else { return no_job_response(&job) };
    let reader = Caller::from_extensions(request.extensions());
    let mut search = FollowedSearch::new(id, None);
    respond(search.figures(&source, reader).await.cloned())
}

async fn cancel(
    State(source): SharedSource,
    Path(job): Path<String>,
    holder: Option<Extension<HolderName>>,
) -> Response {
    let holder = holder.map(|Extension(holder)| holder);
    let snapshot = source.cancel(job, holder).await;
    respond(snapshot.map(|snapshot| snapshot.as_ref().map_or(Value::Null, json::job)))
}

async fn stream(
    State(source): SharedSource,
    Extension(caller): Extension<PageCaller>,
    RawQuery(query): RawQuery,
    request: Request,
) -> Response {
    let shown = match Shown::parse(query.as_deref().unwrap_or_default()) {
        Ok(shown) => shown,
        Err(error) => return json::error(StatusCode::BAD_REQUEST, &error),
    };
    let permit = match source.stream() {
        Ok(permit) => permit,
        Err(refusal) => return json::refusal_response(&refusal),
    };
    let reader = Caller::from_extensions(request.extensions());
    let updates = events::updates(source, shown, caller, reader, permit);
    let mut response = Response::new(Body::from_stream(updates));
    let headers = response.headers_mut();
    headers.insert(CONTENT_TYPE, HeaderValue::from_static("text/event-stream"));
    headers.insert(X_ACCEL_BUFFERING, HeaderValue::from_static("no"));
    response
}

async fn answer_unknown_path(uri: Uri) -> Response {
    json::error(StatusCode::NOT_FOUND, &format!("there is nothing at {:?}", uri.path()))
}

async fn answer_wrong_method(uri: Uri) -> Response {
    let allowed = if uri.path().ends_with("/cancel") { "POST" } else { "GET, HEAD" };
    let message = format!("{} takes {allowed} only", uri.path());
    let mut response = json::error(StatusCode::METHOD_NOT_ALLOWED, &message);
    response.headers_mut().insert(ALLOW, HeaderValue::from_static(allowed));
    response
}

fn no_job_response(job: &str) -> Response {
    json::error(StatusCode::NOT_FOUND, &format!("no such job: {job:?}"))
}

fn respond(answer: Result<Value, Status>) -> Response {
    match answer {
        Ok(value) => json::answer(StatusCode::OK, &value),
        Err(refusal) => json::refusal_response(&refusal),
    }
}
