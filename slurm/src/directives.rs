//! The `#SBATCH` lines of a script.

use std::time::Duration;

use super::SlurmError;
use super::shell::without_controls;

/// Options on which the scripts rely, and what to do instead.
const OWN_OPTIONS: [(&str, &str); 13] = [
    ("--array", "`osteon slurm array --count N` makes arrays"),
    ("-a", "`osteon slurm array --count N` makes arrays"),
    (
        "--no-kill",
        "without the node of its coordinator the job would do nothing until its time limit",
    ),
    ("-k", "without the node of its coordinator the job would do nothing until its time limit"),
    ("--signal", "--stop-before sets when a job stops before its time limit"),
    ("--no-requeue", "--max-requeues 0 does without"),
    ("--nodes", "give the number before --"),
    ("-N", "give the number before --"),
    ("--ntasks", "one process runs on each node"),
    ("-n", "one process runs on each node"),
    ("--ntasks-per-node", "one process runs on each node"),
    ("--time", "give --time-limit before --"),
    ("-t", "give --time-limit before --"),
];

/// Returns the `#SBATCH` lines: those of the program, and then `further` options, which sbatch
/// prefers to earlier ones.
///
/// # Errors
/// If the further options are none, or contradict the script.
pub(crate) fn lines(own: &[String], further: &[String]) -> Result<String, SlurmError> {
    let mut options: Vec<String> = own.iter().map(|option| quoted(option)).collect();
    for word in further {
        without_controls(word)?;
        if word.starts_with('-') {
            refuse_own(word)?;
            options.push(quoted(word));
        } else {
            // The value of the option before.
            let previous = options.last_mut().filter(|_| further.first() != Some(word));
            let previous =
                previous.ok_or_else(|| SlurmError::NotAnOption { word: word.clone() })?;
            previous.push(' ');
            previous.push_str(&quoted(word));
        }
    }
    Ok(options.iter().map(|option| format!("#SBATCH {option}\n")).collect())
}

/// Returns a duration as sbatch reads it, rounded up to whole seconds.
pub(crate) fn time(limit: Duration) -> String {
    let seconds = limit.as_secs_f64().ceil() as u64;
    let (days, hours) = (seconds / 86_400, seconds / 3600 % 24);
    format!("{days}-{hours:02}:{:02}:{:02}", seconds / 60 % 60, seconds % 60)
}

fn refuse_own(word: &str) -> Result<(), SlurmError> {
    let name = word.split('=').next().unwrap_or(word);
    let given = |option: &str| match option.starts_with("--") {
        true => name == option,
        // A short option may be followed by its value at once.
        false => !name.starts_with("--") && name.starts_with(option),
    };
    match OWN_OPTIONS.iter().find(|(option, _)| given(option)) {
        None => Ok(()),
        Some((option, instead)) => {
            Err(SlurmError::OwnOption { option: (*option).to_owned(), instead })
        }
    }
}

/// Returns a word as sbatch reads it in a script.
fn quoted(word: &str) -> String {
    let special = |c: char| c.is_whitespace() || "#'\"\\".contains(c);
    match word.is_empty() || word.chars().any(special) {
        true => format!("\"{}\"", word.replace('\\', r"\\").replace('"', r#"\""#)),
        false => word.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(further: &[&str]) -> Result<String, String> {
        let further: Vec<_> = further.iter().map(|&word| word.to_owned()).collect();
        lines(&["--nodes=2".to_owned(), "--comment=a b".to_owned()], &further)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn each_option_is_a_line() {
        assert_eq!(text(&[]).unwrap(), "#SBATCH --nodes=2\n#SBATCH \"--comment=a b\"\n");
        let further = text(&["--account=a", "-p", "fast", "--comment=two words", "--x", "#y"]);
        let expected = "#SBATCH --nodes=2\n#SBATCH \"--comment=a b\"\n#SBATCH --account=a\n#SBATCH -p fast\n\
                        #SBATCH \"--comment=two words\"\n#SBATCH --x \"#y\"\n";
        assert_eq!(further.unwrap(), expected);
    }

    #[test]
    fn what_would_break_the_script_is_refused() {
        for (further, expected) in [
            (&["account"][..], "`account` after -- is not an option of sbatch"),
            (&["--x", "--array=1-3"], "--array cannot be given after --"),
            (&["-a1-3"], "-a cannot be given after --"),
            (&["--signal", "B:TERM"], "--stop-before"),
            (&["-N", "3"], "-N cannot be given"),
            (&["--time=5"], "--time-limit before --"),
            (&["--comment=a\nb"], "line break"),
        ] {
            let told = text(further).unwrap_err();
            assert!(told.contains(expected), "{further:?}: {told}");
        }
        // Other options may begin in the same way.
        text(&["--nodelist=n1", "--time-min=5", "--account=a", "--nice"]).unwrap();
    }

    #[test]
    fn times_are_days_and_hours() {
        for (seconds, expected) in [
            (0.0, "0-00:00:00"),
            (59.2, "0-00:01:00"),
            (5400.0, "0-01:30:00"),
            (180_061.0, "2-02:01:01"),
        ] {
            assert_eq!(time(Duration::from_secs_f64(seconds)), expected);
        }
    }
}
