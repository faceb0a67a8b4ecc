//! The live page: its data and its stream, access to it, and what becomes of it when the coordinator is
//! restarted.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
#[path = "support/api.rs"]
mod api;
#[cfg(test)]
#[path = "support/page.rs"]
mod page;
#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
#[path = "support/peer.rs"]
mod peer;
#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
#[path = "support/secure.rs"]
mod secure;
#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
#[path = "support/service.rs"]
mod service;
#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::net::TcpListener;

use osteon_common::job::JobKind;
use osteon_proto::v1::attach_request::Message;
use osteon_proto::v1::{AttachRequest, SubmitRequest, WorkerHello};
use osteon_transport::connection::{connect, workers_client};
use page::{Page, Updates};
use serde_json::Value;
use service::Service;
use support::{DEADLINE, Owned, Scratch, eventually, job, osteon, run, text};
use tokio_stream::wrappers::ReceiverStream;

/// A coordinator with a live page.
struct Served {
    service: Service,
    scratch: Scratch,
    page: Page,
}

impl Served {
    fn start(options: &[&str]) -> Self {
        let scratch = Scratch::new();
        let mut all = vec!["--http", "127.0.0.1:0"];
        all.extend(options);
        let service = Service::start(&scratch, &all);
        let page = Page::of_store(&scratch.path("store"));
        Self { service, scratch, page }
    }

    /// Submits a job; returns its number.
    fn submit(&self, realizations: u32, evaluations: u32, options: &[&str]) -> String {
        submit(&self.scratch, self.service.url(), realizations, evaluations, options)
    }
}

fn submit(
    scratch: &Scratch,
    url: &str,
    realizations: u32,
    evaluations: u32,
    options: &[&str],
) -> String {
    let file = scratch.write("job.toml", &job(realizations, evaluations));
    let mut words = vec!["submit", text(&file), "--coordinator", url, "--json"];
    words.extend(options);
    run(&words).json()["job"].as_str().unwrap().to_owned()
}

fn names(figures: &Value) -> Vec<&str> {
    let figures = figures["figures"].as_array().unwrap();
    figures.iter().map(|figure| figure["name"].as_str().unwrap()).collect()
}

/// Somebody opens the page, submits a job, and watches it to its end.
#[test]
fn a_job_is_watched_to_its_end() {
    let served = Served::start(&[]);
    let _worker = served.service.worker(&served.scratch);
    let id = served.submit(30, 12, &["--name", "tibia <3>", "--priority", "2"]);
    let mut updates = served.page.events(&format!("job={id}"), &[]).unwrap();
    let caller = updates.until("caller", |_| true);
    assert_eq!(caller["may_cancel"], true);
    let overview = updates.until("overview", |it| it["workers"]["count"] == 1);
    assert_eq!(overview["workers"]["hosts"][0]["workers"], 1);
    assert_eq!(overview["store"]["refusing_s"], 0);
    let listed = updates.until("jobs", |it| it["jobs"][0]["job"] == id.as_str());
    let shown = &listed["jobs"][0];
    assert_eq!([&shown["name"], &shown["kind"]], ["tibia <3>", "identification"]);
    // With those that measure derivatives.
    assert_eq!([&shown["priority"], &shown["max_evaluations"]], [2, 14]);
    let ended = updates.until("job", |it| it["state"] == "ended");
    assert_eq!(ended["status"], "max_evaluations", "{ended}");
    assert!(ended["explain"]["text"].as_str().unwrap().contains("ended"), "{ended}");
    let wanted = ended["evaluations"].as_u64().unwrap();
    // The figures of an ended job are those that a report has.
    let end = served.page.get(&format!("/data/jobs/{id}/figures")).json();
    let drawn = ["cost", "search-mean", "search-coefficient-of-variation", "search-parameters"];
    assert_eq!(names(&end)[..4], drawn);
    assert!(end["evaluations"].as_u64().unwrap() <= wanted, "{wanted}");
    let svg = end["figures"][0]["svg"].as_str().unwrap();
    assert!(svg.starts_with("<svg xmlns=") && !svg.contains("<style"), "{svg}");
    let done = served.page.get("/data/overview").json();
    assert!(done["realizations"]["succeeded"].as_u64().unwrap() > 0, "{done}");
    assert_eq!(done["jobs"]["ended"], 1);
}

/// The figures of a job come while it runs, and grow with its evaluations.
#[test]
fn figures_grow_while_a_job_runs() {
    let served = Served::start(&[]);
    // Some seconds, so that it goes on after its first figures.
    let id = served.submit(400, 300, &[]);
    let mut updates = served.page.events(&format!("job={id}"), &[]).unwrap();
    let first = updates.until("figures", |_| true);
    assert_eq!(names(&first), Vec::<&str>::new());
    let _worker = served.service.worker(&served.scratch);
    let some = updates.until("figures", |it| names(it).len() >= 4);
    let evaluations = some["evaluations"].as_u64().unwrap();
    updates.until("figures", |it| it["evaluations"].as_u64().unwrap() > evaluations);
}

#[test]
fn a_job_is_cancelled_once_and_only_by_a_post() {
    let served = Served::start(&[]);
    let id = served.submit(10, 10, &[]);
    let path = format!("/data/jobs/{id}/cancel");
    assert_eq!(served.page.get(&path).status, 405);
    let before = served.page.get(&format!("/data/jobs/{id}")).json();
    assert_eq!(before["state"], "running");
    assert!(before["explain"]["text"].as_str().unwrap().contains("worker"), "{before}");
    for _ in 0..2 {
        let cancelled = served.page.request("POST", &path, &[]).json();
        assert_eq!([&cancelled["state"], &cancelled["status"]], ["ended", "cancelled"]);
    }
    assert_eq!(served.page.request("POST", "/data/jobs/77/cancel", &[]).status, 404);
    let ended = served.page.get("/data/jobs?show=ended").json();
    assert_eq!(ended["jobs"][0]["job"], id.as_str());
    assert_eq!(served.page.get("/data/jobs?show=running").json()["jobs"], Value::Array(vec![]));
}

#[test]
fn what_is_not_there_is_not_found_and_everything_is_protected() {
    let served = Served::start(&[]);
    for (method, path, status) in [
        ("GET", "/", 200),
        ("HEAD", "/", 200),
        ("GET", "/page.css", 200),
        ("GET", "/page.js", 200),
        ("GET", "/charts.js", 200),
        ("GET", "/icon.svg", 200),
        ("GET", "/data/overview", 200),
        ("GET", "/index.html", 404),
        ("GET", "/../Cargo.toml", 404),
        ("GET", "/data/jobs/1", 404),
        ("GET", "/data/jobs/x", 404),
        ("GET", "/data/jobs/%00", 404),
        ("GET", "/data/jobs/1/figures", 404),
        ("POST", "/", 405),
        ("DELETE", "/data/jobs", 405),
        ("GET", "/data/jobs?show=some", 400),
        ("GET", "/data/jobs?rows=100000", 400),
        ("GET", "/events?job=x", 400),
    ] {
        let answer = served.page.request(method, path, &[]);
        assert_eq!(answer.status, status, "{method} {path}: {answer:?}");
        for header in [
            "content-security-policy: default-src 'none'; script-src 'self'",
            "x-content-type-options: nosniff",
            "cache-control: no-store",
            "referrer-policy: no-referrer",
        ] {
            assert!(answer.head.contains(header), "{path}: {}", answer.head);
        }
    }
    // A page may be open on a job that is not there any more.
    let mut updates = served.page.events("job=77", &[]).unwrap();
    assert_eq!(updates.until("job", |_| true)["error"], "no such job: 77");
    updates.until("overview", |_| true);
}

/// A page of somebody else has the user's browser send requests, or lets its own name lead here.
#[test]
fn requests_of_other_pages_are_refused() {
    let served = Served::start(&["--http-host", "bones.example.org"]);
    let id = served.submit(10, 10, &[]);
    let path = format!("/data/jobs/{id}/cancel");
    for headers in [
        [("sec-fetch-site", "cross-site"), ("origin", "https://evil.example")],
        [("sec-fetch-site", "same-site"), ("origin", "http://127.0.0.1:1")],
        [("origin", "null"), ("x-none", "")],
        [("origin", "https://evil.example"), ("x-none", "")],
    ] {
        assert_eq!(served.page.request("POST", &path, &headers).status, 403, "{headers:?}");
        assert_eq!(served.page.request("GET", "/data/jobs", &headers).status, 403, "{headers:?}");
        assert_eq!(served.page.events("", &headers).err(), Some(403), "{headers:?}");
    }
    for (host, status) in [
        ("evil.example", 421),
        ("127.0.0.1.evil.example:80", 421),
        ("localhost:9", 200),
        ("bones.example.org", 200),
    ] {
        let answer = served.page.request("GET", "/data/jobs", &[("host", host)]);
        assert_eq!(answer.status, status, "{host}");
    }
    let still = served.page.get(&format!("/data/jobs/{id}")).json();
    assert_eq!(still["state"], "running");
}

/// Tokens decide who sees the page's data, and who cancels; the page itself is the same for all.
#[test]
fn roles_are_those_of_the_api() {
    let scratch = Scratch::new();
    secure::set_up(&scratch);
    let tokens = scratch.path("tokens");
    let options = ["--http", "127.0.0.1:0", "--tokens", text(&tokens)];
    let service = Service::start(&scratch, &options);
    let page = Page::of_store(&scratch.path("store"));
    let bearer = |role: &str| {
        let token = std::fs::read_to_string(scratch.path(&format!("{role}.token"))).unwrap();
        format!("Bearer {}", token.trim())
    };
    let with = scratch.path("submit.token");
    let id = submit(&scratch, service.url(), 10, 10, &["--token-file", text(&with)]);
    let cancel = format!("/data/jobs/{id}/cancel");
    assert_eq!(page.get("/").status, 200);
    assert_eq!(page.get("/page.js").status, 200);
    let unknown = format!("Bearer osteon_{}", "0".repeat(64));
    for header in [None, Some("Basic YTpi"), Some(unknown.as_str())] {
        let headers: Vec<_> = header.map(|it| ("authorization", it)).into_iter().collect();
        for path in ["/data/jobs", "/data/overview", "/events", "/data/none"] {
            assert_eq!(page.request("GET", path, &headers).status, 401, "{path} {header:?}");
        }
        assert_eq!(page.request("POST", &cancel, &headers).status, 401, "{header:?}");
    }
    for (role, may_cancel) in [("read", false), ("submit", true), ("admin", true)] {
        let bearer = bearer(role);
        let mut updates = page.events("", &[("authorization", &bearer)]).unwrap();
        assert_eq!(updates.until("caller", |_| true)["may_cancel"], may_cancel, "{role}");
    }
    let read = bearer("read");
    let refused = page.request("POST", &cancel, &[("authorization", &read)]);
    assert_eq!(refused.status, 403);
    assert!(refused.body.contains("role read, and this needs role submit"), "{refused:?}");
    let headers = [("authorization", read.as_str())];
    assert_eq!(
        page.request("GET", &format!("/data/jobs/{id}"), &headers).json()["state"],
        "running"
    );
    let may = bearer("submit");
    assert_eq!(page.request("POST", &cancel, &[("authorization", &may)]).status, 200);
    let log = service.log();
    assert!(log.contains("submit-holder"), "{log}");
}

/// A token that is taken out of the list ends the pages that were opened with it.
#[test]
fn a_revoked_token_ends_its_pages() {
    let scratch = Scratch::new();
    secure::set_up(&scratch);
    let tokens = scratch.path("tokens");
    let options = ["--http", "127.0.0.1:0", "--tokens", text(&tokens)];
    let mut service = Service::start(&scratch, &options);
    let page = Page::of_store(&scratch.path("store"));
    let token = std::fs::read_to_string(scratch.path("read.token")).unwrap();
    let bearer = format!("Bearer {}", token.trim());
    let mut updates = page.events("", &[("authorization", &bearer)]).unwrap();
    updates.until("overview", |_| true);
    let list = std::fs::read_to_string(&tokens).unwrap();
    let kept: Vec<&str> = list.lines().filter(|line| !line.contains("read-holder")).collect();
    std::fs::write(&tokens, kept.join("\n")).unwrap();
    service.process().signal("HUP");
    updates.end();
    assert_eq!(page.events("", &[("authorization", &bearer)]).err(), Some(401));
}

#[test]
fn the_number_of_open_pages_is_bounded() {
    let served = Served::start(&[]);
    let mut open: Vec<Updates> = Vec::new();
    let refused = loop {
        match served.page.events("", &[]) {
            Ok(updates) => open.push(updates),
            Err(status) => break status,
        }
        assert!(open.len() <= 64, "there is no bound");
    };
    assert_eq!((refused, open.len()), (429, 64));
    let told = served.page.get("/events");
    assert!(told.head.contains("retry-after: 5") && told.body.contains("64 pages"), "{told:?}");
    // Everything else is still answered, and a closed page makes room for another.
    assert_eq!(served.page.get("/data/overview").status, 200);
    open.truncate(60);
    eventually("another page opens", || served.page.events("", &[]).is_ok());
}

/// The coordinator is killed and started again: the stream ends, and the page finds the same job under
/// the same address.
#[test]
fn a_page_goes_on_after_a_restart() {
    // The address must be the same again.
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let scratch = Scratch::new();
    let mut service = Service::start(&scratch, &["--http", &free]);
    let page = Page::of_store(&scratch.path("store"));
    assert_eq!(page.address, free);
    let id = submit(&scratch, service.url(), 20, 100, &[]);
    let query = format!("job={id}");
    let mut updates = page.events(&query, &[]).unwrap();
    updates.until("job", |it| it["job"] == id.as_str());
    service.kill();
    updates.end();
    assert_eq!(page.events(&query, &[]).err(), Some(0));
    service.start_again();
    let mut updates = page.events(&query, &[]).unwrap();
    updates.until("job", |it| it["job"] == id.as_str() && it["state"] == "running");
    // A clean end takes no longer for a page that is open.
    service.end();
    updates.end();
    assert!(!scratch.path("store/http-address").exists());
}

/// Ten thousand jobs are pages of a few rows, and an update stays small.
#[test]
fn ten_thousand_jobs_are_shown_page_by_page() {
    let served = Served::start(&[]);
    let count = 10_000_u64;
    let file = served.scratch.write("job.toml", &job(1, 3));
    let specification = api::specification(&file, JobKind::Identification);
    let mut api = api::Api::new(served.service.url());
    for block in 0..count / 500 {
        // One client may have a quarter of the jobs.
        let client_name = format!("client {}", block % 4);
        let submitted = api.call(async |client| {
            let mut calls = tokio::task::JoinSet::new();
            for _ in 0..500 {
                let (mut client, specification) = (client.clone(), specification.clone());
                let request = SubmitRequest {
                    specification: Some(specification),
                    client: client_name.clone(),
                    ..SubmitRequest::default()
                };
                calls.spawn(async move { client.submit(request).await.map(|_| ()) });
            }
            calls.join_all().await.into_iter().collect::<Result<(), _>>()
        });
        submitted.unwrap();
    }
    let mut updates = served.page.events("show=waiting", &[]).unwrap();
    let overview = updates.until("overview", |_| true);
    let all = overview["jobs"]["running"].as_u64().unwrap()
        + overview["jobs"]["waiting"].as_u64().unwrap();
    assert_eq!(all, count);
    let listed = updates.until("jobs", |_| true);
    assert_eq!(listed["jobs"].as_array().unwrap().len(), 25);
    assert!(listed.to_string().len() < 25_000);
    // Every job is on exactly one page.
    let (mut seen, mut before) = (0, String::new());
    loop {
        let page = served.page.get(&format!("/data/jobs?rows=100{before}")).json();
        seen += page["jobs"].as_array().unwrap().len() as u64;
        match page["more_after"].as_str() {
            Some(job) => before = format!("&before={job}"),
            None => break,
        }
    }
    assert_eq!(seen, count);
}

/// A thousand workers on a hundred hosts are counted host by host.
#[test]
fn a_thousand_workers_are_counted_by_host() {
    // They send no heartbeats.
    let served = Served::start(&["--lease", "600"]);
    let url = served.service.url().to_owned();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let attached = runtime.block_on(async {
        let (mut open, endpoint) = (Vec::new(), url.parse().unwrap());
        for connection in 0..5 {
            // A connection carries a limited number of streams.
            let channel = connect(&endpoint, DEADLINE).await.unwrap();
            for number in connection * 200..(connection + 1) * 200 {
                let host = format!("node-{:02}", number % 100);
                let message = Some(Message::Hello(WorkerHello { host, ..peer::hello(number) }));
                let (sender, messages) = tokio::sync::mpsc::channel(1);
                sender.send(AttachRequest { message }).await.unwrap();
                let mut client = workers_client(channel.clone());
                let stream = client.attach(ReceiverStream::new(messages)).await.unwrap();
                open.push((sender, stream));
            }
        }
        open
    });
    let mut updates = served.page.events("", &[]).unwrap();
    let overview = updates.until("overview", |it| it["workers"]["count"] == 1000);
    assert_eq!(attached.len(), 1000);
    let workers = &overview["workers"];
    assert_eq!(workers["hosts"].as_array().unwrap().len(), 40);
    assert_eq!([&workers["more_hosts"], &workers["slots_idle"]], [60, 1000]);
    assert_eq!(workers["hosts"][0]["workers"], 10);
    assert!(overview.to_string().len() < 10_000, "{overview}");
}

#[test]
fn addresses_that_others_reach_need_protection() {
    let scratch = Scratch::new();
    secure::set_up(&scratch);
    let (store, tokens) = (scratch.path("store"), scratch.path("tokens"));
    let listen = ["coordinator", "--listen", "127.0.0.1:0", "--store", text(&store)];
    for (options, code, part) in [
        (&["--http", "0.0.0.0:0"][..], 2, "can be reached from other machines"),
        (&["--http", "0.0.0.0:0", "--tokens", text(&tokens)], 2, "tokens would be readable"),
        (&["--http", "unix:a"], 2, "a browser cannot read from a Unix socket"),
        (&["--http", "7000"], 2, "not a valid listen address"),
        (&["--http-host", "a"], 2, "--http"),
        (&["--http", "127.0.0.1:0", "--http-host", "http://a"], 2, "name of a host"),
    ] {
        let words: Vec<&str> = listen.iter().chain(options).copied().collect();
        let refused = run(&words);
        assert_eq!(refused.code, Some(code), "{options:?}: {refused:?}");
        assert!(refused.stderr.contains(part), "{options:?}: {}", refused.stderr);
    }
}

/// The log says how to see a page on a loopback address from elsewhere.
#[test]
fn the_tunnel_is_named_at_the_start() {
    let served = Served::start(&[]);
    let port = served.page.address.rsplit_once(':').unwrap().1;
    let log = served.service.log();
    assert!(log.contains(&format!("ssh -L {port}:127.0.0.1:{port} ")), "{log}");
}

/// With TLS the page has the coordinator's certificate.
#[test]
fn the_page_has_the_coordinators_certificate() {
    let scratch = Scratch::new();
    secure::set_up(&scratch);
    let mut command = osteon();
    command.args(["coordinator", "--listen", "127.0.0.1:0", "--http", "127.0.0.1:0"]);
    command.args(secure::door(&scratch, "server")).env("RUST_LOG", "info");
    let mut process = Owned::spawn_logging(&mut command, &scratch.path("coordinator.log"));
    assert!(process.line().starts_with("https://"));
    let page = Page::of_store(&scratch.path("store"));
    let token = std::fs::read_to_string(scratch.path("read.token")).unwrap();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let answer = runtime.block_on(async {
        let ca = scratch.path("certs/ca.pem");
        let ask = tls::get(&page.address, &ca, token.trim());
        tokio::time::timeout(DEADLINE, ask).await.unwrap()
    });
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    assert!(answer.contains("\"jobs\":[]"), "{answer}");
}

/// A browser's side of TLS.
mod tls {
    use std::path::Path;
    use std::sync::Arc;

    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
    use tokio::net::TcpStream;
    use tokio_rustls::TlsConnector;
    use tokio_rustls::rustls::{ClientConfig, crypto::ring};

    /// Gets the list of jobs with a token.
    pub(crate) async fn get(address: &str, ca: &Path, token: &str) -> String {
        let roots = osteon_transport::credentials::roots(ca).unwrap();
        let provider = Arc::new(ring::default_provider());
        let mut config = ClientConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()
            .unwrap()
            .with_root_certificates(roots)
            .with_no_client_auth();
        config.alpn_protocols = vec![b"h2".to_vec(), b"http/1.1".to_vec()];
        let connector = TlsConnector::from(Arc::new(config));
        let stream = TcpStream::connect(address).await.unwrap();
        let name = "127.0.0.1".try_into().unwrap();
        let mut stream = connector.connect(name, stream).await.unwrap();
        assert_eq!(stream.get_ref().1.alpn_protocol(), Some(&b"http/1.1"[..]));
        let request = format!(
            "GET /data/jobs HTTP/1.1\r\nhost: {address}\r\nauthorization: Bearer {token}\r\n\
             connection: close\r\n\r\n"
        );
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.unwrap();
        answer
    }
}
