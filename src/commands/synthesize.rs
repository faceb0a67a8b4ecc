//! `synthesize`: signals of bones drawn by a job's law, as a probe would record them.

use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use osteon_client::job_point;
use osteon_common::job::JobKind;
use osteon_common::visible;
use osteon_files::{job_file, probe_file};
use osteon_local::synthesis::{Recorder, SynthesisError, SyntheticStudy};
use osteon_solver::{Isa, TraceError};

use crate::arguments::{PlaceArguments, SynthesizeArguments};
use crate::exit_status::{CommandFailure, ExitStatus, stdout_failure};
use crate::new_files::{self, NewFile};
use crate::output;
use crate::prepared_command::Ended;
use crate::resolved::OutputFormat;

/// Progress on a terminal.
const BAR: &str = "{bar:30} {pos} of {len} measurements, {eta} left";
/// Names of the files.
const SIGNALS: &str = "signals.npy";
const PROBE: &str = "probe.toml";
const TRUTH: &str = "truth.csv";

/// Records the signals and writes them.
pub(super) async fn synthesize(arguments: SynthesizeArguments, isa: Isa, cores: u32) -> Ended {
    let input = arguments.job.open().map_err(CommandFailure::bad_input)?;
    let noted =
        job_file::of_input(&input, JobKind::Propagation).map_err(CommandFailure::bad_input)?;
    let specification = noted.specification;
    let PlaceArguments { at, group } = &arguments.place;
    let point = job_point::choose(at.as_deref(), group.as_deref(), &input, &specification)
        .map_err(CommandFailure::BadInput)?;
    for name in [SIGNALS, PROBE, TRUTH] {
        new_files::refuse_existing(&arguments.out.join(name))?;
    }
    let SynthesizeArguments { series, .. } = arguments;
    let recorder = Recorder {
        noise_db: arguments.noise_db,
        gain_db: arguments.gain_db,
        dropouts: arguments.dropouts,
        full_scale: arguments.full_scale,
        time_step: arguments.time_step,
        duration: arguments.duration,
        further_sources: arguments.further_sources,
        source_pitch: arguments.source_pitch.unwrap_or_default(),
    };
    let threads = arguments.threads.unwrap_or(cores) as usize;
    let style = ProgressStyle::with_template(BAR).map_err(CommandFailure::failed)?;
    let record = move || {
        // Hidden unless stderr is a terminal.
        let bar = ProgressBar::new(series).with_style(style);
        let given = (&specification, &point);
        let recorded =
            SyntheticStudy::record(given, series, &recorder, (isa, threads), || bar.inc(1));
        bar.finish_and_clear();
        recorded
    };
    let recorded = tokio::task::spawn_blocking(record).await.map_err(CommandFailure::failed)?;
    let study = recorded.map_err(refused)?;
    write(&arguments.out, &study)?;
    let shown = visible::path(&arguments.out);
    let text = format!(
        "wrote {shown}/{SIGNALS} ({series} measurements), {PROBE} and {TRUTH}; next:\n\
         osteon pick {shown}/{SIGNALS} --describe {shown}/{PROBE} --out {shown}/velocities.csv\n"
    );
    output::stdout(OutputFormat::Text).verbatim(&text).map_err(stdout_failure)?;
    Ok(ExitStatus::Done)
}

fn write(directory: &Path, study: &SyntheticStudy) -> Result<(), CommandFailure> {
    new_files::directory(directory)?;
    let file = |name: &str, content: Vec<u8>| NewFile {
        path: directory.join(name),
        content: content.into(),
        secret: false,
    };
    let probe = probe_file::to_toml(study.description());
    new_files::create(&[
        file(SIGNALS, study.to_npy()),
        file(PROBE, probe.into_bytes()),
        file(TRUTH, study.truths_csv().into_bytes()),
    ])
}

fn refused(error: SynthesisError) -> CommandFailure {
    match error {
        SynthesisError::Threads(_)
        | SynthesisError::NoSignal(_)
        | SynthesisError::Traces(TraceError::NotFinite) => CommandFailure::failed(error),
        SynthesisError::Point(_)
        | SynthesisError::NoMean(_)
        | SynthesisError::NoBone { .. }
        | SynthesisError::Traces(_)
        | SynthesisError::TooLarge { .. } => CommandFailure::bad_input(error),
    }
}
