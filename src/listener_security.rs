//! Access to a coordinator: the options about certificates and tokens, checked against the listen
//! address.

use std::os::unix::fs::FileTypeExt as _;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use osteon_coordinator::access::tls::TlsFiles;
use osteon_coordinator::{BindError, ListenAddress, Listener, Tls, Tokens};

use crate::arguments::CoordinatorArguments;
use crate::exit_status::CommandFailure;

/// Credentials that a listener requires of clients and workers.
pub(crate) enum ListenerSecurity {
    /// None.
    None,
    /// A token, without TLS.
    Tokens(Tokens),
    /// Certificates, and tokens.
    Tls(Tls, Tokens),
}

impl ListenerSecurity {
    /// Reads the files named by the options.
    ///
    /// # Errors
    /// If one cannot be used, or if the options do not fit the address.
    pub(crate) fn from_arguments(
        arguments: &CoordinatorArguments,
        address: &ListenAddress,
    ) -> Result<Self, CommandFailure> {
        let CoordinatorArguments { tls_ca, tls_cert, tls_key, .. } = arguments;
        let tokens = tokens(arguments)?;
        // All three or none: the parser sees to that.
        let (Some(ca), Some(certificate), Some(key)) = (tls_ca, tls_cert, tls_key) else {
            return match tokens {
                None => Ok(Self::None),
                Some(_) if !address.is_local() => Err(CommandFailure::bad_input(anyhow!(
                    "tokens would be readable on their way to {}; give --tls-cert, --tls-key and \
                     --tls-ca, or listen on a loopback address or unix:PATH",
                    arguments.listen
                ))),
                Some(tokens) => Ok(Self::Tokens(tokens)),
            };
        };
        if matches!(address, ListenAddress::Unix(_)) {
            return Err(CommandFailure::bad_input(anyhow!(
                "a Unix socket does not use TLS; leave out --tls-ca, --tls-cert and --tls-key"
            )));
        }
        let files = TlsFiles { ca: ca.clone(), certificate: certificate.clone(), key: key.clone() };
        let tls = Tls::load(&files).map_err(CommandFailure::bad_input)?;
        let tokens = tokens.ok_or_else(|| {
            CommandFailure::bad_input(anyhow!(
                "with TLS, --tokens FILE or --token-file FILE is required, because every client needs a token; \
                 `osteon token` makes one"
            ))
        })?;
        Ok(Self::Tls(tls, tokens))
    }

    /// The first of the files that is a pipe, if one is: a reload cannot read it again.
    pub(crate) fn first_pipe(arguments: &CoordinatorArguments) -> Option<&Path> {
        let CoordinatorArguments { tls_ca, tls_cert, tls_key, tokens, token_file, .. } = arguments;
        let files = [tls_ca, tls_cert, tls_key, tokens, token_file].into_iter().flatten();
        let is_pipe = |path: &Path| path.metadata().is_ok_and(|file| file.file_type().is_fifo());
        files.map(PathBuf::as_path).find(|path| is_pipe(path))
    }

    /// Binds the address.
    ///
    /// # Errors
    /// If it is not possible to listen on it.
    pub(crate) async fn bind(
        self,
        address: &ListenAddress,
        insecure: bool,
    ) -> Result<Listener, BindError> {
        match (self, address) {
            (Self::Tls(tls, tokens), ListenAddress::Tcp(address)) => {
                Listener::bind_tls(*address, tls, tokens).await
            }
            // TLS on a Unix socket was refused above.
            (Self::Tokens(tokens) | Self::Tls(_, tokens), _) => {
                Ok(Listener::bind(address, insecure).await?.with_tokens(tokens))
            }
            (Self::None, _) => Listener::bind(address, insecure).await,
        }
    }
}

/// Returns the tokens of the list, and that of `--token-file`, which is an administrator's; `None` without either.
fn tokens(arguments: &CoordinatorArguments) -> Result<Option<Tokens>, CommandFailure> {
    let CoordinatorArguments { tokens, token_file, .. } = arguments;
    let listed =
        tokens.as_deref().map(Tokens::read).transpose().map_err(CommandFailure::bad_input)?;
    match token_file {
        None => Ok(listed),
        Some(file) => {
            let listed = listed.unwrap_or_default();
            listed.with_admin(file).map(Some).map_err(CommandFailure::bad_input)
        }
    }
}
