//! The files of the page, which are part of the program, and the headers of every answer.

use axum::body::Body;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName, HeaderValue, REFERRER_POLICY,
    X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use axum::response::Response;
use osteon_report::{SCRIPT, STYLES};

/// The page loads nothing but its own files, runs no script within its text, is shown in no frame, and
/// sends its forms nowhere.
const CONTENT_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
                              img-src 'self'; base-uri 'none'; form-action 'none'; \
                              frame-ancestors 'none'";

/// Paths of the files.
pub(crate) const PATHS: [&str; 5] = ["/", "/page.css", "/page.js", "/charts.js", "/icon.svg"];

pub(crate) fn file(path: &str) -> Option<Response> {
    let (kind, text) = match path {
        "/" => ("text/html; charset=utf-8", include_str!("page/page.html").to_owned()),
        "/page.css" => {
            let [charts, page] = STYLES;
            let own = include_str!("page/page.css");
            ("text/css; charset=utf-8", format!("{charts}{page}{own}"))
        }
        "/page.js" => ("text/javascript; charset=utf-8", include_str!("page/page.js").to_owned()),
        "/charts.js" => ("text/javascript; charset=utf-8", SCRIPT.to_owned()),
        "/icon.svg" => ("image/svg+xml", include_str!("page/icon.svg").to_owned()),
        _ => return None,
    };
    let mut response = Response::new(Body::from(text));
    response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(kind));
    Some(response)
}

/// Adds the headers that every answer has.
pub(crate) fn protect(response: &mut Response) {
    let headers = response.headers_mut();
    for (name, value) in [
        (CONTENT_SECURITY_POLICY, CONTENT_POLICY),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (X_FRAME_OPTIONS, "DENY"),
        (REFERRER_POLICY, "no-referrer"),
        (CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
        (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_names_only_files_that_there_are_and_no_other_host() {
        let page = include_str!("page/page.html");
        for path in PATHS {
            assert!(file(path).is_some(), "{path}");
        }
        for attribute in ["href=\"", "src=\""] {
            for target in page.split(attribute).skip(1) {
                let target = target.split('"').next().unwrap();
                let is_file = PATHS.contains(&format!("/{target}").as_str());
                assert!(is_file || target.starts_with('#'), "{target}");
            }
        }
        assert!(
            !page.contains("<script>") && !page.contains(" style=") && !page.contains("onclick")
        );
    }
}
