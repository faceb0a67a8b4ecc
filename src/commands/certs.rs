//! `certs`: a certificate authority and the certificates of one installation.

use std::path::Path;

use anyhow::{Context as _, anyhow};
use osteon_common::visible;
use osteon_transport::certificates::{Authority, CertificateHolder, PemPair};
use osteon_transport::credential_file;
use osteon_transport::endpoint;
use time::OffsetDateTime;
use zeroize::Zeroizing;

use crate::arguments::CertsArguments;
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::new_files::{self, NewFile};
use crate::output;
use crate::prepared_command::Ended;
use crate::resolved::OutputFormat;

/// Base name of the authority's files.
const AUTHORITY: &str = "ca";

/// Writes `NAME.pem` and `NAME-key.pem` for the authority, the coordinator (`server`), workers
/// (`worker`) and clients (`client`); prints their names.
pub(super) fn make(arguments: &CertsArguments) -> Ended {
    let CertsArguments { directory, host, days, ca } = arguments;
    if let Some(wrong) = host.iter().find(|host| !endpoint::is_host(host)) {
        return Err(CommandFailure::bad_input(anyhow!(
            "--host `{wrong}` is neither a host name nor an IP address"
        )));
    }
    let now = OffsetDateTime::now_utc();
    let (authority, mut files) = match ca {
        Some(ca) => existing(ca, directory)?,
        None => {
            let (authority, made) = Authority::new(now).map_err(unmade)?;
            (authority, pair(directory, AUTHORITY, made))
        }
    };
    let bearers = [
        ("server", CertificateHolder::Coordinator(host)),
        ("worker", CertificateHolder::Worker),
        ("client", CertificateHolder::Client),
    ];
    for (name, bearer) in bearers {
        let made = authority.sign(bearer, now, *days).map_err(unmade)?;
        files.extend(pair(directory, name, made));
    }
    new_files::private_directory(directory)?;
    new_files::create(&files)?;
    let names: String =
        files.iter().map(|file| format!("{}\n", visible::path(&file.path))).collect();
    output::stdout(OutputFormat::Text).verbatim(&names).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

/// Returns the authority in `ca`, and a copy of its certificate to be written to `directory`.
fn existing(ca: &Path, directory: &Path) -> Result<(Authority, Vec<NewFile>), CommandFailure> {
    let (certificate, key) = (ca.join("ca.pem"), ca.join("ca-key.pem"));
    credential_file::identity(&certificate, &key).map_err(CommandFailure::bad_input)?;
    let text = credential_file::trusted_text(&certificate).map_err(CommandFailure::bad_input)?;
    let secret = credential_file::secret_text(&key).map_err(CommandFailure::bad_input)?;
    let authority = Authority::from_pem(&text, &secret)
        .with_context(|| format!("{} is not an authority that can sign", certificate.display()))
        .map_err(CommandFailure::BadInput)?;
    let content = text.into_bytes().into();
    let copy = NewFile { path: directory.join("ca.pem"), content, secret: false };
    Ok((authority, vec![copy]))
}

fn pair(directory: &Path, name: &str, made: PemPair) -> Vec<NewFile> {
    let file = |suffix: &str, text: Zeroizing<String>, secret| NewFile {
        path: directory.join(format!("{name}{suffix}")),
        content: text.as_bytes().to_vec().into(),
        secret,
    };
    vec![file(".pem", made.certificate.into(), false), file("-key.pem", made.key, true)]
}

fn unmade(error: rcgen::Error) -> CommandFailure {
    CommandFailure::Failed(anyhow::Error::new(error).context("cannot make a certificate"))
}
