//! The environment variables that replace options: where the coordinator is, the files for it, and the name of
//! a worker's machine.

use std::ffi::OsString;
use std::fmt;
use std::path::PathBuf;

use osteon_transport::credentials::CredentialFiles;
use osteon_transport::endpoint::{Endpoint, EndpointError};
use thiserror::Error;

/// The variable with the address of the coordinator.
pub const COORDINATOR: &str = "OSTEON_COORDINATOR";
const TLS_CA: &str = "OSTEON_TLS_CA";
const TLS_CERT: &str = "OSTEON_TLS_CERT";
const TLS_KEY: &str = "OSTEON_TLS_KEY";
const TOKEN_FILE: &str = "OSTEON_TOKEN_FILE";
/// The variable with the name of a worker's machine.
const HOST: &str = "OSTEON_HOST";

/// The variables that name credential files.
pub const FILES: [&str; 4] = [TLS_CA, TLS_CERT, TLS_KEY, TOKEN_FILE];

/// Reason why the variables cannot be used.
#[derive(Debug, Error)]
pub enum EnvironmentError {
    /// A value is not text.
    #[error("in {variable}: {value:?} is not valid UTF-8")]
    NotUnicode {
        /// The variable.
        variable: &'static str,
        /// Its value.
        value: OsString,
    },
    /// The value is not an address.
    #[error("in {COORDINATOR}: {0}")]
    Address(EndpointError),
    /// Neither an option nor the environment names a coordinator.
    #[error("no coordinator is given; use --coordinator URL or set {COORDINATOR}")]
    NoCoordinator,
}

/// The values of the variables. An option takes precedence, and an empty variable counts as unset.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Environment {
    coordinator: Option<String>,
    host: Option<String>,
    files: CredentialFiles,
}

impl Environment {
    /// Reads the variables of this process.
    ///
    /// # Errors
    /// If the coordinator's address or the name of the machine is not valid Unicode.
    pub fn from_process() -> Result<Self, EnvironmentError> {
        Self::read(|name| std::env::var_os(name))
    }

    /// Reads the variables through the function `variable`.
    ///
    /// # Errors
    /// Same as [`from_process`](Self::from_process).
    pub fn read(variable: impl Fn(&str) -> Option<OsString>) -> Result<Self, EnvironmentError> {
        let read_nonempty = |name| variable(name).filter(|value| !value.is_empty());
        let file = |name| read_nonempty(name).map(PathBuf::from);
        let text = |name| {
            let text = read_nonempty(name).map(OsString::into_string).transpose();
            text.map_err(|value| EnvironmentError::NotUnicode { variable: name, value })
        };
        Ok(Self {
            coordinator: text(COORDINATOR)?,
            host: text(HOST)?,
            files: CredentialFiles {
                ca: file(TLS_CA),
                certificate: file(TLS_CERT),
                key: file(TLS_KEY),
                token: file(TOKEN_FILE),
            },
        })
    }

    /// Returns the name of a worker's machine, if there is one.
    pub fn host(&self) -> Option<String> {
        self.host.clone()
    }

    /// Returns the coordinator named in the environment, if there is one.
    ///
    /// # Errors
    /// If the value is not an address.
    pub fn coordinator(&self) -> Result<Option<Endpoint>, EnvironmentError> {
        let parsed = self.coordinator.as_deref().map(str::parse::<Endpoint>).transpose();
        parsed.map_err(EnvironmentError::Address)
    }

    /// Returns the coordinator of a command that requires one.
    ///
    /// # Errors
    /// If neither the option nor the environment names one, or if what the environment names is no address.
    pub fn required_coordinator(
        &self,
        option: Option<Endpoint>,
    ) -> Result<Endpoint, EnvironmentError> {
        match option {
            Some(endpoint) => Ok(endpoint),
            None => self.coordinator()?.ok_or(EnvironmentError::NoCoordinator),
        }
    }

    /// Returns the files for the coordinator at `endpoint`: those of the options, and, where there
    /// is no option and the address can use them, those of the environment. Certificate and key are
    /// always taken from the same source. If the environment names another coordinator, its files
    /// belong to that one: they are not used, so that a stranger never receives their token.
    pub fn files(
        &self,
        options: CredentialFiles,
        endpoint: &Endpoint,
    ) -> (CredentialFiles, Unused) {
        let encrypted = matches!(endpoint, Endpoint::Https(_));
        let private = encrypted || endpoint.is_local();
        let own = options.certificate.is_some() || options.key.is_some();
        let file_if = |file: &Option<PathBuf>, wanted: bool| file.clone().filter(|_| wanted);
        let wanted = CredentialFiles {
            ca: file_if(&self.files.ca, encrypted && options.ca.is_none()),
            certificate: file_if(&self.files.certificate, encrypted && !own),
            key: file_if(&self.files.key, encrypted && !own),
            token: file_if(&self.files.token, private && options.token.is_none()),
        };
        match &self.coordinator {
            Some(other) if !is_at(other, endpoint) => (options, Unused::from_files(&wanted)),
            _ => {
                let files = CredentialFiles {
                    ca: options.ca.or(wanted.ca),
                    certificate: options.certificate.or(wanted.certificate),
                    key: options.key.or(wanted.key),
                    token: options.token.or(wanted.token),
                };
                (files, Unused::default())
            }
        }
    }
}

/// Returns whether the text is the address of the coordinator at `endpoint`. Host names ignore
/// case.
fn is_at(text: &str, endpoint: &Endpoint) -> bool {
    match (text.parse(), endpoint) {
        (Ok(Endpoint::Https(one)), Endpoint::Https(other))
        | (Ok(Endpoint::Http(one)), Endpoint::Http(other)) => one.eq_ignore_ascii_case(other),
        (Ok(named), _) => named == *endpoint,
        (Err(_), _) => false,
    }
}

/// Variables that were not used because the environment names a different coordinator from the
/// command line; may be empty.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Unused(Vec<(&'static str, &'static str)>);

impl Unused {
    fn from_files(files: &CredentialFiles) -> Self {
        let all = [
            (&files.ca, TLS_CA, "--tls-ca FILE"),
            (&files.certificate, TLS_CERT, "--tls-cert FILE"),
            (&files.key, TLS_KEY, "--tls-key FILE"),
            (&files.token, TOKEN_FILE, "--token-file FILE"),
        ];
        let named = all.into_iter().filter(|(file, ..)| file.is_some());
        Self(named.map(|(_, variable, option)| (variable, option)).collect())
    }

    /// Returns whether no variable was left unused.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl fmt::Display for Unused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (variables, options): (Vec<_>, Vec<_>) = self.0.iter().copied().unzip();
        let were = if variables.len() == 1 { "was" } else { "were" };
        let (variables, options) = (variables.join(", "), options.join(" "));
        write!(
            f,
            "{variables} {were} not used, because this coordinator is not the one that {COORDINATOR} \
             names; give {options}"
        )
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
        environment_of(Some("https://a:1"))
    }

    /// An environment with every file, and the given coordinator.
    fn environment_of(named: Option<&str>) -> Environment {
        let mut variables =
            vec![(TLS_CA, "ca"), (TLS_CERT, "cert"), (TLS_KEY, "key"), (TOKEN_FILE, "token")];
        variables.extend(named.map(|url| (COORDINATOR, url)));
        environment(&variables)
    }

    /// Returns authority, certificate, key and token that are used at `url`.
    fn used_files(environment: &Environment, options: CredentialFiles, url: &str) -> [String; 4] {
        let (files, _) = environment.files(options, &url.parse().unwrap());
        [files.ca, files.certificate, files.key, files.token]
            .map(|file| file.map_or("-".to_owned(), |file| file.display().to_string()))
    }

    #[test]
    fn a_client_needs_a_coordinator_and_an_empty_variable_is_none() {
        let resolved = |option: Option<&str>, variable: Option<&str>| {
            let variables: Vec<_> = variable.iter().map(|value| (COORDINATOR, *value)).collect();
            let option = option.map(|url| url.parse().unwrap());
            environment(&variables)
                .required_coordinator(option)
                .map(|endpoint| endpoint.to_string())
        };
        assert_eq!(resolved(Some("unix:a"), Some("unix:b")).unwrap(), "unix:a");
        assert_eq!(resolved(Some("unix:a"), Some("")).unwrap(), "unix:a");
        assert_eq!(resolved(None, Some("unix:b")).unwrap(), "unix:b");
        for (variable, expected) in
            [(None, "--coordinator URL"), (Some(""), "--coordinator URL"), (Some("b"), "`b`")]
        {
            let failure = resolved(None, variable).unwrap_err();
            assert!(failure.to_string().contains(expected), "{failure}");
        }
    }

    #[test]
    fn files_of_the_environment_count_where_no_option_names_one() {
        let none = CredentialFiles::default;
        assert_eq!(used_files(&all(), none(), "https://a:1"), ["ca", "cert", "key", "token"]);
        assert_eq!(used_files(&environment(&[(TLS_CA, "")]), none(), "https://a:1"), ["-"; 4]);
        let ca = CredentialFiles { ca: Some("mine".into()), ..none() };
        assert_eq!(used_files(&all(), ca, "https://a:1"), ["mine", "cert", "key", "token"]);
        let token = CredentialFiles { token: Some("mine".into()), ..none() };
        assert_eq!(used_files(&all(), token, "https://a:1"), ["ca", "cert", "key", "mine"]);
        // A certificate is never combined with a key from another source.
        let certificate = CredentialFiles { certificate: Some("mine".into()), ..none() };
        assert_eq!(used_files(&all(), certificate, "https://a:1"), ["ca", "mine", "-", "token"]);
    }

    #[test]
    fn files_of_the_environment_are_left_out_where_an_address_has_no_use_for_them() {
        let none = CredentialFiles::default;
        for (url, expected) in [
            ("http://127.0.0.1:1", ["-", "-", "-", "token"]),
            ("unix:/run/osteon", ["-", "-", "-", "token"]),
            // The token would be sent unencrypted to this address.
            ("http://node-1:1", ["-", "-", "-", "-"]),
        ] {
            assert_eq!(used_files(&environment_of(Some(url)), none(), url), expected, "{url}");
        }
    }

    #[test]
    fn files_of_the_environment_are_for_the_coordinator_that_it_names() {
        let none = CredentialFiles::default;
        let every = ["ca", "cert", "key", "token"];
        for (named, url, expected) in [
            (Some("https://a:1"), "https://a:1", every),
            (Some("https://A:1/"), "https://a:1", every),
            // Without an address in the environment, the files apply to any coordinator on the
            // command line.
            (None, "https://b:1", every),
            (Some(""), "https://b:1", every),
            (Some("https://a:1"), "https://b:1", ["-"; 4]),
            (Some("https://a:1"), "https://a:2", ["-"; 4]),
            (Some("https://localhost:1"), "http://localhost:1", ["-"; 4]),
            (Some("unix:A"), "unix:a", ["-"; 4]),
            (Some("no address"), "https://a:1", ["-"; 4]),
        ] {
            assert_eq!(
                used_files(&environment_of(named), none(), url),
                expected,
                "{named:?}: {url}"
            );
        }
        let mine = CredentialFiles { ca: Some("mine".into()), ..none() };
        assert_eq!(used_files(&all(), mine.clone(), "https://b:1"), ["mine", "-", "-", "-"]);
        let unused = |options, url: &str| {
            let (_, unused) = all().files(options, &url.parse().unwrap());
            (!unused.is_empty()).then(|| unused.to_string())
        };
        assert_eq!(unused(none(), "https://a:1"), None);
        // Variables are not reported as unused if there is an option, or if the address cannot use
        // them.
        assert_eq!(unused(none(), "http://b:1"), None);
        let told = unused(mine, "https://b:1").unwrap();
        assert_eq!(
            told,
            "OSTEON_TLS_CERT, OSTEON_TLS_KEY, OSTEON_TOKEN_FILE were not used, because this \
             coordinator is not the one that OSTEON_COORDINATOR names; give --tls-cert FILE \
             --tls-key FILE --token-file FILE"
        );
    }
}
