//! Resources that this process uses. What the operating system does not tell is left out.

use std::fs;
use std::time::{SystemTime, UNIX_EPOCH};

use rustix::process::{Resource, getrlimit};
use rustix::time::{ClockId, clock_gettime};

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct ProcessUsage {
    /// Processor time so far, s.
    pub(crate) cpu_s: f64,
    /// Memory in use.
    pub(crate) resident_bytes: Option<u64>,
    pub(crate) open_files: Option<u64>,
    /// Limit of open files.
    pub(crate) open_files_max: Option<u64>,
}

impl ProcessUsage {
    /// Reads the present usage.
    pub(crate) fn read() -> Self {
        let cpu = clock_gettime(ClockId::ProcessCPUTime);
        Self {
            cpu_s: cpu.tv_sec as f64 + cpu.tv_nsec as f64 * 1e-9,
            resident_bytes: resident_bytes(),
            open_files: fs::read_dir("/proc/self/fd").ok().map(|entries| entries.count() as u64),
            open_files_max: getrlimit(Resource::Nofile).current,
        }
    }
}

/// Returns the present time since the Unix epoch, s.
pub(crate) fn unix_time_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

/// Returns the second number of `/proc/self/statm`, which counts pages, in bytes.
fn resident_bytes() -> Option<u64> {
    let pages: u64 =
        fs::read_to_string("/proc/self/statm").ok()?.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages * rustix::param::page_size() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn linux_tells_everything() {
        let usage = ProcessUsage::read();
        assert!(usage.cpu_s > 0.0 && usage.cpu_s < 86_400.0, "{usage:?}");
        let bytes = usage.resident_bytes.unwrap();
        assert!((1 << 20..1 << 40).contains(&bytes), "{usage:?}");
        assert!(usage.open_files.unwrap() >= 3, "{usage:?}");
    }
}
