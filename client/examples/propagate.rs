//! Submits a propagation to a running coordinator, follows it and prints its mean velocity:
//! `cargo run --package osteon-client --example propagate -- http://127.0.0.1:7878 examples/quick.toml`

#![expect(clippy::print_stdout, reason = "an example prints its result")]

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use osteon_client::client::{Client, ClientError, Remote, SubmitOptions};
use osteon_client::listener::RunListener;
use osteon_client::request_id::RequestId;
use osteon_common::job::JobKind;
use osteon_files::job_file;
use osteon_proto::v1::JobSnapshot;

/// Prints what the client waits for.
#[derive(Debug)]
struct Notes;

impl RunListener for Notes {
    fn note(&self, text: &str) {
        println!("{text}");
    }
}

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [url, file] = words.as_slice() else {
        return Err("give the URL of a coordinator and a job file".into());
    };
    let (mean, digest) = propagate(url, Path::new(file)).await?;
    println!("mean velocity {mean} m/s, digest {digest}");
    Ok(())
}

/// Returns the mean velocity of a propagation, m/s, and the digest of its result.
pub(crate) async fn propagate(url: &str, file: &Path) -> Result<(f64, String), Box<dyn Error>> {
    let job = job_file::read(file, JobKind::Propagation)?;
    let mut client = Client::connect(&Remote::at(url.parse()?), Arc::new(Notes)).await?;
    let id = client.submit(&job, &RequestId::new()?, SubmitOptions::default()).await?;
    let show = |snapshot: &JobSnapshot| {
        println!("{} of {} realizations", snapshot.realizations_done, snapshot.realizations);
        Ok::<_, ClientError>(())
    };
    client.watch(&id, show).await?;
    let result = client.fetch(&id).await?.result;
    let mean = result.velocity().moments.mean.ok_or("no realization has a velocity")?;
    Ok((mean, result.digest().to_owned()))
}
