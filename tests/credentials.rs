//! `certs` and `token`, and the errors of coordinator and clients about files that cannot be used:
//! exit code 2, before anything is bound, created or sent.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[path = "support/secure.rs"]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod secure;
#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::io::Write as _;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use secure::{Secure, door, mode, set_up};
use support::{Finished, Owned, Scratch, eventually, osteon, run, text};

fn permissions(path: &Path) -> u32 {
    fs::metadata(path).unwrap().permissions().mode() & 0o7777
}

#[test]
fn certs_makes_keys_that_only_their_owner_reads_and_replaces_none() {
    let scratch = Scratch::new();
    let directory = scratch.path("new/certs");
    let made = run(&["certs", text(&directory), "--host", "node-1.example", "--host", "10.0.0.7"]);
    let listed: Vec<&Path> = made.succeeded().lines().map(Path::new).collect();
    assert_eq!(listed.len(), 8, "{listed:?}");
    for path in &listed {
        let secret = text(path).ends_with("-key.pem");
        assert_eq!(permissions(path), if secret { 0o600 } else { 0o644 }, "{}", path.display());
    }
    assert_eq!(permissions(&directory), 0o700);

    let before: Vec<Vec<u8>> = listed.iter().map(|path| fs::read(path).unwrap()).collect();
    let refuse = |directory: &Path, expected: &str| {
        let refused = run(&["certs", text(directory)]);
        assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""), "{refused:?}");
        assert!(refused.stderr.contains(expected), "{refused:?}");
    };
    refuse(&directory, "ca.pem already exists");
    let after: Vec<Vec<u8>> = listed.iter().map(|path| fs::read(path).unwrap()).collect();
    assert_eq!(before, after);
    // If one file exists already, even as a dangling link, none is created.
    let other = scratch.path("other");
    fs::create_dir(&other).unwrap();
    std::os::unix::fs::symlink("/nonexistent", other.join("worker-key.pem")).unwrap();
    refuse(&other, "worker-key.pem already exists");
    assert_eq!(fs::read_dir(&other).unwrap().count(), 1);

    // New certificates of the same authority, whose key stays where it is.
    let renewed = scratch.path("renewed");
    let again = run(&["certs", text(&renewed), "--ca", text(&directory), "--days", "30"]);
    assert_eq!(again.succeeded().lines().count(), 7, "{again:?}");
    assert_eq!(fs::read(renewed.join("ca.pem")).unwrap(), before[0]);
    assert!(!renewed.join("ca-key.pem").exists());
}

#[test]
fn certs_names_what_it_cannot_use() {
    let scratch = Scratch::new();
    set_up(&scratch);
    let out = scratch.path("out");
    let check = |arguments: &[&str], expected: &str| {
        let refused = run(&[&["certs", text(&out)], arguments].concat());
        assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""), "{refused:?}");
        assert!(refused.stderr.contains(expected), "{refused:?}");
        assert!(!out.exists(), "{arguments:?}");
    };
    for host in ["", "a b", "http://a", "a:1", "é"] {
        check(&["--host", host], "neither a host name nor an IP address");
    }
    check(&["--days", "0"], "0 is not in 1..=3650");
    check(&["--ca", "/nonexistent"], "cannot read /nonexistent/ca.pem");
    let key = scratch.path("certs/ca-key.pem");
    mode(&key, 0o644);
    check(&["--ca", text(&scratch.path("certs"))], "ca-key.pem is open to other users");
    mode(&key, 0o600);
    fs::copy(scratch.path("certs/worker-key.pem"), &key).unwrap();
    check(&["--ca", text(&scratch.path("certs"))], "is not the one of the certificate");
}

#[test]
fn token_writes_the_token_once_and_shows_only_its_hash() {
    let scratch = Scratch::new();
    let out = scratch.path("a.token");
    let make = |name: &str, out: &Path, more: &[&str]| {
        run(&[&["token", name, "--role", "read", "--out", text(out)], more].concat())
    };
    let line = make("ann", &out, &[]).succeeded().to_owned();
    assert!(line.starts_with("ann read blake3:") && line.lines().count() == 1, "{line}");
    let token = fs::read_to_string(&out).unwrap();
    assert_eq!(permissions(&out), 0o600);
    assert!(token.starts_with("osteon_") && !line.contains(token.trim()));

    let refused = make("ann", &out, &[]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("a.token already exists"), "{refused:?}");
    assert_eq!(fs::read_to_string(&out).unwrap(), token);

    // Lines are appended to a list, even if its last line has no end.
    let list = scratch.path("tokens");
    let added = make("bob", &scratch.path("b.token"), &["--tokens", text(&list)]);
    assert_eq!(added.succeeded(), "");
    assert_eq!(permissions(&list), 0o600);
    fs::write(&list, fs::read_to_string(&list).unwrap().trim_end()).unwrap();
    make("cy", &scratch.path("c.token"), &["--tokens", text(&list)]).succeeded();
    let names: Vec<String> = fs::read_to_string(&list)
        .unwrap()
        .lines()
        .map(|line| line.split(' ').next().unwrap().to_owned())
        .collect();
    assert_eq!(names, ["bob", "cy"]);

    let refused = make("a b", &scratch.path("d.token"), &[]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    let refused = make("dan", &scratch.path("d.token"), &["--tokens", "/nonexistent/tokens"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(!scratch.path("d.token").exists());
}

/// Runs a coordinator with `arguments`, which must be refused.
fn refused_coordinator(scratch: &Scratch, arguments: &[String], expected: &str) {
    let words: Vec<String> = [&["coordinator".to_owned()], arguments].concat();
    let refused: Finished = run(&words);
    let context = format!("{words:?}: {refused:?}");
    assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""), "{context}");
    assert!(refused.stderr.contains(expected), "{expected}: {context}");
    assert!(!scratch.path("store").exists(), "{context}");
}

#[test]
fn a_coordinator_is_open_to_others_with_tls_and_tokens_only() {
    let scratch = Scratch::new();
    set_up(&scratch);
    let all = door(&scratch, "server");
    let option = |name: &str| {
        let at = all.iter().position(|word| word == name).unwrap();
        all[at..at + 2].to_vec()
    };
    let check = |address: &str, options: &[&str], more: &[&str], expected: &str| {
        let mut arguments = vec!["--listen".to_owned(), address.to_owned()];
        arguments.extend(option("--store"));
        arguments.extend(options.iter().flat_map(|name| option(name)));
        arguments.extend(more.iter().map(|&word| word.to_owned()));
        refused_coordinator(&scratch, &arguments, expected);
    };
    let tls = ["--tls-ca", "--tls-cert", "--tls-key"];
    check("0.0.0.0:0", &[], &[], "give --tls-cert, --tls-key, --tls-ca and --tokens");
    check("[::]:0", &[], &[], "--insecure");
    check("0.0.0.0:0", &["--tokens"], &[], "tokens would be readable on their way");
    check("0.0.0.0:0", &["--tokens"], &["--insecure"], "cannot be used with");
    check("0.0.0.0:0", &tls, &["--insecure"], "cannot be used with");
    check("0.0.0.0:0", &tls, &[], "with TLS, --tokens FILE or --token-file FILE is required");
    check("127.0.0.1:0", &tls, &[], "with TLS, --tokens FILE or --token-file FILE is required");
    check(
        "unix:/tmp/a",
        &[&tls[..], &["--tokens"]].concat(),
        &[],
        "a Unix socket does not use TLS",
    );
    for missing in tls {
        let rest: Vec<&str> = tls.into_iter().filter(|name| *name != missing).collect();
        check("127.0.0.1:0", &rest, &[], missing);
    }
}

#[test]
fn a_coordinators_files_are_checked_before_anything_is_bound() {
    let check = |damage: &dyn Fn(&Scratch), expected: &str| {
        let scratch = Scratch::new();
        set_up(&scratch);
        damage(&scratch);
        let listen = ["--listen", "127.0.0.1:0"].map(str::to_owned).to_vec();
        refused_coordinator(&scratch, &[listen, door(&scratch, "server")].concat(), expected);
    };
    let write = |name: &'static str, text: &'static str| {
        move |scratch: &Scratch| fs::write(scratch.path(name), text).unwrap()
    };
    let open = |name: &'static str| move |scratch: &Scratch| mode(&scratch.path(name), 0o644);
    let copy = |from: &'static str, to: &'static str| {
        move |scratch: &Scratch| {
            fs::copy(scratch.path(from), scratch.path(to)).unwrap();
        }
    };
    let remove =
        |name: &'static str| move |scratch: &Scratch| fs::remove_file(scratch.path(name)).unwrap();
    for name in ["certs/ca.pem", "certs/server.pem", "certs/server-key.pem", "tokens"] {
        check(&remove(name), name);
    }
    check(&open("certs/server-key.pem"), "server-key.pem is open to other users (mode 0644)");
    check(&open("tokens"), "tokens is open to other users (mode 0644)");
    check(
        &copy("certs/worker-key.pem", "certs/server-key.pem"),
        "is not the one of the certificate",
    );
    check(&write("certs/server.pem", "text"), "server.pem holds no certificate");
    check(&write("certs/ca.pem", ""), "ca.pem holds no certificate");
    check(&write("tokens", ""), "holds no tokens");
    check(&write("tokens", "ann read"), "line 1 has 2 words");
    check(
        &|scratch| {
            let token = fs::read_to_string(scratch.path("read.token")).unwrap();
            fs::write(scratch.path("tokens"), format!("ann read {token}")).unwrap();
        },
        "holds the token of `ann` itself",
    );
}

#[test]
fn a_clients_options_are_checked_before_anything_is_sent() {
    let scratch = Scratch::new();
    set_up(&scratch);
    let job = scratch.write("job.toml", &support::job(20, 1));
    let file = |name: &str| text(&scratch.path(name)).to_owned();
    let (ca, token, certificate) =
        (file("certs/ca.pem"), file("read.token"), file("certs/worker.pem"));
    let key = file("certs/client-key.pem");
    let check = |url: &str, options: &[&str], expected: &str| {
        for command in [&["jobs"][..], &["worker"], &["identify", text(&job)]] {
            let refused = run(&[command, &["--coordinator", url], options].concat());
            assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""), "{refused:?}");
            assert!(refused.stderr.contains(expected), "{expected}: {refused:?}");
        }
    };
    // Nobody listens at these addresses: a command that sent something would end with code 1.
    let (tls, far, near) = ("https://127.0.0.1:1", "http://10.255.255.1:1", "http://127.0.0.1:1");
    check(tls, &[], "needs --tls-ca");
    check(tls, &["--tls-ca", "/nonexistent"], "cannot read /nonexistent");
    check(tls, &["--tls-ca", &ca, "--tls-cert", &certificate], "--tls-key is missing");
    check(tls, &["--tls-ca", &ca, "--tls-key", &key], "--tls-cert is missing");
    let mismatched = ["--tls-ca", &ca, "--tls-cert", &certificate, "--tls-key", &key];
    check(tls, &mismatched, "is not the one of the certificate");
    check(tls, &["--tls-ca", &ca, "--token-file", &ca], "is open to other users");
    check(tls, &["--tls-ca", &ca, "--token-file", &key], "is not a valid osteon token");
    check(far, &["--token-file", &token], "in the clear");
    check(near, &["--tls-ca", &ca], "--tls-ca requires TLS");
    check("unix:/nonexistent", &["--tls-ca", &ca], "--tls-ca requires TLS");

    let embedded = run(&["identify", text(&job), "--token-file", &token]);
    assert_eq!(embedded.code, Some(2), "{embedded:?}");
    assert!(embedded.stderr.contains("add --coordinator URL"), "{embedded:?}");
}

/// A named pipe that only its owner can read.
fn pipe(scratch: &Scratch, name: &str) -> PathBuf {
    let path = scratch.path(name);
    let made = Command::new("mkfifo").args(["-m", "600", text(&path)]).status().unwrap();
    assert!(made.success());
    path
}

/// Like that of a password manager: `--token-file <(pass show osteon)`.
#[test]
fn a_token_may_come_through_a_pipe() {
    let secure = Secure::start();
    let (ca, token) = (secure.scratch.path("certs/ca.pem"), secure.scratch.path("read.token"));
    let jobs = ["jobs", "--coordinator", &secure.url, "--tls-ca", text(&ca), "--token-file"];
    let mut command = osteon();
    command.args(jobs).arg("/dev/stdin").stdin(Stdio::piped());
    let mut client = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    client.stdin.take().unwrap().write_all(&fs::read(&token).unwrap()).unwrap();
    Finished::of(client.wait_with_output().unwrap()).succeeded();
    // The wait for a pipe without a writer is limited.
    let silent = pipe(&secure.scratch, "silent");
    let refused = run(&[&jobs[..], &[text(&silent)]].concat());
    assert_eq!(refused.code, Some(2), "{refused:?}");
    let expected = "silent: it is a pipe, and its writer did not close it within 10 s";
    assert!(refused.stderr.contains(expected), "{refused:?}");
}

#[test]
fn a_coordinator_keeps_what_came_through_a_pipe() {
    let scratch = Scratch::new();
    set_up(&scratch);
    let list = pipe(&scratch, "list");
    let lines = fs::read(scratch.path("tokens")).unwrap();
    let writer = std::thread::spawn({
        let list = list.clone();
        move || fs::write(list, lines).unwrap()
    });
    let url = format!("unix:{}", scratch.path("socket").display());
    let mut command = osteon();
    command.args(["coordinator", "--listen", &url, "--tokens", text(&list), "--store"]);
    let log = scratch.path("log");
    let process = Owned::spawn_logging(command.arg(scratch.path("store")), &log);
    writer.join().unwrap();
    let token = scratch.path("read.token");
    let jobs = ["jobs", "--coordinator", &url, "--token-file", text(&token)];
    run(&jobs).succeeded();
    process.signal("HUP");
    let told = "list is a pipe, which cannot be read again";
    eventually("the log says so", || fs::read_to_string(&log).unwrap().contains(told));
    run(&jobs).succeeded();
}
