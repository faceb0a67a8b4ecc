//! `files/job.toml` without what the method "hybrid" refuses.

const EXACT_ONLY: [&str; 5] = [
    ", attenuation = { quality_factor = 400 }",
    ", attenuation = { quality_factor = 15.0, reference_frequency = 0.8e6 }",
    "tilt = 0.001\n",
    "[random.bone_quality_factor]\nstandard_deviation = 2.0\ndistribution = \"log_normal\"\n",
    "[random.probe_tilt]\nstandard_deviation = 0.002\ndistribution = \"uniform\"\n",
];

/// Returns the job without attenuations and tilt, fixed or random.
pub(crate) fn without_exact_only(job: &str) -> String {
    EXACT_ONLY.iter().fold(job.to_owned(), |job, part| job.replace(part, ""))
}
