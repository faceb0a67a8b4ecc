//! The batch script of workers that join a coordinator elsewhere: an array of single nodes.

use std::path::PathBuf;
use std::time::Duration;

use osteon_transport::credentials::CredentialFiles;
use osteon_transport::endpoint::Endpoint;

use super::shell::{absolute, quoted, without_controls};
use super::{SlurmError, directives};

/// What the script does; the settings above say with what.
const BODY: &str = include_str!("worker.sh");
/// A worker ends this long before the time limit of its allocation, because it may take 10 s to
/// finish its batches, and Slurm may be early by tens of seconds.
pub const MARGIN: Duration = Duration::from_secs(60);

/// Options of the script.
#[derive(Debug, Clone)]
pub struct WorkerScript {
    /// The program, as the nodes see it.
    pub program: PathBuf,
    /// Address of the coordinator.
    pub endpoint: Endpoint,
    /// Credentials of the workers.
    pub files: CredentialFiles,
    /// Number of threads, and of processors, of each worker.
    pub cpus: u32,
    /// Time limit of each allocation, above [`MARGIN`].
    pub time_limit: Duration,
    /// Time over which the ends of workers that begin together are spread.
    pub stagger: Duration,
    /// Time without work after which a worker ends.
    pub idle_timeout: Duration,
    /// Partition; `None` for Slurm's default.
    pub partition: Option<String>,
    /// Further options of sbatch.
    pub further: Vec<String>,
}

impl WorkerScript {
    /// Returns the script of `count` workers under this name in Slurm's queue. Lasting workers stay
    /// without work, too.
    ///
    /// # Errors
    /// If an option cannot be part of a script.
    pub fn text(&self, name: &str, count: u32, lasting: bool) -> Result<String, SlurmError> {
        let mut own = vec![
            format!("--job-name={name}"),
            format!("--array=1-{count}"),
            "--nodes=1".to_owned(),
            "--ntasks=1".to_owned(),
            format!("--cpus-per-task={}", self.cpus),
            format!("--time={}", directives::time(self.time_limit)),
            // Another worker takes its place; one that comes back much later may not be wanted.
            "--no-requeue".to_owned(),
            format!("--output={name}-%A_%a.log"),
        ];
        if let Some(partition) = &self.partition {
            without_controls(partition)?;
            own.push(format!("--partition={partition}"));
        }
        let directives = directives::lines(&own, &self.further)?;
        let lifetime = self.time_limit.saturating_sub(MARGIN).as_secs();
        let idle = self.idle_timeout.as_secs_f64();
        let options = match lasting {
            true => format!("--give-up-after {idle}"),
            false => format!("--idle-timeout {idle}"),
        };
        Ok(format!(
            "#!/bin/bash\n{directives}\nosteon={}\n{}lifetime_s={lifetime}\nstagger_s={}\n\
             options=({options})\n\n{BODY}",
            quoted(&absolute(&self.program)?),
            self.exports()?,
            self.stagger.as_secs(),
        ))
    }

    fn exports(&self) -> Result<String, SlurmError> {
        let files = [
            ("OSTEON_TLS_CA", &self.files.ca),
            ("OSTEON_TLS_CERT", &self.files.certificate),
            ("OSTEON_TLS_KEY", &self.files.key),
            ("OSTEON_TOKEN_FILE", &self.files.token),
        ];
        let url = quoted(&self.endpoint.to_string());
        let mut text = format!("export OSTEON_COORDINATOR={url}\n");
        for (name, file) in files {
            match file {
                Some(file) => {
                    text.push_str(&format!("export {name}={}\n", quoted(&absolute(file)?)));
                }
                // What the environment of the submission has is for another coordinator.
                None => text.push_str(&format!("unset {name}\n")),
            }
        }
        Ok(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directives_and_settings_are_those_of_the_options() {
        let script = WorkerScript {
            program: "/opt/osteon".into(),
            endpoint: "https://node-1:7000".parse().unwrap(),
            files: CredentialFiles {
                ca: Some("/home/a/ca.pem".into()),
                certificate: Some("/home/a/worker.pem".into()),
                key: Some("/home/a/worker-key.pem".into()),
                token: None,
            },
            cpus: 8,
            time_limit: Duration::from_secs(3600),
            stagger: Duration::from_secs(360),
            idle_timeout: Duration::from_secs(600),
            partition: Some("fast".to_owned()),
            further: vec!["--account=bones".to_owned()],
        };
        for lasting in [false, true] {
            let text = script.text("osteon-worker", 5, lasting).unwrap();
            let head = text.split_once("\nset -euo pipefail\n").unwrap().0;
            insta::assert_snapshot!(head);
        }
    }
}
