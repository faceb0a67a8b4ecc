//! Checks of this machine and of the program.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use osteon_common::limits::CONNECTIONS_MAX;
use osteon_solver::Isa;
use rustix::process::{Resource, getrlimit};

use super::Diagnosis;
use crate::output::utc;
use crate::program;

/// Open files of a coordinator that are not connections, with a margin.
const OTHER_FILES: u64 = 64;
/// Open files of a run on this machine.
const FILES_MIN: u64 = 128;
/// A time that has passed: 2025-01-01, s since 1970. Clocks that were never set begin in 1970 or with
/// the machine's firmware.
const PASSED_S: u64 = 1_735_689_600;

/// Version and origin of the program.
pub(super) fn program() -> Diagnosis {
    Diagnosis::good("version", program::version_line())
}

/// The cores that this process may use.
pub(super) fn cores() -> Diagnosis {
    const CHECK: &str = "cores";
    match std::thread::available_parallelism() {
        Ok(cores) if cores.get() > 1 => Diagnosis::good(CHECK, format!("{cores} cores")),
        Ok(_) => Diagnosis::warning(
            CHECK,
            "1 core",
            "give this process more processors: realizations are computed on all at the same time",
        ),
        Err(error) => Diagnosis::warning(
            CHECK,
            format!("their number is not known: {error}"),
            "set --threads in every command",
        ),
    }
}

/// The instruction set on which realizations are computed.
pub(super) fn instruction_set(used: Isa) -> Diagnosis {
    const CHECK: &str = "instructions";
    let (found, fastest) = (format!("uses {}", used.name()), Isa::fastest());
    let available: Vec<_> = Isa::available().iter().map(|isa| isa.name()).collect();
    if used.name() != fastest.name() {
        return Diagnosis::warning(
            CHECK,
            format!("{found}, which is not the fastest of {}", available.join(", ")),
            format!("unset {}", Isa::VARIABLE),
        );
    }
    if available.len() == 1 {
        return Diagnosis::warning(
            CHECK,
            format!("{found}: no vector instructions that the solver knows"),
            "results are the same, only slower",
        );
    }
    Diagnosis::good(CHECK, format!("{found}, the fastest of {}", available.join(", ")))
}

/// The limit of open files, which is that of connections of a coordinator.
pub(super) fn open_files() -> Diagnosis {
    const CHECK: &str = "open files";
    let limit = getrlimit(Resource::Nofile);
    let wanted = CONNECTIONS_MAX as u64 + OTHER_FILES;
    // A coordinator raises its limit to this.
    let Some(most) = limit.maximum else { return Diagnosis::good(CHECK, "no limit") };
    let found = format!("at most {most}");
    if most < FILES_MIN {
        return Diagnosis::problem(
            CHECK,
            found,
            format!("raise the limit (`ulimit -Hn {wanted}`)"),
        );
    }
    if most < wanted {
        return Diagnosis::warning(
            CHECK,
            format!(
                "{found}: a coordinator here serves about {} workers",
                (most - OTHER_FILES) / 3
            ),
            format!("raise the limit to {wanted} (`ulimit -Hn`, LimitNOFILE= of a systemd unit)"),
        );
    }
    Diagnosis::good(CHECK, found)
}

/// The clock, by which certificates are judged.
pub(super) fn clock(now: SystemTime) -> Diagnosis {
    const CHECK: &str = "clock";
    let since = now.duration_since(UNIX_EPOCH).unwrap_or_default();
    let found = utc(since).unwrap_or_else(|| "beyond the calendar".to_owned());
    if now < UNIX_EPOCH + Duration::from_secs(PASSED_S) {
        let advice =
            "set the clock, by NTP for instance: TLS refuses certificates that are not yet valid";
        return Diagnosis::problem(CHECK, format!("{found}, which has passed long ago"), advice);
    }
    Diagnosis::good(CHECK, found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Fitness;

    #[test]
    fn a_clock_that_was_never_set_is_a_problem() {
        assert_eq!(clock(UNIX_EPOCH).verdict, Fitness::Problem);
        assert_eq!(clock(SystemTime::now()).verdict, Fitness::Good);
    }

    #[test]
    fn a_slower_instruction_set_is_a_warning() {
        assert_eq!(instruction_set(Isa::fastest()).advice.is_some(), Isa::available().len() == 1);
        for isa in Isa::available().into_iter().filter(|isa| isa.name() != Isa::fastest().name()) {
            assert_eq!(instruction_set(isa).verdict, Fitness::Warning);
        }
    }
}
