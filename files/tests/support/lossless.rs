//! `files/job.toml` without the attenuations, which the method "hybrid" refuses.

const ATTENUATIONS: [&str; 2] = [
    ", attenuation = { quality_factor = 400 }",
    ", attenuation = { quality_factor = 15.0, reference_frequency = 0.8e6 }",
];

/// Returns the job without its attenuations.
pub(crate) fn without_attenuation(job: &str) -> String {
    ATTENUATIONS.iter().fold(job.to_owned(), |job, attenuation| job.replace(attenuation, ""))
}
