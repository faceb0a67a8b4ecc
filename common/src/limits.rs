//! Limits that several crates share. The unit is in the name or in the comment. Other limits are beside
//! the code that uses them.

/// Smallest quality factor that is accepted.
pub(crate) const QUALITY_FACTOR_MIN: f64 = 2.0;
/// Minimum number of receivers of a probe: with fewer, the fit of a line leaves no residuals.
pub const RECEIVERS_MIN: u32 = 3;
/// Maximum number of receivers of a probe.
pub const RECEIVERS_MAX: u32 = 64;
/// Maximum number of solid sublayers of a bone.
pub const SUBLAYERS_MAX: usize = 16;
/// Maximum number of sublayers of a fluid.
pub const FLUID_SUBLAYERS_MAX: usize = 4;
/// Minimum thickness of a sublayer, m: that of one thinner than a lamella of bone loses digits.
pub const SUBLAYER_THICKNESS_MIN: f64 = 1e-6;
/// Maximum number of realizations of one evaluation.
pub const REALIZATIONS_MAX: u64 = 10_000_000;
/// Maximum number of scrambles of one evaluation: enough to estimate an error, and quick to
/// generate.
pub const SCRAMBLES_MAX: u64 = 1024;
/// Largest seed: 2⁶³ - 1, so that it fits in a signed 64-bit integer.
pub const SEED_MAX: u64 = (1 << 63) - 1;
/// Maximum number of evaluations of one job.
pub const EVALUATIONS_MAX: u64 = 1_000_000;
/// Maximum number of measured velocities of one job.
pub const DATA_VELOCITIES_MAX: usize = 1_000_000;
/// Maximum number of measured velocities of one job with a subject: with both lists inlined, a job
/// file has as many values as with [`DATA_VELOCITIES_MAX`] velocities.
pub const DATA_SUBJECTS_MAX: usize = DATA_VELOCITIES_MAX / 2;
/// Maximum number of velocities behind given moments.
pub const DATA_COUNT_MAX: u64 = 1_000_000_000;
/// Maximum number of outlying velocities of a set that a result lists.
pub const OUTLIERS_LISTED_MAX: usize = 100;
/// Maximum number of groups of measured velocities of one job.
pub const GROUPS_MAX: usize = 1000;
/// Maximum number of searches of one set of data, each from a different start.
pub const STARTS_MAX: u64 = 1000;
/// Maximum number of draws from the posteriors of all groups of one job together; each takes 80
/// bytes of memory, and 200 in a table.
pub const DRAWS_ALL_MAX: u64 = 2_000_000;
/// Smallest refinement of the solver's sampling.
pub const REFINEMENT_MIN: f64 = 0.5;
/// Largest refinement of the solver's sampling.
pub const REFINEMENT_MAX: f64 = 16.0;
/// Smallest accepted `solver.element_size`, m.
pub const ELEMENT_SIZE_MIN: f64 = 1e-6;
/// Largest accepted `solver.element_size`, m.
pub const ELEMENT_SIZE_MAX: f64 = 1e-2;
/// Lowest polynomial degree of the hybrid method's elements.
pub const ELEMENT_ORDER_MIN: u32 = 2;
/// Highest polynomial degree of the hybrid method's elements.
pub const ELEMENT_ORDER_MAX: u32 = 12;
/// Maximum number of (frequency, wavenumber) pairs of one realization.
pub const SAMPLING_PAIRS_MAX: f64 = 1e7;
/// Maximum size of a CSV file of velocities, and of an output file that osteon reads again, bytes.
pub const FILE_BYTES_MAX: u64 = 64 << 20;
/// Maximum length of a line of a CSV file of velocities, bytes.
pub const LINE_BYTES_MAX: usize = 64 << 10;
/// Longest job file, bytes. (A million velocities inlined take 20 MB, or 24 MB with one on each
/// line.)
pub const JOB_FILE_BYTES_MAX: u64 = 32 << 20;
/// Longest case file, bytes. (The 36 entries of its matrix take 1 kB.)
pub const CASE_FILE_BYTES_MAX: u64 = 1 << 20;
/// Maximum number of values in a job or case file: measured velocities, and room for everything
/// else.
pub const DOCUMENT_VALUES_MAX: usize = DATA_VELOCITIES_MAX + 100_000;
/// Maximum number of keys, tables and lists in a job or case file: a key and a list for each of
/// [`GROUPS_MAX`] groups, and ample room for the rest. Each may take a kilobyte of memory.
pub const DOCUMENT_KEYS_MAX: usize = 10_000;
/// Maximum number of tokens in a TOML file (words, punctuation marks, spaces, comments, line ends): six
/// for each value, since the line `    3900.5,` consists of six. A parser stores each of them.
pub const TOML_TOKENS_MAX: usize = 6 * DOCUMENT_VALUES_MAX;
/// Longest message on the wire, bytes.
pub const MESSAGE_BYTES_MAX: usize = 64 << 20;
/// Maximum number of realizations in one batch; each takes 17 bytes on the wire.
pub const BATCH_REALIZATIONS_MAX: u32 = 1 << 16;
/// Maximum number of threads that a worker may announce.
pub const WORKER_THREADS_MAX: u32 = 4096;
/// Maximum number of workers attached to a coordinator at the same time.
pub const WORKERS_MAX: usize = 4096;
/// Maximum number of jobs that wait or run at the same time.
pub const JOBS_MAX: usize = 10_000;
/// Maximum total size of the specifications of jobs that wait or run, bytes.
pub const JOBS_BYTES_MAX: u64 = 1 << 30;
/// One client's share of [`JOBS_MAX`] and of [`JOBS_BYTES_MAX`] is each of them divided by this number,
/// so that no client alone shuts out the others.
pub const CLIENT_SHARE_DIVISOR: u32 = 4;
/// Maximum total number of realizations in the evaluations under way, over all jobs; each takes about
/// 50 bytes of memory.
pub const ACTIVE_REALIZATIONS_MAX: u64 = 2 * REALIZATIONS_MAX;
/// Default maximum number of jobs that are computed at the same time.
pub const ACTIVE_JOBS_MAX: usize = 8;
/// Longest name or id in a request, bytes.
pub const NAME_BYTES_MAX: usize = 256;
/// Longest message from a worker, bytes; the largest answer to a batch takes 1.1 MB, and 0.5 MB
/// more for each observable.
pub const WORKER_MESSAGE_BYTES_MAX: usize = 4 << 20;
/// Longest file of certificates, keys or tokens, bytes.
pub const CREDENTIAL_FILE_BYTES_MAX: u64 = 4 << 20;
/// Longest time to read credentials from a pipe that is given instead of a file, s.
pub const CREDENTIAL_PIPE_SECONDS_MAX: u64 = 10;
/// Maximum number of tokens in a coordinator's list.
pub const TOKENS_MAX: usize = 10_000;
/// Maximum number of connections to a coordinator at the same time.
pub const CONNECTIONS_MAX: usize = 3 * WORKERS_MAX;
/// Maximum number of TLS handshakes of a coordinator at the same time.
pub const HANDSHAKES_MAX: usize = 256;
/// Longest submission that is read without a permit of the concurrency limiter, bytes; longer ones
/// are large.
pub const SMALL_SUBMISSION_BYTES_MAX: u64 = 64 << 10;
/// Maximum number of large submissions that a coordinator reads at the same time; others wait.
pub const SUBMISSIONS_AT_ONCE_MAX: usize = 16;
/// Maximum number of large submissions that a coordinator reads from one caller at the same time.
pub const SUBMISSIONS_PER_CALLER_MAX: usize = 4;
/// Longest time to read one large submission, s.
pub const SUBMISSION_SECONDS_MAX: u64 = 10;
/// Longest time from a call to the beginning of its answer, s.
pub const CALL_SECONDS_MAX: u64 = 60;
/// Maximum size of the headers of a call, bytes.
pub const HEADER_BYTES_MAX: u32 = 16 << 10;
/// Maximum number of fetches for which a coordinator holds results at the same time; others wait.
pub const FETCHES_AT_ONCE_MAX: usize = 8;
/// Maximum number of concurrent fetches of one caller.
pub const FETCHES_PER_CALLER_MAX: usize = 2;
/// Longest duration of a fetch, s.
pub const FETCH_SECONDS_MAX: u64 = 300;
/// Longest duration of a backup, s.
pub const BACKUP_SECONDS_MAX: u64 = 3600;
/// A fetch or a backup is cancelled if the client reads no data for this long, s.
pub const READER_STALL_SECONDS_MAX: u64 = 30;
/// Largest priority value of a job. Priorities order only the jobs of one client.
pub const PRIORITY_MAX: u32 = 9;
/// Maximum number of axes of an array of signals: series, transmitter, receiver, time.
pub const SIGNAL_AXES_MAX: usize = 4;
/// Maximum number of sources of a probe's signals.
pub const TRANSMITTERS_MAX: usize = 64;
/// Maximum number of samples of all signals of one file, which takes 512 MB.
pub const SIGNAL_SAMPLES_MAX: u64 = 1 << 26;
/// Maximum number of samples of one signal.
pub const SIGNAL_LENGTH_MAX: usize = 1 << 20;
