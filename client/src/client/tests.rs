//! Tests of a client's reaction to lost connections and answers.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use osteon_common::job::JobKind;
use osteon_coordinator::store::memory::MemoryStore;
use osteon_coordinator::{Config, Coordinator, Listener};
use osteon_files::job_file;
use tokio::net::{TcpListener, UnixListener, UnixStream};
use tokio::sync::Notify;
use tokio::time::Instant;
use tonic::Status;

use super::*;
use crate::listener::Silent;

#[test]
fn an_answer_is_told_from_a_loss() {
    let peer = Peer::new(&remote_at("unix:a".parse().unwrap()), Arc::new(Silent));
    let shown = |status: &Status| peer.interpret_refusal(status).to_string();
    let answered = Status::unavailable("the store is full");
    assert_eq!(shown(&answered), "the coordinator at unix:a is unavailable: the store is full");
    for mut broken in [Status::unavailable("reset"), Status::internal("reset")] {
        broken.set_source(Arc::new(std::io::Error::other("reset")));
        assert_eq!(shown(&broken), "lost the coordinator at unix:a: reset");
    }
    let refusal = shown(&Status::already_exists("taken"));
    assert_eq!(refusal, "taken (coordinator unix:a)");
}

#[tokio::test(start_paused = true)]
async fn a_coordinator_that_is_not_there_is_waited_for_but_not_for_ever() {
    let directory = tempfile::tempdir().unwrap();
    let socket = directory.path().join("socket");
    let endpoint = Endpoint::Unix(socket.clone());
    let remote = remote_at(endpoint);
    let begun = Instant::now();
    let error = connect(&remote).await.unwrap_err().to_string();
    assert!(error.contains("cannot reach") && error.contains("socket"), "{error}");
    let waited = begun.elapsed();
    assert!(waited > answer_limit() * 9 / 10 && waited <= answer_limit(), "{waited:?}");

    let comes = async {
        sleep(answer_limit() / 2).await;
        tokio::net::UnixListener::bind(&socket).unwrap()
    };
    let (_listener, connected) = tokio::join!(comes, connect(&remote));
    connected.unwrap();
}

fn remote(socket: &Path) -> Remote {
    remote_at(Endpoint::Unix(socket.to_owned()))
}

fn remote_at(endpoint: Endpoint) -> Remote {
    Remote::at(endpoint)
}

async fn connect(remote: &Remote) -> Result<Client, ClientError> {
    Client::connect(remote, Arc::new(Silent)).await
}

fn example() -> JobSpecification {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/quick.toml"));
    job_file::read(&path, JobKind::Propagation).unwrap()
}

async fn coordinator(socket: &Path) -> Coordinator {
    let address = format!("unix:{}", socket.display()).parse().unwrap();
    let listener = Listener::bind(&address, false).await.unwrap();
    let store = Box::new(MemoryStore::new());
    osteon_coordinator::start(listener, store, Config::default()).await.unwrap()
}

/// Forwards the requests of the first connection to `from` to `to`, but no answers, until `cut` is
/// notified; later connections work normally.
async fn loses_the_first_answer(from: UnixListener, to: PathBuf, cut: Arc<Notify>) {
    let (mut client, _) = from.accept().await.unwrap();
    let mut server = UnixStream::connect(&to).await.unwrap();
    tokio::select! {
        copied = tokio::io::copy(&mut client, &mut server) => drop(copied),
        () = cut.notified() => {}
    }
    drop((client, server));
    loop {
        let (mut client, _) = from.accept().await.unwrap();
        let mut server = UnixStream::connect(&to).await.unwrap();
        tokio::spawn(async move {
            drop(tokio::io::copy_bidirectional(&mut client, &mut server).await);
        });
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_submission_whose_answer_is_lost_makes_one_job() {
    let directory = tempfile::tempdir().unwrap();
    let [there, between] = ["there", "between"].map(|name| directory.path().join(name));
    let coordinator = coordinator(&there).await;
    let cut = Arc::new(Notify::new());
    let listener = UnixListener::bind(&between).unwrap();
    let proxy = tokio::spawn(loses_the_first_answer(listener, there.clone(), Arc::clone(&cut)));
    let mut client = connect(&remote(&between)).await.unwrap();
    let mut witness = connect(&remote(&there)).await.unwrap();
    let (specification, request) = (example(), RequestId::new().unwrap());
    let accepted = async {
        while witness.list().await.unwrap().is_empty() {
            sleep(Duration::from_millis(5)).await;
        }
        cut.notify_one();
    };
    let (submitted, ()) =
        tokio::join!(client.submit(&specification, &request, SubmitOptions::default()), accepted);
    let jobs = witness.list().await.unwrap();
    assert_eq!(jobs.len(), 1);
    assert_eq!(submitted.unwrap(), jobs[0].job);
    proxy.abort();
    coordinator.shutdown().await;
}

#[tokio::test(start_paused = true)]
async fn a_submission_that_nobody_answers_says_how_to_find_its_job() {
    let directory = tempfile::tempdir().unwrap();
    let socket = directory.path().join("socket");
    let listener = UnixListener::bind(&socket).unwrap();
    let cuts = tokio::spawn(async move {
        loop {
            drop(listener.accept().await.unwrap());
        }
    });
    let mut client = connect(&remote(&socket)).await.unwrap();
    let (begun, request) = (Instant::now(), RequestId::new().unwrap());
    let error = client.submit(&example(), &request, SubmitOptions::default()).await.unwrap_err();
    assert!(matches!(error, ClientError::Uncertain { .. }), "{error:?}");
    let told = format!("--request-id {} ", request.id);
    assert!(error.to_string().contains(&told), "{error}");
    assert!(begun.elapsed() <= answer_limit(), "{:?}", begun.elapsed());
    cuts.abort();
}

/// TLS may be the reason if a coordinator never answers, but not if it answered before it was
/// killed.
#[tokio::test(flavor = "multi_thread")]
async fn tls_is_thought_of_only_where_no_answer_ever_came() {
    let directory = tempfile::tempdir().unwrap();
    let there = directory.path().join("there");
    let coordinator = coordinator(&there).await;
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let endpoint: Endpoint = format!("http://{}", listener.local_addr().unwrap()).parse().unwrap();
    let (broken, is_broken) = (Arc::new(Notify::new()), Arc::new(Notify::new()));
    let proxy = tokio::spawn({
        let (broken, is_broken) = (Arc::clone(&broken), Arc::clone(&is_broken));
        async move {
            let (mut client, _) = listener.accept().await.unwrap();
            let mut server = UnixStream::connect(&there).await.unwrap();
            tokio::select! {
                copied = tokio::io::copy_bidirectional(&mut client, &mut server) => drop(copied),
                () = broken.notified() => {}
            }
            drop((client, server));
            is_broken.notify_one();
            // Behaves like a port on which a different service listens.
            loop {
                drop(listener.accept().await.unwrap());
            }
        }
    });
    let remote = remote_at(endpoint);
    let mut before = connect(&remote).await.unwrap();
    before.list().await.unwrap();
    broken.notify_one();
    is_broken.notified().await;
    let error = before.list().await.unwrap_err();
    assert!(matches!(error, ClientError::Lost { .. }), "{error:?}");
    assert!(!error.to_string().contains("https://"), "{error}");
    let mut never = connect(&remote).await.unwrap();
    let error = never.list().await.unwrap_err().to_string();
    assert!(error.contains("if the coordinator uses TLS, write https://"), "{error}");
    proxy.abort();
    coordinator.shutdown().await;
}
