use std::path::Path;

use super::*;

fn files(text: &str) -> CredentialFiles {
    let mut files = CredentialFiles::default();
    for option in text.split_whitespace() {
        let file = match option {
            "ca" => &mut files.ca,
            "cert" => &mut files.certificate,
            "key" => &mut files.key,
            _ => &mut files.token,
        };
        *file = Some(Path::new("/nonexistent").join(option));
    }
    files
}

fn refusal(url: &str, options: &str) -> String {
    let endpoint = url.parse().unwrap();
    Credentials::load(&files(options), &endpoint).unwrap_err().to_string()
}

#[test]
fn files_that_do_not_fit_the_address_are_refused_unread() {
    for (url, options, expected) in [
        ("https://a:1", "", "needs --tls-ca"),
        ("https://a:1", "cert key", "needs --tls-ca"),
        ("http://127.0.0.1:1", "ca", "--tls-ca requires TLS"),
        ("http://a:1", "cert", "--tls-cert requires TLS"),
        ("unix:a", "key", "--tls-key requires TLS"),
        ("http://a:1", "token", "not sent to http://a:1 in the clear"),
        ("http://10.0.0.1:1", "token", "in the clear"),
        // These combinations are accepted, so the files are read.
        ("http://127.0.0.1:1", "token", "cannot read /nonexistent/token"),
        ("http://localhost:1", "token", "cannot read /nonexistent/token"),
        ("unix:a", "token", "cannot read /nonexistent/token"),
        ("https://a:1", "ca", "cannot read /nonexistent/ca"),
    ] {
        let message = refusal(url, options);
        assert!(message.contains(expected), "{url} {options}: {message}");
    }
}

#[test]
fn without_files_nothing_is_shown() {
    for url in ["http://a:1", "unix:a"] {
        let endpoint = url.parse().unwrap();
        let credentials = Credentials::load(&files(""), &endpoint).unwrap();
        assert!(credentials.tls.is_none() && credentials.bearer.0.is_none(), "{url}");
    }
}

#[test]
fn a_token_is_shown_and_not_printed() {
    let token = Token::generate().unwrap();
    let mut bearer = TokenInterceptor::new(Some(&token));
    let request = bearer.call(Request::new(())).unwrap();
    let header = request.metadata().get("authorization").unwrap();
    assert_eq!(header.to_str().unwrap(), format!("Bearer {}", token.reveal()));
    assert!(header.is_sensitive());
    assert!(!format!("{bearer:?} {request:?}").contains(token.reveal()));
}
