//! Every bound of the software in one place, unit in the name.

/// Fewest receivers a probe may have: a line needs residuals.
pub const RECEIVERS_MIN: u32 = 3;
/// Most receivers a probe may have.
pub const RECEIVERS_MAX: u32 = 64;
/// Most realizations of one evaluation.
pub const REALIZATIONS_MAX: u64 = 10_000_000;
/// Most scrambles of one evaluation: enough for an error, and made in a blink.
pub const SCRAMBLES_MAX: u64 = 1024;
/// Largest seed: 2⁶³ - 1, so that every tool can hold it in a signed integer.
pub const SEED_MAX: u64 = (1 << 63) - 1;
/// Most evaluations of one job.
pub const EVALUATIONS_MAX: u64 = 1_000_000;
/// Most measured velocities of one job.
pub const DATA_VELOCITIES_MAX: usize = 1_000_000;
/// Most groups of measured velocities of one job.
pub const GROUPS_MAX: usize = 1000;
/// Most searches of one set of data, from as many starts.
pub const STARTS_MAX: u64 = 1000;
/// Smallest refinement of the solver's sampling.
pub const REFINEMENT_MIN: f64 = 0.5;
/// Largest refinement of the solver's sampling.
pub const REFINEMENT_MAX: f64 = 16.0;
/// Smallest element of the hybrid method, m.
pub const ELEMENT_SIZE_MIN: f64 = 1e-6;
/// Largest element of the hybrid method, m.
pub const ELEMENT_SIZE_MAX: f64 = 1e-2;
/// Lowest polynomial degree of the hybrid method's elements.
pub const ELEMENT_ORDER_MIN: u32 = 2;
/// Highest polynomial degree of the hybrid method's elements.
pub const ELEMENT_ORDER_MAX: u32 = 12;
/// Most (frequency, wavenumber) pairs of one realization.
pub const SAMPLING_PAIRS_MAX: f64 = 1e7;
/// Longest file of measured velocities, and longest file of a run that is read again, bytes.
pub const FILE_BYTES_MAX: u64 = 64 << 20;
/// Longest line of a file of measured velocities, bytes.
pub const LINE_BYTES_MAX: usize = 64 << 10;
/// Longest job file, bytes. (A million velocities inlined take 20 MB, one on each line 24 MB.)
pub const JOB_FILE_BYTES_MAX: u64 = 32 << 20;
/// Longest case file, bytes. (Its 36 entries of a matrix take 1 kB.)
pub const CASE_FILE_BYTES_MAX: u64 = 1 << 20;
/// Most values in a job or case file: measured velocities, and room for everything else.
pub const DOCUMENT_VALUES_MAX: usize = DATA_VELOCITIES_MAX + 100_000;
/// Most keys, tables and lists in a job or case file: two for each group, and room for everything
/// else. Each may take a kilobyte of memory.
pub const DOCUMENT_KEYS_MAX: usize = 10_000;
/// Most words, marks, spaces, comments and line ends in a TOML file: six for each value, as many as
/// `    3900.5,` on a line of its own has. A parser keeps each.
pub const TOML_TOKENS_MAX: usize = 6 * DOCUMENT_VALUES_MAX;
/// Longest message on the wire, bytes.
pub const MESSAGE_BYTES_MAX: usize = 64 << 20;
/// Most realizations in one batch: 17 bytes each on the wire.
pub const BATCH_REALIZATIONS_MAX: u32 = 1 << 16;
/// Most threads a worker may announce.
pub const WORKER_THREADS_MAX: u32 = 4096;
/// Most workers attached to a coordinator at a time.
pub const WORKERS_MAX: usize = 4096;
/// Most jobs that wait or run at a time.
pub const JOBS_MAX: usize = 10_000;
/// Most bytes that the specifications of jobs that wait or run take together.
pub const JOBS_BYTES_MAX: u64 = 1 << 30;
/// One client's jobs may take this part of that.
pub const JOBS_BYTES_CLIENT_DIVISOR: u64 = 4;
/// Most realizations of the jobs that are computed at a time: some 50 bytes each.
pub const ACTIVE_REALIZATIONS_MAX: u64 = 2 * REALIZATIONS_MAX;
/// Most jobs that are computed at a time, unless an operator chooses otherwise.
pub const ACTIVE_JOBS_MAX: usize = 8;
/// Longest name or id in a request, bytes.
pub const NAME_BYTES_MAX: usize = 256;
/// Longest message of a worker, bytes: a batch's answer has 1.1 MB.
pub const WORKER_MESSAGE_BYTES_MAX: usize = 4 << 20;
/// Longest file of certificates, keys or tokens, bytes.
pub const CREDENTIAL_FILE_BYTES_MAX: u64 = 4 << 20;
/// Longest wait for the end of a pipe in the place of such a file, s.
pub const CREDENTIAL_PIPE_S_MAX: u64 = 10;
/// Most tokens that a coordinator knows.
pub const TOKENS_MAX: usize = 10_000;
/// Most connections to a coordinator at a time.
pub const CONNECTIONS_MAX: usize = 3 * WORKERS_MAX;
/// Most TLS handshakes that a coordinator has under way.
pub const HANDSHAKES_MAX: usize = 256;
/// Longest message of a submission that is read whatever else is read, bytes.
pub const SMALL_SUBMISSION_BYTES_MAX: u64 = 64 << 10;
/// Most larger submissions whose messages a coordinator reads at a time; others wait.
pub const SUBMISSIONS_AT_ONCE_MAX: usize = 16;
/// Most of them that are of one caller.
pub const SUBMISSIONS_OF_ONE_MAX: usize = 4;
/// Longest time that such a message takes, s.
pub const SUBMISSION_S_MAX: u64 = 10;
/// Longest time from a call to the beginning of its answer, s.
pub const CALL_S_MAX: u64 = 60;
/// Longest list of headers of a call, bytes.
pub const HEADER_BYTES_MAX: u32 = 16 << 10;
/// Most fetches that a coordinator holds results for at a time; others wait.
pub const FETCHES_AT_ONCE_MAX: usize = 8;
/// Most of them that are of one caller.
pub const FETCHES_OF_ONE_MAX: usize = 2;
/// Longest time that a fetch takes, s.
pub const FETCH_S_MAX: u64 = 300;
/// Longest time that a backup takes, s.
pub const BACKUP_S_MAX: u64 = 3600;
/// A fetch ends when its reader takes nothing for this long, s.
pub const READER_PATIENCE_S: u64 = 30;
/// Highest priority of a job among those of its client.
pub const PRIORITY_MAX: u32 = 9;
