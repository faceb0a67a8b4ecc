//! Metrics: what a coordinator exports is what docs/metrics.md lists, and what dashboard and alert
//! rules use.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]
#![expect(clippy::panic, reason = "a test that cannot go on should say why")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;

use serde_json::{Value, json};
use support::{Owned, Scratch, job, osteon, run, text};

/// Names the directory for what `cargo xtask test metrics` gives to promtool: the scraped text, and the
/// expressions of the dashboard as rules.
const DIRECTORY: &str = "OSTEON_METRICS_DIRECTORY";

fn read(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// Writes a file for promtool, if it is wanted.
fn keep(name: &str, text: &str) {
    if let Some(directory) = std::env::var_os(DIRECTORY) {
        fs::write(Path::new(&directory).join(name), text).unwrap();
    }
}

/// A coordinator with metrics on a port of its own.
struct MeteredCoordinator {
    scratch: Scratch,
    process: Owned,
    url: String,
    metrics: String,
}

impl MeteredCoordinator {
    fn start() -> Self {
        let scratch = Scratch::new();
        let mut command = osteon();
        command.args(["coordinator", "--listen", "127.0.0.1:0", "--metrics", "localhost:0"]);
        command.arg("--store").arg(scratch.path("store"));
        let mut process = Owned::spawn(command.env("RUST_LOG", "warn"));
        let url = process.line();
        let metrics = fs::read_to_string(scratch.path("store/metrics-address")).unwrap();
        Self { scratch, process, url, metrics: metrics.trim_end().to_owned() }
    }

    /// Sends a request; returns status line and header, and body.
    fn request(&self, request: &str) -> (String, String) {
        let address = self.metrics.strip_prefix("http://").unwrap();
        let address = address.strip_suffix("/metrics").unwrap();
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        (head.to_owned(), body.to_owned())
    }

    fn scrape(&self) -> String {
        let (head, body) = self.request("GET /metrics HTTP/1.1\r\nhost: localhost\r\n\r\n");
        assert!(head.starts_with("HTTP/1.1 200 "), "{head}");
        assert!(head.contains("content-type: text/plain; version=0.0.4"), "{head}");
        body
    }

    /// Returns the value of a sample, given with its labels.
    fn value(&self, sample: &str) -> f64 {
        let scraped = self.scrape();
        let line = scraped.lines().find_map(|line| line.strip_prefix(sample)?.strip_prefix(' '));
        line.unwrap_or_else(|| panic!("no {sample} in {scraped}")).parse().unwrap()
    }
}

/// A metric as exported or as documented: type, and values by label.
type Described = BTreeMap<String, (String, BTreeMap<String, BTreeSet<String>>)>;

/// Returns the metrics of a scraped text.
fn exported(scraped: &str) -> Described {
    let mut all = Described::new();
    for line in scraped.lines().filter_map(|line| line.strip_prefix("# TYPE ")) {
        let (name, kind) = line.split_once(' ').unwrap();
        all.insert(name.to_owned(), (kind.to_owned(), BTreeMap::new()));
    }
    for line in scraped.lines().filter(|line| !line.starts_with('#')) {
        let sample = line.rsplit_once(' ').unwrap().0;
        let (name, labels) = sample.split_once('{').unwrap_or((sample, ""));
        let of_histogram = ["_bucket", "_sum", "_count"].iter();
        let family = of_histogram.filter_map(|part| name.strip_suffix(part));
        let family = family.chain([name]).find(|name| all.contains_key(*name)).unwrap();
        for label in labels.trim_end_matches('}').split(',').filter(|label| !label.is_empty()) {
            let (label, value) = label.split_once('=').unwrap();
            if label != "le" {
                let labels = &mut all.get_mut(family).unwrap().1;
                let values = labels.entry(label.to_owned()).or_default();
                values.insert(value.trim_matches('"').to_owned());
            }
        }
    }
    all
}

/// Returns the metrics of the table in docs/metrics.md.
fn documented() -> Described {
    let page = read("docs/metrics.md");
    let rows = page.lines().filter(|line| line.starts_with("| `"));
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, name, kind, _, labels, ..] = cells[..] else { panic!("{line}") };
        let labels = labels.split_once(": ").unwrap_or((labels, ""));
        let words = |text: &str| -> BTreeSet<String> {
            text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
        };
        let names = words(labels.0).into_iter().map(|name| (name, words(labels.1)));
        (name.trim_matches('`').to_owned(), (kind.to_owned(), names.collect()))
    };
    rows.map(row).collect()
}

/// Returns the metrics that expressions of PromQL in a text name.
fn named(text: &str) -> BTreeSet<String> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let words = text.split(|c| !is_part(c));
    let ours = words.filter(|word| word.starts_with("osteon_") || word.starts_with("process_"));
    ours.map(str::to_owned).collect()
}

/// Returns whether a name is that of a metric, or of a part of a histogram.
fn is_exported(name: &str, all: &Described) -> bool {
    all.contains_key(name)
        || ["_bucket", "_sum", "_count"].iter().any(|part| {
            name.strip_suffix(part)
                .and_then(|name| all.get(name))
                .is_some_and(|(kind, _)| kind == "histogram")
        })
}

#[test]
fn every_metric_of_a_run_is_documented_and_every_documented_one_is_exported() {
    let measured = MeteredCoordinator::start();
    let file = measured.scratch.write("job.toml", &job(100, 4));
    let client = |arguments: &[&str]| run(&[arguments, &["--coordinator", &measured.url]].concat());
    let id = client(&["submit", text(&file), "--name", "left-tibia", "--json"]).json();
    assert_eq!(measured.value("osteon_jobs{state=\"running\"}"), 1.0);
    // 100 realizations of 1 ms, each slot for 20 ms.
    assert_eq!(measured.value("osteon_slots_wanted"), 5.0);
    let mut worker = osteon();
    worker.args(["worker", "--threads", "1", "--coordinator", &measured.url]);
    let worker = Owned::spawn(worker.env("RUST_LOG", "warn"));
    client(&["watch", id["job"].as_str().unwrap()]).succeeded();
    let evaluations = client(&["jobs", "--json"]).json()[0]["evaluations"].as_f64().unwrap();
    for (sample, expected) in [
        ("osteon_jobs{state=\"ended\"}", 1.0),
        ("osteon_jobs_accepted_total", 1.0),
        ("osteon_evaluations_total", evaluations),
        ("osteon_evaluation_seconds_count", evaluations),
        ("osteon_evaluation_seconds_bucket{le=\"+Inf\"}", evaluations),
        ("osteon_realizations_total{outcome=\"no_convergence\"}", 0.0),
        ("osteon_slots_wanted", 0.0),
        ("osteon_workers{state=\"ok\"}", 1.0),
        // Job, evaluations and end.
        ("osteon_store_write_seconds_count", evaluations + 2.0),
        ("osteon_store_errors_total", 0.0),
    ] {
        assert_eq!(measured.value(sample), expected, "{sample}");
    }
    // Speculative points that the search did not ask for count, too.
    assert!(measured.value("osteon_realizations_total{outcome=\"ok\"}") >= 100.0 * evaluations);
    let scraped = measured.scrape();
    for private in ["left-tibia", "job.toml", text(&measured.scratch.path("")).trim_matches('/')] {
        assert!(!scraped.contains(private), "{private} in {scraped}");
    }
    let mut exported = exported(&scraped);
    // The version is not listed.
    let version = exported.get_mut("osteon_build_info").unwrap().1.get_mut("version").unwrap();
    assert_eq!(std::mem::take(version), BTreeSet::from([env!("CARGO_PKG_VERSION").to_owned()]));
    assert_eq!(exported, documented());
    keep("scraped.txt", &scraped);
    drop(worker);
}

#[test]
fn the_dashboard_and_the_alerts_use_exported_metrics_only() {
    let all = documented();
    let dashboard: Value = serde_json::from_str(&read("deploy/grafana/osteon.json")).unwrap();
    let variables = dashboard["templating"]["list"].as_array().unwrap();
    assert!(variables.iter().any(|it| it["type"] == "datasource" && it["name"] == "datasource"));
    let mut expressions = Vec::new();
    let mut nodes = vec![&dashboard];
    while let Some(node) = nodes.pop() {
        match node {
            Value::Object(fields) => {
                if let Some(expression) = fields.get("expr") {
                    expressions.push(expression.as_str().unwrap());
                }
                // Every panel and query follows the variable.
                if let Some(uid) = fields.get("datasource").and_then(|source| source.get("uid")) {
                    assert_eq!(uid, "${datasource}", "{node}");
                }
                nodes.extend(fields.values());
            }
            Value::Array(items) => nodes.extend(items),
            _ => {}
        }
    }
    // The syntax of a rule has no variables. JSON is YAML.
    let rule = |(number, expression): (usize, &&str)| {
        let plain = expression.replace("$__rate_interval", "5m");
        let plain = plain.replace("$job", ".*").replace("$instance", ".*");
        json!({ "record": format!("dashboard:{number}"), "expr": plain })
    };
    let rules: Vec<Value> = expressions.iter().enumerate().map(rule).collect();
    let rules = json!({ "groups": [{ "name": "dashboard", "rules": rules }] });
    keep("dashboard.yml", &rules.to_string());
    let rules = read("deploy/prometheus/alerts.yml");
    let rules: String = rules.lines().filter(|line| !line.trim().starts_with('#')).collect();
    for (what, text, at_least) in [("dashboard", expressions.join("\n"), 25), ("alerts", rules, 10)]
    {
        let used = named(&text);
        assert!(used.len() >= at_least, "{what}: {used:?}");
        let unknown: Vec<&String> = used.iter().filter(|name| !is_exported(name, &all)).collect();
        assert_eq!(unknown, Vec::<&String>::new(), "{what}");
    }
}

#[test]
fn every_alert_has_a_test() {
    let names = |text: &str, key: &str| -> BTreeSet<String> {
        let lines =
            text.lines().filter_map(|line| line.trim().trim_start_matches("- ").strip_prefix(key));
        lines.map(|name| name.trim().to_owned()).collect()
    };
    let alerts = names(&read("deploy/prometheus/alerts.yml"), "alert: ");
    let tested = names(&read("deploy/prometheus/alerts_test.yml"), "alertname: ");
    assert!(alerts.len() >= 10, "{alerts:?}");
    assert_eq!(alerts, tested);
}

#[test]
fn the_listener_answers_one_path_and_outlives_bad_clients() {
    let mut measured = MeteredCoordinator::start();
    for (request, status) in [
        ("GET / HTTP/1.1\r\nhost: a\r\n\r\n", "404"),
        ("GET /metrics/x HTTP/1.1\r\nhost: a\r\n\r\n", "404"),
        ("POST /metrics HTTP/1.1\r\nhost: a\r\ncontent-length: 0\r\n\r\n", "405"),
        ("HEAD /metrics HTTP/1.1\r\nhost: a\r\n\r\n", "200"),
        ("nonsense\r\n\r\n", "400"),
        (&format!("GET /{} HTTP/1.1\r\n\r\n", "a".repeat(100_000)), "4"),
    ] {
        let address = measured.metrics.strip_prefix("http://").unwrap().replace("/metrics", "");
        let mut stream = TcpStream::connect(address).unwrap();
        // It may be refused before all of it is read.
        let _refused = stream.write_all(request.as_bytes());
        let mut answer = Vec::new();
        let _reset = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer);
        let shown = &request[..request.len().min(60)];
        let expected = format!("HTTP/1.1 {status}");
        assert!(answer.is_empty() || answer.starts_with(&expected), "{shown}: {answer}");
        assert!(!answer.is_empty() || request.len() > 1000, "{shown}: no answer");
    }
    // Clients that send nothing take all places, and are thrown out in time.
    let address = measured.metrics.strip_prefix("http://").unwrap().replace("/metrics", "");
    let idle: Vec<TcpStream> = (0..20).map(|_| TcpStream::connect(&address).unwrap()).collect();
    assert!(measured.scrape().contains("osteon_build_info"));
    drop(idle);
    measured.process.signal("TERM");
    assert_eq!(measured.process.code(), Some(0));
    assert!(!measured.scratch.path("store/metrics-address").exists());
}

#[test]
fn an_address_that_cannot_be_used_is_refused() {
    let scratch = Scratch::new();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = taken.local_addr().unwrap().to_string();
    for (address, code, part) in [
        ("unix:/tmp/metrics", 2, "cannot read from a Unix socket"),
        ("9464", 2, "not a valid listen address"),
        (taken.as_str(), 1, "choose another port in --metrics"),
    ] {
        let store = scratch.path("store");
        let arguments = ["coordinator", "--listen", "127.0.0.1:0", "--store", text(&store)];
        let refused = run(&[&arguments[..], &["--metrics", address]].concat());
        assert_eq!(refused.code, Some(code), "{refused:?}");
        assert!(refused.stderr.contains(part), "{refused:?}");
    }
}
