//! `osteon umbridge`: the models of a job over HTTP, as clients of UM-Bridge see them.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use support::{Coordinator, DEADLINE, OPTIMUM, Owned, Scratch, children, eventually, is_alive};
use support::{job, osteon, run, text};

/// A server of a job's models.
struct Server {
    process: Owned,
    address: String,
}

/// An answer: status, headers in lower case, body.
#[derive(Debug)]
struct Answered {
    status: u16,
    headers: String,
    body: String,
}

impl Answered {
    fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }

    fn header(&self, name: &str) -> Option<&str> {
        let start = format!("{name}: ");
        self.headers.lines().find_map(|line| line.strip_prefix(start.as_str()))
    }

    /// Returns the only vector of an output.
    fn output(&self) -> Vec<f64> {
        assert_eq!(self.status, 200, "{self:?}");
        let output = &self.json()["output"];
        let vector = if output[0].is_array() { &output[0] } else { output };
        vector.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
    }
}

impl Server {
    fn start(job: &Path, options: &[&str]) -> Self {
        let mut command = osteon();
        command.arg("umbridge").arg(job).args(["--port", "0"]).args(options);
        let mut process = Owned::spawn(command.env_remove("PORT").env("RUST_LOG", "warn"));
        let url = process.line();
        let address = url.strip_prefix("http://").unwrap_or_else(|| panic!("{url}")).to_owned();
        Self { process, address }
    }

    /// Sends a request without a content type.
    fn send(&self, method: &str, path: &str, body: &str) -> Answered {
        self.send_with(method, path, &format!("Host: {}\r\n", self.address), body)
    }

    /// Sends a request with lines of its own in its header.
    fn send_with(&self, method: &str, path: &str, lines: &str, body: &str) -> Answered {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        let length = body.len();
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\n{lines}Content-Length: {length}\r\n\
             Connection: close\r\n\r\n{body}"
        )
        .unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or_else(|| panic!("{text}"));
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        Answered { status, headers: head.to_lowercase(), body: body.to_owned() }
    }

    fn post(&self, path: &str, body: &Value) -> Answered {
        self.send("POST", path, &body.to_string())
    }

    fn evaluate(&self, name: &str, input: &[f64], config: &Value) -> Answered {
        self.post("/Evaluate", &json!({"name": name, "input": [input], "config": config}))
    }
}

/// A propagation of the paper's optimum.
fn propagation(realizations: u32) -> String {
    let fixed = OPTIMUM.map(|(name, value, ..)| format!("{name} = {{ fixed = {value:?} }}\n"));
    format!("[monte_carlo]\nrealizations = {realizations}\n[parameters]\n{}", fixed.concat())
}

/// The small identification of e_L and δ, with the number of velocities behind its moments.
fn identification(realizations: u32) -> String {
    job(realizations, 5).replace("[data]\n", "[data]\ncount = 1000\n")
}

/// Requests, and what the status and the body are, which contains the text.
fn requests() -> Vec<(&'static str, &'static str, String, u16, &'static str)> {
    let ones = "[1, 1, 1, 1, 1, 1, 1]";
    let forward = |rest: &str| format!(r#"{{"name": "forward", {rest}}}"#);
    let with = |input: &str| forward(&format!(r#""input": {input}"#));
    let post = |path, body: String, status, text| ("POST", path, body, status, text);
    let mut all = vec![
        ("GET", "/", String::new(), 200, "UM-Bridge"),
        ("HEAD", "/", String::new(), 200, ""),
        ("GET", "/Evaluate", String::new(), 405, "use POST"),
        post("/Info", String::new(), 405, "use GET"),
        post("/TestShMem", forward(r#""tid": "1""#), 404, "UnsupportedFeature"),
        post("/InputSizes", forward(r#""config": {}"#), 200, r#"{"inputSizes":[7]}"#),
        post("/OutputSizes", r#"{"name": "velocity"}"#.to_owned(), 200, r#"{"outputSizes":[1]}"#),
        post("/InputSizes", r#"{"name": "velocity"}"#.to_owned(), 200, r#"{"inputSizes":[6]}"#),
        post("/Evaluate", String::new(), 400, "the body is not JSON"),
        post("/Evaluate", "{}".to_owned(), 400, "name is missing"),
        post("/Evaluate", r#"{"name": "posterior"}"#.to_owned(), 400, "whose noise is known"),
        post("/Evaluate", with(ones), 400, "input has 7 entries"),
        post("/Evaluate", with("[[1, 1]]"), 400, "input[0] has the length 2"),
        post("/Evaluate", with("[[[1], 1, 1, 1, 1, 1, 1]]"), 400, "input[0][0] is a list"),
        post("/Evaluate", with("[[1, 1, 1, 1, 1, 1, 9]]"), 400, "input[0][6] (dispersion): is"),
        post("/Evaluate", with("[[1, 1, 2, 1, 1, 1, 1]]"), 400, "is not admissible"),
        post("/Evaluate", " ".repeat(2 << 20), 413, "the body is longer than 1048576 bytes"),
    ];
    for path in ["/ModelInfo", "/InputSizes", "/Evaluate", "/Gradient", "/ApplyHessian"] {
        // The name is wrong before anything else is.
        let body = r#"{"name": "wrong", "config": 1, "input": "x"}"#.to_owned();
        all.push(post(path, body, 400, r#""type":"ModelNotFound""#));
    }
    all.push(post("/ApplyHessian", with("1"), 400, r#""type":"UnsupportedFeature""#));
    for (config, text) in [
        (r#"{"level": 1}"#, "its keys are: seed, realizations"),
        (r#"{"realizations": 0}"#, "config.realizations: is 0"),
    ] {
        let body = forward(&format!(r#""input": [{ones}], "config": {config}"#));
        all.push(post("/Evaluate", body, 400, text));
    }
    for (rest, text) in [
        (r#""outWrt": 1, "inWrt": 0, "sens": [0, 0]"#, "outWrt is 1; it must be 0"),
        (r#""outWrt": 0, "inWrt": 1, "sens": [0, 0]"#, "inWrt is 1; it must be 0"),
        (r#""outWrt": 0, "inWrt": 0, "sens": [0]"#, "sens has the length 1"),
        (r#""outWrt": 0, "inWrt": 0"#, "sens is missing"),
    ] {
        all.push(post("/Gradient", forward(&format!(r#""input": [{ones}], {rest}"#)), 400, text));
    }
    all
}

#[test]
fn every_request_has_its_answer() {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", &propagation(20));
    let mut server = Server::start(&job, &["--workers", "1", "--threads", "1"]);
    for (method, path, body, status, text) in requests() {
        let answer = server.send(method, path, &body);
        let short: String = body.chars().take(100).collect();
        assert_eq!(answer.status, status, "{method} {path} {short}: {answer:?}");
        assert!(answer.body.contains(text), "{method} {path} {short}: {answer:?}");
        if status != 200 {
            // Nothing but the protocol's keys.
            let error = answer.json();
            let [error, whole] = [&error["error"], &error].map(|value| value.as_object().unwrap());
            assert_eq!((whole.len(), error.len()), (1, 2), "{answer:?}");
        }
    }
    let info = server.send("GET", "/Info", "");
    assert!(info.body.contains(r#""protocolVersion":1.0"#), "{info:?}");
    assert_eq!(info.json()["models"], json!(["forward", "forward-si", "velocity"]));
    let workers = children(server.process.id());
    assert_eq!(workers.len(), 1);
    server.process.signal("TERM");
    assert_eq!(server.process.code(), Some(0));
    assert!(!is_alive(workers[0]));
}

#[test]
fn all_ones_are_the_propagation_of_the_job_to_the_bit() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &propagation(30));
    let propagated = run(&["propagate", text(&file), "--json"]).json();
    let server = Server::start(&file, &["--threads", "1"]);
    let si = OPTIMUM.map(|(_, value, ..)| value);
    for (name, input) in [("forward", [1.0; 7]), ("forward-si", si)] {
        let answer = server.evaluate(name, &input, &json!({}));
        let velocity = &propagated["velocity"];
        let expected = ["mean", "coefficient_of_variation"].map(|name| velocity[name].as_f64());
        assert_eq!(answer.output().into_iter().map(Some).collect::<Vec<_>>(), expected, "{name}");
        assert_eq!(answer.header("osteon-digest"), propagated["digest"].as_str());
        assert_eq!(answer.header("osteon-failures"), Some("0"));
        assert_eq!(answer.json().as_object().unwrap().len(), 1);
    }
    let other = server.evaluate("forward", &[1.0; 7], &json!({"seed": 2, "realizations": 10}));
    assert_eq!(other.header("osteon-realizations"), Some("10"));
    assert_ne!(other.header("osteon-digest"), propagated["digest"].as_str());
    // One case is that of `simulate`.
    let constants = OPTIMUM.map(|(name, value, ..)| format!("{name} = {value:?}\n"));
    let case = scratch.write("case.toml", &format!("[bone]\n{}", constants[..6].concat()));
    let simulated = run(&["simulate", text(&case), "--json"]).json();
    let velocity = server.evaluate("velocity", &[1.0; 6], &json!({})).output();
    assert_eq!(Some(velocity[0]), simulated["velocity"].as_f64());
}

#[test]
fn derivatives_are_those_of_the_values() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &propagation(30));
    let server = Server::start(&file, &[]);
    let base = server.evaluate("forward", &[1.0; 7], &json!({})).output();
    let request = |name: &str, more: Value| {
        let size = if name == "velocity" { 6 } else { 7 };
        let mut body = json!({"name": name, "input": [vec![1.0; size]], "outWrt": 0, "inWrt": 0});
        body.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        body
    };
    let gradient = server.post("/Gradient", &request("forward", json!({"sens": [1, 0]}))).output();
    // Velocities go like the root of modulus over density, for all germs alike.
    assert_eq!(gradient.len(), 7);
    assert!((gradient[0] / base[0] + 0.5).abs() < 0.05, "{gradient:?} {base:?}");
    assert!(gradient[1] > 0.2 * base[0], "{gradient:?}");
    let mut direction = vec![0.0; 7];
    direction[1] = 1.0;
    let along = server.post("/ApplyJacobian", &request("forward", json!({"vec": direction})));
    assert!((along.output()[0] / gradient[1] - 1.0).abs() < 1e-12);
    // The coefficient of variation is proportional to the dispersion.
    let of_variation = server.post("/Gradient", &request("forward", json!({"sens": [0, 1]})));
    assert!((of_variation.output()[6] / base[1] - 1.0).abs() < 0.1, "{of_variation:?}");
    for zero in [json!({"sens": [0, 0]}), json!({"sens": [0]})] {
        let name = if zero["sens"].as_array().unwrap().len() == 2 { "forward" } else { "velocity" };
        let found = server.post("/Gradient", &request(name, zero)).output();
        assert!(found.iter().all(|slope| *slope == 0.0), "{found:?}");
    }
}

#[test]
fn a_posterior_is_finite_everywhere() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &identification(30));
    let server = Server::start(&file, &["--threads", "1"]);
    let log = |input: &[f64], config: Value| server.evaluate("posterior", input, &config);
    // The start is 10 % above the values that match the data.
    let near = log(&[1.0 / 1.1, 1.0 / 1.1], json!({}));
    let start = log(&[1.0, 1.0], json!({})).output()[0];
    assert!(near.output()[0] > start, "{near:?} {start}");
    assert!(near.header("osteon-cost").is_some(), "{near:?}");
    let si = log(&[17.717e9, 0.1029], json!({"inputs": "si"})).output()[0];
    assert!((si - near.output()[0]).abs() < 1e-3, "{si} {near:?}");
    let middle = log(&[0.5, 0.5], json!({"inputs": "bounds"})).output()[0];
    assert!(middle > -1e6, "{middle}");
    for outside in [[100.0, 18.0], [0.0, 10.0], [-1.0, 1.0], [1.0, 1e300]] {
        assert_eq!(log(&outside, json!({})).output(), [-1e300]);
    }
    let gradient = |input: [f64; 2]| {
        let body = json!({
            "name": "posterior", "input": [input], "outWrt": 0, "inWrt": 0, "sens": 1
        });
        server.post("/Gradient", &body).output()
    };
    assert!(gradient([1.0, 1.0])[0] < 0.0);
    assert_eq!(gradient([0.0, 10.0]), [0.0, 0.0]);
    // Values in SI units are no point outside, but a mistake that a sampler would never show.
    let mistaken = log(&[20e9, 0.1], json!({}));
    assert_eq!(mistaken.status, 400, "{mistaken:?}");
    assert!(
        mistaken.body.contains("the input is in SI units, and multiples are meant"),
        "{mistaken:?}"
    );
    let refused = log(&[1.0, 1.0], json!({"group": "a"}));
    assert!(refused.body.contains("but the data have no groups"), "{refused:?}");
}

/// Requests that come at once are jobs that run at once; one whose client has gone is cancelled.
#[test]
fn a_coordinator_computes_for_many_clients() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &propagation(40));
    let coordinator = Coordinator::start(&scratch.path("store"));
    let _worker = coordinator.worker(1);
    let server = Server::start(&file, &["--coordinator", &coordinator.url]);
    let input = |k: usize| [1.0 + 0.001 * k as f64; 7];
    let single: Vec<Vec<f64>> =
        (0..4).map(|k| server.evaluate("forward", &input(k), &json!({})).output()).collect();
    let together: Vec<Vec<f64>> = std::thread::scope(|scope| {
        let server = &server;
        let threads: Vec<_> = (0..8)
            .map(|k| scope.spawn(move || server.evaluate("forward", &input(k % 4), &json!({}))))
            .collect();
        threads.into_iter().map(|thread| thread.join().unwrap().output()).collect()
    });
    for (k, output) in together.iter().enumerate() {
        assert_eq!(*output, single[k % 4]);
    }
    let mut stream = TcpStream::connect(&server.address).unwrap();
    stream.set_write_timeout(Some(Duration::from_secs(60))).unwrap();
    let body = json!({
        "name": "forward", "input": [[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]], "config": {"realizations": 10_000_000}
    });
    let body = body.to_string();
    write!(
        stream,
        "POST /Evaluate HTTP/1.1\r\nHost: localhost\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    )
    .unwrap();
    let jobs = |state: &str| {
        let jobs = coordinator.client(&["jobs", "--json"]).json();
        jobs.as_array().unwrap().iter().filter(|job| job.to_string().contains(state)).count()
    };
    eventually("the long job runs", || jobs("10000000") == 1);
    drop(stream);
    eventually("the long job is cancelled", || jobs("cancelled") == 1);
}

/// A page in the user's browser can have no point computed, whatever it sends, and programs can.
#[test]
fn pages_of_a_browser_are_refused() {
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", &propagation(10));
    let options = ["--workers", "1", "--threads", "1", "--http-host", "model.example"];
    let server = Server::start(&job, &options);
    let body = json!({"name": "velocity", "input": [vec![1.0; 6]]}).to_string();
    let own = format!("Host: {}\r\n", server.address);
    for (lines, status, word) in [
        (format!("{own}Content-Type: application/json\r\n"), 200, "output"),
        // What the client in C++ sends.
        (format!("{own}Content-Type: text/plain\r\n"), 200, "output"),
        ("Host: model.example\r\n".to_owned(), 200, "output"),
        (
            format!("{own}Origin: https://evil.example\r\nContent-Type: text/plain\r\n"),
            403,
            "from a page in a browser",
        ),
        (format!("{own}Sec-Fetch-Site: cross-site\r\n"), 403, "from a page in a browser"),
        ("Host: evil.example:4242\r\n".to_owned(), 421, "--http-host"),
    ] {
        let answered = server.send_with("POST", "/Evaluate", &lines, &body);
        assert_eq!(answered.status, status, "{lines}: {answered:?}");
        assert!(answered.body.contains(word), "{lines}: {answered:?}");
        assert!(!answered.headers.contains("access-control"), "{answered:?}");
    }
}

/// Beyond the connections that are served some wait for a place, and others are refused at once.
#[test]
fn a_crowd_waits_and_others_are_told_to_come_back() {
    /// As many as umbridge/src/crowd.rs serves, and as many as it lets wait.
    const EACH: usize = 256;
    let scratch = Scratch::new();
    let job = scratch.write("job.toml", &propagation(10));
    let server = Server::start(&job, &["--workers", "1", "--threads", "1"]);
    let crowd = |_| {
        let mut stream = TcpStream::connect(&server.address).unwrap();
        stream.set_read_timeout(Some(DEADLINE)).unwrap();
        stream.write_all(b"GET /Info HTTP/1.1\r\nConnection: close\r\n").unwrap();
        stream
    };
    let served: Vec<TcpStream> = (0..EACH).map(crowd).collect();
    let mut waiting: Vec<TcpStream> = (0..EACH).map(crowd).collect();
    let began = Instant::now();
    let refused = server.evaluate("velocity", &[1.0; 6], &json!({}));
    // It waits for nothing, but the machine may be busy.
    assert!(began.elapsed() < Duration::from_secs(10), "{:?}", began.elapsed());
    assert_eq!(refused.status, 503, "{refused:?}");
    assert_eq!(refused.header("retry-after"), Some("10"));
    assert_eq!(refused.header("content-type"), Some("application/json"));
    let error = &refused.json()["error"];
    assert_eq!(error["type"], "InvalidOutput");
    assert!(error["message"].as_str().unwrap().contains("256 connections"), "{error}");
    drop(served);
    for stream in &mut waiting {
        stream.write_all(b"\r\n").unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 200 "), "{answer}");
    }
    assert_eq!(server.evaluate("velocity", &[1.0; 6], &json!({})).status, 200);
}

#[test]
fn a_server_that_cannot_start_says_why() {
    let scratch = Scratch::new();
    let file = scratch.write("job.toml", &propagation(10));
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let case = format!("{}/examples/cases/A.toml", env!("CARGO_MANIFEST_DIR"));
    for (arguments, code, expected) in [
        (vec!["umbridge", text(&file), "--port", &port], 1, "choose another --port"),
        (vec!["umbridge", "none.toml"], 2, "none.toml"),
        (vec!["umbridge", &case], 2, "is not a job file but a case file"),
        (vec!["umbridge", text(&file), "--token-file", "x"], 2, "--coordinator URL"),
    ] {
        let ended = run(&arguments);
        assert_eq!(ended.code, Some(code), "{ended:?}");
        assert!(ended.stderr.contains(expected), "{ended:?}");
        assert_eq!(ended.stdout, "");
    }
}
