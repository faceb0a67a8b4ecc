//! The batch script of one job on one allocation.

use std::path::PathBuf;
use std::time::Duration;

use osteon_common::job::JobKind;

use super::shell::{absolute, quoted, without_controls};
use super::{SlurmError, directives};

/// What the script does; the settings above say with what.
const BODY: &str = include_str!("job.sh");
/// Longest wait of the script for its coordinator, s. A large store takes a while to open.
const START_S_MAX: u32 = 300;

/// Options of the script.
#[derive(Debug, Clone)]
pub struct JobScript {
    /// The program, as the nodes see it.
    pub program: PathBuf,
    /// The job file.
    pub job: PathBuf,
    /// Kind of the job.
    pub kind: JobKind,
    /// Name of the job, in Slurm's queue and of the coordinator.
    pub name: String,
    /// Number of nodes.
    pub nodes: u32,
    /// Processors of each node; `None` for whole nodes.
    pub cpus_per_node: Option<u32>,
    /// Time limit of one allocation; `None` for that of the partition.
    pub time_limit: Option<Duration>,
    /// Partition; `None` for Slurm's default.
    pub partition: Option<String>,
    /// Directory of the coordinator's store.
    pub store: PathBuf,
    /// Directory of the results.
    pub out: PathBuf,
    /// How often the job may be requeued.
    pub max_requeues: u32,
    /// Time before the time limit at which the processes are asked to end, s.
    pub stop_before_s: u32,
    /// Further options of sbatch.
    pub further: Vec<String>,
}

impl JobScript {
    /// Returns the script.
    ///
    /// # Errors
    /// If an option cannot be part of a script.
    pub fn text(&self) -> Result<String, SlurmError> {
        let directives = directives::lines(&self.directives()?, &self.further)?;
        let command = match self.kind {
            JobKind::Identification => "identify",
            JobKind::Propagation => "propagate",
        };
        let settings = [
            ("osteon", absolute(&self.program)?),
            ("command", command.to_owned()),
            ("job", absolute(&self.job)?),
            ("name", self.name.clone()),
            ("store", absolute(&self.store)?),
            ("out", absolute(&self.out)?),
            ("requeues_max", self.max_requeues.to_string()),
            ("start_s_max", START_S_MAX.to_string()),
        ];
        let settings = settings.map(|(name, value)| format!("{name}={}\n", quoted(&value)));
        Ok(format!("#!/bin/bash\n{directives}\n{}\n{BODY}", settings.concat()))
    }

    fn directives(&self) -> Result<Vec<String>, SlurmError> {
        without_controls(&self.name)?;
        let mut options = vec![
            format!("--job-name={}", slurm_name(&self.name)),
            format!("--nodes={}", self.nodes),
            "--ntasks-per-node=1".to_owned(),
            match self.cpus_per_node {
                Some(cpus) => format!("--cpus-per-task={cpus}"),
                None => "--exclusive".to_owned(),
            },
        ];
        if let Some(limit) = self.time_limit {
            options.push(format!("--time={}", directives::time(limit)));
        }
        if let Some(partition) = &self.partition {
            without_controls(partition)?;
            options.push(format!("--partition={partition}"));
        }
        options.extend([
            // To the batch script alone, which ends the others in order.
            format!("--signal=B:USR1@{}", self.stop_before_s),
            if self.max_requeues > 0 { "--requeue" } else { "--no-requeue" }.to_owned(),
            "--open-mode=append".to_owned(),
            format!("--output={}-%j.log", slurm_name(&self.name)),
        ]);
        Ok(options)
    }
}

/// Returns a name without what sbatch would interpret in it.
fn slurm_name(name: &str) -> String {
    let kept = |c: char| if c.is_alphanumeric() || "-_.,".contains(c) { c } else { '-' };
    name.chars().map(kept).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn script() -> JobScript {
        JobScript {
            program: "/opt/osteon".into(),
            job: "/home/a/quick.toml".into(),
            kind: JobKind::Identification,
            name: "quick".to_owned(),
            nodes: 4,
            cpus_per_node: None,
            time_limit: None,
            partition: None,
            store: "/home/a/store".into(),
            out: "/home/a/it's here".into(),
            max_requeues: 3,
            stop_before_s: 90,
            further: Vec::new(),
        }
    }

    #[test]
    fn directives_and_settings_are_those_of_the_options() {
        let own = script();
        let text = own.text().unwrap();
        let (head, body) = text.split_once("\nset -euo pipefail\n").unwrap();
        assert!(BODY.ends_with(body));
        insta::assert_snapshot!(head);
        let whole = JobScript {
            kind: JobKind::Propagation,
            name: "left tibia: 100%".to_owned(),
            cpus_per_node: Some(8),
            time_limit: Some(Duration::from_secs(5400)),
            partition: Some("fast,long".to_owned()),
            max_requeues: 0,
            further: vec!["--account=bones".to_owned(), "-C".to_owned(), "avx512".to_owned()],
            ..own
        };
        let text = whole.text().unwrap();
        insta::assert_snapshot!(text.split_once("\nset -euo pipefail\n").unwrap().0);
    }

    #[test]
    fn bash_can_read_the_script() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        std::io::Write::write_all(&mut file, script().text().unwrap().as_bytes()).unwrap();
        let checked =
            std::process::Command::new("bash").arg("-n").arg(file.path()).output().unwrap();
        assert!(checked.status.success(), "{checked:?}");
    }
}
