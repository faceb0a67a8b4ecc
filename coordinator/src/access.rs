//! Access control: decides which caller may call which method, from the listener's policy and the
//! caller's certificate and token. It uses no socket and never waits.

pub(crate) mod layer;
pub(crate) mod limiter;
pub(crate) mod message_body;
pub mod tls;
pub mod tokens;

use osteon_transport::certificates::WORKER_NAME;
use osteon_transport::token::Token;
use thiserror::Error;

use crate::access::tokens::{Role, Tokens};

/// Name of the token's holder, stored in the extensions of a call.
#[derive(Debug, Clone)]
pub(crate) struct HolderName(pub(crate) String);

/// Callers that a listener admits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Policy {
    /// Everybody who can connect.
    Everybody,
    /// On a listener without TLS: holders of tokens, workers among them.
    Tokens(Tokens),
    /// On a listener with TLS: clients with tokens, workers with certificates.
    Tls(Tokens),
}

/// Result of the check of a peer's certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certificate {
    /// The peer sent none.
    Absent,
    /// Valid, for a worker.
    Worker,
    /// Valid, for another purpose.
    Other,
    /// Not valid, so nothing in it counts.
    Faulty(Fault),
}

/// Reason why a certificate is not valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Fault {
    /// An unknown authority signed it.
    #[error(
        "it is not signed by the coordinator's certificate authority (its --tls-ca); make a \
             certificate with that authority"
    )]
    UnknownAuthority,
    /// It has expired.
    #[error("it has expired; make a new one")]
    Expired,
    /// It is not valid yet.
    #[error("it is not valid yet; check the clocks")]
    NotYetValid,
    /// Its usage is another one, for example that of a coordinator.
    #[error("it is not for clients or workers; make one with `osteon certs`")]
    OtherUsage,
    /// It cannot be read.
    #[error("it cannot be used; make one with `osteon certs`")]
    Unusable,
}

/// Credentials in the header of a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Presented<'a> {
    /// There are none.
    Nothing,
    /// The text of a bearer token, unchecked.
    Token(&'a str),
    /// The header is not that of a bearer token.
    Unreadable,
}

/// Requirement of a method on its caller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Requirement {
    /// No requirement.
    Nothing,
    /// Any token or certificate.
    Known,
    /// A token with this role, or one above it.
    Role(Role),
    /// The caller is a worker.
    Worker,
}

/// Reason for refusing a call.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum AccessDenied {
    /// The call has no token.
    #[error("this coordinator requires a token; give --token-file FILE")]
    NoToken,
    /// The header is not that of a bearer token.
    #[error("the header `authorization` must be `Bearer` and a token")]
    Unreadable,
    /// The token is not in the list.
    #[error(
        "this coordinator does not accept the token: it was revoked, or belongs to another \
         coordinator"
    )]
    UnknownToken,
    /// The role of the token is not sufficient.
    #[error("the token of `{name}` has role {}, and this needs role {}", has.name(), needs.name())]
    WeakRole {
        /// Name of the token's holder.
        name: String,
        /// Role of the token.
        has: Role,
        /// Required role.
        needs: Role,
    },
    /// A worker called without a certificate.
    #[error(
        "this coordinator accepts only workers with a certificate; give --tls-cert and --tls-key"
    )]
    NoCertificate,
    /// The certificate is not valid.
    #[error("the certificate in --tls-cert is refused: {0}")]
    Faulty(Fault),
    /// The certificate is for another purpose.
    #[error(
        "the certificate is not a worker's: it lacks the name `{WORKER_NAME}`; make one with \
         `osteon certs`"
    )]
    NotAWorker,
}

/// Returns the requirement of the method at `path`. A method that is not listed has the strictest
/// one.
pub fn requirement(path: &str) -> Requirement {
    let Some((service, method)) = path.strip_prefix('/').and_then(|path| path.split_once('/'))
    else {
        return Requirement::Known;
    };
    match (service, method) {
        ("grpc.health.v1.Health", _) => Requirement::Nothing,
        ("osteon.v1.Workers", _) => Requirement::Worker,
        (
            "osteon.v1.Jobs",
            "Get" | "Explain" | "List" | "ListBans" | "ListWorkers" | "Watch" | "Fetch",
        ) => Requirement::Role(Role::Read),
        ("osteon.v1.Jobs", "Submit" | "Cancel" | "Recheck") => Requirement::Role(Role::Submit),
        ("osteon.v1.Jobs", _) => Requirement::Role(Role::Admin),
        // Reflection, and services that do not exist.
        _ => Requirement::Known,
    }
}

/// Returns the requirement of a path of the live page: that of the method which gives or does the same.
pub fn page_requirement(path: &str) -> Requirement {
    match path {
        // The page itself is the same for everybody, and says nothing of any job.
        "/" | "/page.css" | "/page.js" | "/charts.js" | "/icon.svg" => Requirement::Nothing,
        "/data/jobs" => requirement("/osteon.v1.Jobs/List"),
        "/data/overview" => requirement("/osteon.v1.Jobs/ListWorkers"),
        "/events" => requirement("/osteon.v1.Jobs/Watch"),
        path if path.starts_with("/data/jobs/") && path.ends_with("/cancel") => {
            requirement("/osteon.v1.Jobs/Cancel")
        }
        path if path.starts_with("/data/jobs/") => requirement("/osteon.v1.Jobs/Explain"),
        _ => Requirement::Known,
    }
}

/// Decides whether a call is admitted. Returns the name of the token's holder if a token decided
/// it.
///
/// # Errors
/// The reason for a refusal, to be sent to the caller.
pub fn decide<'a>(
    policy: &'a Policy,
    certificate: Certificate,
    presented: Presented<'_>,
    need: Requirement,
) -> Result<Option<&'a str>, AccessDenied> {
    let tokens = match policy {
        Policy::Everybody => return Ok(None),
        Policy::Tokens(tokens) | Policy::Tls(tokens) => tokens,
    };
    let in_order = matches!(certificate, Certificate::Worker | Certificate::Other);
    let needs = match need {
        Requirement::Nothing => return Ok(None),
        Requirement::Known if in_order => return Ok(None),
        Requirement::Known => Role::Read,
        Requirement::Role(role) => role,
        Requirement::Worker => match (policy, certificate) {
            (Policy::Tls(_), Certificate::Worker) => return Ok(None),
            (Policy::Tls(_), Certificate::Other) => return Err(AccessDenied::NotAWorker),
            (Policy::Tls(_), Certificate::Absent) => return Err(AccessDenied::NoCertificate),
            (_, Certificate::Faulty(fault)) => return Err(AccessDenied::Faulty(fault)),
            // Only a certificate proves that a caller is a worker. Without TLS there is none, and
            // only an administrator may answer for results.
            _ => Role::Admin,
        },
    };
    if let Certificate::Faulty(fault) = certificate {
        return Err(AccessDenied::Faulty(fault));
    }
    let holder = match presented {
        Presented::Nothing => return Err(AccessDenied::NoToken),
        Presented::Unreadable => return Err(AccessDenied::Unreadable),
        Presented::Token(text) => tokens.holder(text).ok_or(AccessDenied::UnknownToken)?,
    };
    if holder.role < needs {
        return Err(AccessDenied::WeakRole { name: holder.name.clone(), has: holder.role, needs });
    }
    Ok(Some(&holder.name))
}

/// Returns the token in the value of the header `authorization`.
pub fn presented(header: Option<&[u8]>) -> Presented<'_> {
    let Some(header) = header else { return Presented::Nothing };
    let Ok(text) = std::str::from_utf8(header) else { return Presented::Unreadable };
    match text.split_once(' ') {
        Some((scheme, token)) if scheme.eq_ignore_ascii_case("bearer") => {
            if Token::parse(token).is_ok() {
                Presented::Token(token)
            } else {
                Presented::Unreadable
            }
        }
        _ => Presented::Unreadable,
    }
}

#[cfg(test)]
mod tests;
