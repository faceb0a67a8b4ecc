//! The endpoints of the protocol.

use std::sync::Arc;

use axum::Router;
use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header::{CONTENT_TYPE, HeaderValue};
use axum::http::{Method, StatusCode, Uri};
use axum::middleware::from_fn_with_state;
use axum::response::Response;
use axum::routing::{get, post};
use osteon_http::OwnHosts;
use serde_json::json;

use super::answers::{BODY_S_MAX, JsonAnswer, body, response};
use super::derivatives::Differentiated;
use super::functions::ServedJob;
use super::gate;
use super::model::ServedModel;
use super::protocol_error::{ProtocolError, ProtocolErrorKind, quoted};
use super::request_config::RequestConfig;
use super::request_fields::RequestFields;

/// Version of the protocol.
const PROTOCOL_VERSION: f64 = 1.0;
/// What a request asks of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Operation {
    ModelInfo,
    InputSizes,
    OutputSizes,
    Evaluate,
    Gradient,
    ApplyJacobian,
    ApplyHessian,
}

impl Operation {
    const ALL: [Self; 7] = [
        Self::ModelInfo,
        Self::InputSizes,
        Self::OutputSizes,
        Self::Evaluate,
        Self::Gradient,
        Self::ApplyJacobian,
        Self::ApplyHessian,
    ];

    fn path(self) -> &'static str {
        match self {
            Self::ModelInfo => "/ModelInfo",
            Self::InputSizes => "/InputSizes",
            Self::OutputSizes => "/OutputSizes",
            Self::Evaluate => "/Evaluate",
            Self::Gradient => "/Gradient",
            Self::ApplyJacobian => "/ApplyJacobian",
            Self::ApplyHessian => "/ApplyHessian",
        }
    }

    /// Answers a request. The name is looked at before everything else.
    async fn answer(
        self,
        served: Arc<ServedJob>,
        body: &[u8],
    ) -> Result<JsonAnswer, ProtocolError> {
        let fields = RequestFields::parse(body)?;
        let model = served.model(fields.name()?)?;
        let size = served.inputs(model);
        match self {
            Self::ModelInfo => Ok((
                json!({"support": {
                    "Evaluate": true, "Gradient": true, "ApplyJacobian": true, "ApplyHessian": false
                }}),
                Vec::new(),
            )),
            Self::InputSizes => Ok((json!({"inputSizes": [size]}), Vec::new())),
            Self::OutputSizes => Ok((json!({"outputSizes": [model.outputs()]}), Vec::new())),
            Self::Evaluate => {
                let input = fields.input(size)?;
                let config = RequestConfig::read(model, fields.config())?;
                let found = served.value(model, &config, &input).await?;
                Ok((json!({"output": [found.output]}), found.notes))
            }
            Self::Gradient => {
                let at = differentiated(served, model, &fields)?;
                let sens = fields.vector("sens", model.outputs())?;
                Ok((json!({"output": at.gradient(&sens).await?}), Vec::new()))
            }
            Self::ApplyJacobian => {
                let at = differentiated(served, model, &fields)?;
                let direction = fields.vector("vec", size)?;
                Ok((json!({"output": at.along(direction).await?}), Vec::new()))
            }
            Self::ApplyHessian => Err(ProtocolError::new(
                ProtocolErrorKind::UnsupportedFeature,
                format!(
                    "the model {:?} does not support ApplyHessian: second differences of picked \
                     velocities are too inaccurate; difference Gradient over steps that suit you",
                    model.name()
                ),
            )),
        }
    }
}

/// Reads what `Gradient` and `ApplyJacobian` have in common.
fn differentiated(
    served: Arc<ServedJob>,
    model: ServedModel,
    fields: &RequestFields,
) -> Result<Differentiated, ProtocolError> {
    fields.only_index("outWrt")?;
    fields.only_index("inWrt")?;
    let input = fields.input(served.inputs(model))?;
    let config = RequestConfig::read(model, fields.config())?;
    Ok(Differentiated { served, model, config, input })
}

/// Returns the endpoints for a job, behind the gate, which knows `hosts`.
pub fn router(served: Arc<ServedJob>, hosts: OwnHosts) -> Router {
    let mut router = Router::new().route("/", get(front)).route("/Info", get(info));
    for operation in Operation::ALL {
        let answered = move |State(served): State<Arc<ServedJob>>, request: Request| async move {
            let answer = async {
                operation.answer(served, &body(request.into_body(), BODY_S_MAX).await?).await
            };
            response(answer.await)
        };
        router = router.route(operation.path(), post(answered));
    }
    router
        .fallback(unknown)
        .method_not_allowed_fallback(wrong_method)
        .with_state(served)
        .layer(from_fn_with_state(hosts, gate::guard))
}

/// For people, and for clients that only look whether there is a server.
async fn front() -> Response {
    let text = "osteon: a server of the UM-Bridge protocol 1.0; GET /Info lists its models\n";
    let mut response = Response::new(Body::from(text));
    let content_type = HeaderValue::from_static("text/plain; charset=utf-8");
    response.headers_mut().insert(CONTENT_TYPE, content_type);
    response
}

async fn info(State(served): State<Arc<ServedJob>>) -> Response {
    let models = served.models();
    response(Ok((json!({"protocolVersion": PROTOCOL_VERSION, "models": models}), Vec::new())))
}

async fn unknown(uri: Uri) -> Response {
    let paths: Vec<&str> = Operation::ALL.into_iter().map(Operation::path).collect();
    let path = quoted(uri.path());
    let message = format!("there is no endpoint {path}; there are: /Info, {}", paths.join(", "));
    let error = ProtocolError::new(ProtocolErrorKind::UnsupportedFeature, message);
    response(Err(error.with_status(StatusCode::NOT_FOUND)))
}

async fn wrong_method(method: Method, uri: Uri) -> Response {
    let wanted = if ["/", "/Info"].contains(&uri.path()) { "GET" } else { "POST" };
    let message = format!("{} does not take {method}; use {wanted}", uri.path());
    let error = ProtocolError::input(message).with_status(StatusCode::METHOD_NOT_ALLOWED);
    response(Err(error))
}
