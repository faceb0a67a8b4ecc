//! Who may call what. Decided from the listener's policy, the caller's certificate and token;
//! knows no socket, and nothing waits here.

use osteon_proto::token::Token;
use thiserror::Error;

use crate::tokens::{Role, Tokens};

/// The name that a token is registered for, in the extensions of a call.
#[derive(Debug, Clone)]
pub(crate) struct Holder(pub(crate) String);

/// The name in a worker's certificate (a URI among its subject's alternative names).
pub const WORKER_NAME: &str = "urn:osteon:worker";
/// The name in a client's certificate (a URI among its subject's alternative names).
pub const CLIENT_NAME: &str = "urn:osteon:client";

/// Whom a listener lets in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Policy {
    /// Everybody who reaches it.
    Everybody,
    /// On a listener without TLS: holders of tokens, workers among them.
    Tokens(Tokens),
    /// On a listener with TLS: clients with tokens, workers with certificates.
    Tls(Tokens),
}

/// What a peer's certificate says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certificate {
    /// There is none.
    Absent,
    /// It is in order, and a worker's.
    Worker,
    /// It is in order, and for anything else.
    Other,
    /// It is not in order, and says nothing.
    Faulty(Fault),
}

/// Why a certificate is not in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Fault {
    /// Somebody else signed it.
    #[error("the coordinator's authority (its --tls-ca) has not signed it; make one with that")]
    UnknownAuthority,
    /// It is too old.
    #[error("it has expired; make a new one")]
    Expired,
    /// It is too young.
    #[error("it is not valid yet; are the clocks right?")]
    NotYetValid,
    /// It is for coordinators, say.
    #[error("it is not for clients or workers; make one with `osteon certs`")]
    OtherUsage,
    /// It cannot be understood.
    #[error("it cannot be used; make one with `osteon certs`")]
    Unusable,
}

/// What a call says of its token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Presented<'a> {
    /// Nothing.
    Nothing,
    /// A text that should be one.
    Token(&'a str),
    /// Something that is no bearer token.
    Unreadable,
}

/// What a method asks of its caller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// Nothing at all.
    Nothing,
    /// Any token or certificate.
    Known,
    /// A token with this role, or one above it.
    Role(Role),
    /// To be a worker.
    Worker,
}

/// Why a call is refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Denied {
    /// No token.
    #[error("this coordinator wants a token; give --token-file FILE")]
    NoToken,
    /// The header is not one of bearer tokens.
    #[error("the header `authorization` must be `Bearer` and a token")]
    Unreadable,
    /// A token that is not in the list.
    #[error(
        "this coordinator does not know the token; it was withdrawn, or is meant for another one"
    )]
    UnknownToken,
    /// A token that allows less.
    #[error("the token of `{name}` has role {}, and this needs role {}", has.name(), needs.name())]
    WeakRole {
        /// The token's name.
        name: String,
        /// What it allows.
        has: Role,
        /// What is needed.
        needs: Role,
    },
    /// A worker without a certificate.
    #[error(
        "this coordinator takes workers with a certificate only; give --tls-cert and --tls-key"
    )]
    NoCertificate,
    /// A certificate that is not in order.
    #[error("the certificate in --tls-cert is refused: {0}")]
    Faulty(Fault),
    /// A certificate that is for something else.
    #[error(
        "the certificate is not a worker's: it lacks the name `{WORKER_NAME}`; make one with `osteon certs`"
    )]
    NotAWorker,
}

/// What the method at `path` asks of its caller. A method that is not listed asks for the most.
pub fn need(path: &str) -> Need {
    let Some((service, method)) = path.strip_prefix('/').and_then(|path| path.split_once('/'))
    else {
        return Need::Known;
    };
    match (service, method) {
        ("grpc.health.v1.Health", _) => Need::Nothing,
        ("osteon.v1.Workers", _) => Need::Worker,
        ("osteon.v1.Jobs", "Get" | "List" | "ListExpelled" | "ListWorkers" | "Watch" | "Fetch") => {
            Need::Role(Role::Read)
        }
        ("osteon.v1.Jobs", "Submit" | "Cancel") => Need::Role(Role::Submit),
        ("osteon.v1.Jobs", _) => Need::Role(Role::Admin),
        // Reflection, and what does not exist.
        _ => Need::Known,
    }
}

/// Whether the call may go on; the name of the token's holder, if a token decided it.
///
/// # Errors
/// When it may not, with the reason for the caller.
pub fn decide<'a>(
    policy: &'a Policy,
    certificate: Certificate,
    presented: Presented<'_>,
    need: Need,
) -> Result<Option<&'a str>, Denied> {
    let tokens = match policy {
        Policy::Everybody => return Ok(None),
        Policy::Tokens(tokens) | Policy::Tls(tokens) => tokens,
    };
    let in_order = matches!(certificate, Certificate::Worker | Certificate::Other);
    let needs = match need {
        Need::Nothing => return Ok(None),
        Need::Known if in_order => return Ok(None),
        Need::Known => Role::Read,
        Need::Role(role) => role,
        Need::Worker => match (policy, certificate) {
            (Policy::Tls(_), Certificate::Worker) => return Ok(None),
            (Policy::Tls(_), Certificate::Other) => return Err(Denied::NotAWorker),
            (Policy::Tls(_), Certificate::Absent) => return Err(Denied::NoCertificate),
            (_, Certificate::Faulty(fault)) => return Err(Denied::Faulty(fault)),
            // A certificate is the one proof of a worker; without TLS there is none, and only
            // who may do everything may answer for results.
            _ => Role::Admin,
        },
    };
    if let Certificate::Faulty(fault) = certificate {
        return Err(Denied::Faulty(fault));
    }
    let holder = match presented {
        Presented::Nothing => return Err(Denied::NoToken),
        Presented::Unreadable => return Err(Denied::Unreadable),
        Presented::Token(text) => tokens.holder(text).ok_or(Denied::UnknownToken)?,
    };
    if holder.role < needs {
        return Err(Denied::WeakRole { name: holder.name.clone(), has: holder.role, needs });
    }
    Ok(Some(&holder.name))
}

/// The token in the value of the header `authorization`.
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
