//! Results of a coordinator of another version than this program.

use anyhow::bail;
use osteon_common::job::JobSpecification;
use osteon_common::version::Program;

/// Checks that the job that the program `there` has computed is the one that was submitted by the program `here`.
/// Returns a note for the user if its numbers may differ.
///
/// # Errors
/// When it has computed another job. A coordinator of an earlier version drops the fields of a message that
/// it does not know.
pub fn check(
    submitted: &JobSpecification,
    computed: &JobSpecification,
    (here, there): (&Program, &Program),
) -> anyhow::Result<Option<String>> {
    if computed != submitted {
        bail!(
            "the coordinator ({}) has computed another job than this program ({}) has submitted: it does \
             not know all of its keys; use the same version for both",
            describe_program(there),
            describe_program(here)
        );
    }
    Ok((here.numerics != there.numerics).then(|| {
        format!(
            "computed by {}; this program is {}, whose velocities may differ slightly",
            describe_program(there),
            describe_program(here)
        )
    }))
}

fn describe_program(program: &Program) -> String {
    format!("osteon {}, numerics {}", program.version, program.numerics)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use osteon_common::job::JobKind;
    use osteon_files::job_file;

    use super::*;

    fn here() -> Program {
        Program::current(None)
    }

    fn example() -> JobSpecification {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/quick.toml");
        job_file::read(&path, JobKind::Propagation).unwrap()
    }

    #[test]
    fn a_job_of_which_a_part_was_dropped_is_an_error() {
        let submitted = example();
        assert_eq!(check(&submitted, &submitted, (&here(), &here())).unwrap(), None);
        let mut computed = submitted.clone();
        computed.monte_carlo.seed += 1;
        let there = Program { version: "0.0.9".to_owned(), ..Program::current(None) };
        let error = check(&submitted, &computed, (&here(), &there)).unwrap_err().to_string();
        assert!(error.contains("osteon 0.0.9, numerics"), "{error}");
        assert!(error.contains("same version"), "{error}");
    }

    #[test]
    fn other_numerics_are_noted() {
        let there = Program { numerics: here().numerics + 1, ..here() };
        let note =
            check(&example(), &example(), (&Program::current(None), &there)).unwrap().unwrap();
        assert!(note.contains(&format!("numerics {}; this", there.numerics)), "{note}");
    }
}
