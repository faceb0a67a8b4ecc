//! `files/job.toml` without what the method "hybrid" refuses.

const EXACT_ONLY: [&str; 3] = [
    ", attenuation = { quality_factor = 400 }",
    ", attenuation = { quality_factor = 15.0, reference_frequency = 0.8e6 }",
    "tilt = 0.001\n",
];

/// Returns the job without attenuations and tilt.
pub(crate) fn without_exact_only(job: &str) -> String {
    EXACT_ONLY.iter().fold(job.to_owned(), |job, part| job.replace(part, ""))
}
