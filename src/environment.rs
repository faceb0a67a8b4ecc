//! What the environment says of a coordinator: options that every command would repeat.

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::anyhow;
use osteon_proto::credentials::CredentialFiles;
use osteon_proto::endpoint::Endpoint;

use crate::ending::Failure;

/// Names the coordinator.
pub(crate) const COORDINATOR: &str = "OSTEON_COORDINATOR";
const TLS_CA: &str = "OSTEON_TLS_CA";
const TLS_CERT: &str = "OSTEON_TLS_CERT";
const TLS_KEY: &str = "OSTEON_TLS_KEY";
const TOKEN_FILE: &str = "OSTEON_TOKEN_FILE";

/// The variables that name files of certificates and a token.
pub(crate) const FILES: [&str; 4] = [TLS_CA, TLS_CERT, TLS_KEY, TOKEN_FILE];

/// What the environment says; an option counts before it, and an empty variable counts as none.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Environment {
    coordinator: Option<String>,
    files: CredentialFiles,
}

impl Environment {
    /// Reads the variables of this process.
    ///
    /// # Errors
    /// When the name of the coordinator is no text.
    pub(crate) fn of_process() -> Result<Self, Failure> {
        Self::read(|name| std::env::var_os(name))
    }

    /// Reads the variables that `variable` knows.
    ///
    /// # Errors
    /// As [`of_process`](Self::of_process).
    pub(crate) fn read(variable: impl Fn(&str) -> Option<OsString>) -> Result<Self, Failure> {
        let given = |name| variable(name).filter(|value| !value.is_empty());
        let file = |name| given(name).map(PathBuf::from);
        let coordinator = given(COORDINATOR).map(OsString::into_string).transpose();
        Ok(Self {
            coordinator: coordinator.map_err(|value| {
                Failure::bad_input(anyhow!("in {COORDINATOR}: {value:?} is no text"))
            })?,
            files: CredentialFiles {
                ca: file(TLS_CA),
                certificate: file(TLS_CERT),
                key: file(TLS_KEY),
                token: file(TOKEN_FILE),
            },
        })
    }

    /// The coordinator that the environment names, if it names one.
    ///
    /// # Errors
    /// When what it names is no address.
    pub(crate) fn coordinator(&self) -> Result<Option<Endpoint>, Failure> {
        let parsed = self.coordinator.as_deref().map(str::parse::<Endpoint>).transpose();
        parsed.map_err(|error| {
            Failure::bad_input(anyhow::Error::new(error).context(format!("in {COORDINATOR}")))
        })
    }

    /// The coordinator that a command cannot do without.
    ///
    /// # Errors
    /// When neither the option nor the environment names one.
    pub(crate) fn needed(&self, option: Option<Endpoint>) -> Result<Endpoint, Failure> {
        match option {
            Some(endpoint) => Ok(endpoint),
            None => self.coordinator()?.ok_or_else(|| {
                Failure::bad_input(anyhow!(
                    "no coordinator is given; use --coordinator URL or set {COORDINATOR}"
                ))
            }),
        }
    }

    /// The files for the coordinator at `endpoint`: those of the options, and those of the
    /// environment where there is no option and the address has a use for them. A certificate and
    /// its key come from the same place.
    pub(crate) fn files(&self, options: CredentialFiles, endpoint: &Endpoint) -> CredentialFiles {
        let encrypted = matches!(endpoint, Endpoint::Https(_));
        let private = encrypted || endpoint.is_local();
        let own = options.certificate.is_some() || options.key.is_some();
        let of_tls = |file: &Option<PathBuf>| file.clone().filter(|_| encrypted);
        CredentialFiles {
            ca: options.ca.or_else(|| of_tls(&self.files.ca)),
            certificate: match own {
                true => options.certificate,
                false => of_tls(&self.files.certificate),
            },
            key: if own { options.key } else { of_tls(&self.files.key) },
            token: options.token.or_else(|| self.files.token.clone().filter(|_| private)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment(variables: &[(&str, &str)]) -> Environment {
        let value = |name: &str| variables.iter().find(|(known, _)| *known == name);
        Environment::read(|name| value(name).map(|(_, value)| value.into())).unwrap()
    }

    fn all() -> Environment {
        environment(&[
            (TLS_CA, "ca"),
            (TLS_CERT, "cert"),
            (TLS_KEY, "key"),
            (TOKEN_FILE, "token"),
            (COORDINATOR, "https://a:1"),
        ])
    }

    /// Authority, certificate, key and token that are used at `url`.
    fn used(environment: &Environment, options: CredentialFiles, url: &str) -> [String; 4] {
        let files = environment.files(options, &url.parse().unwrap());
        [files.ca, files.certificate, files.key, files.token]
            .map(|file| file.map_or("-".to_owned(), |file| file.display().to_string()))
    }

    #[test]
    fn a_client_needs_a_coordinator_and_an_empty_variable_is_none() {
        let resolved = |option: Option<&str>, variable: Option<&str>| {
            let variables: Vec<_> = variable.iter().map(|value| (COORDINATOR, *value)).collect();
            let option = option.map(|url| url.parse().unwrap());
            environment(&variables).needed(option).map(|endpoint| endpoint.to_string())
        };
        assert_eq!(resolved(Some("unix:a"), Some("unix:b")).unwrap(), "unix:a");
        assert_eq!(resolved(Some("unix:a"), Some("")).unwrap(), "unix:a");
        assert_eq!(resolved(None, Some("unix:b")).unwrap(), "unix:b");
        for (variable, expected) in
            [(None, "--coordinator URL"), (Some(""), "--coordinator URL"), (Some("b"), "`b`")]
        {
            let failure = resolved(None, variable).unwrap_err();
            assert_eq!(failure.exit_code(), 2);
            assert!(failure.to_string().contains(expected), "{failure}");
        }
    }

    #[test]
    fn files_of_the_environment_count_where_no_option_names_one() {
        let none = CredentialFiles::default;
        assert_eq!(used(&all(), none(), "https://a:1"), ["ca", "cert", "key", "token"]);
        assert_eq!(used(&environment(&[(TLS_CA, "")]), none(), "https://a:1"), ["-"; 4]);
        let ca = CredentialFiles { ca: Some("mine".into()), ..none() };
        assert_eq!(used(&all(), ca, "https://a:1"), ["mine", "cert", "key", "token"]);
        let token = CredentialFiles { token: Some("mine".into()), ..none() };
        assert_eq!(used(&all(), token, "https://a:1"), ["ca", "cert", "key", "mine"]);
        // A certificate never meets the key of another.
        let certificate = CredentialFiles { certificate: Some("mine".into()), ..none() };
        assert_eq!(used(&all(), certificate, "https://a:1"), ["ca", "mine", "-", "token"]);
    }

    #[test]
    fn files_of_the_environment_are_left_out_where_an_address_has_no_use_for_them() {
        let none = CredentialFiles::default;
        for (url, expected) in [
            ("http://127.0.0.1:1", ["-", "-", "-", "token"]),
            ("unix:/run/osteon", ["-", "-", "-", "token"]),
            // There a token could be read by others.
            ("http://node-1:1", ["-", "-", "-", "-"]),
        ] {
            assert_eq!(used(&all(), none(), url), expected, "{url}");
        }
    }
}
