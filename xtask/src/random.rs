//! Runs the property tests on new random cases for any length of time.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context as _, Result, bail};

use crate::process::{cargo, cargo_command};
use crate::terminal::say;

const USAGE: &str = "usage: cargo xtask test random [--minutes M] [--seed S]";
/// Default duration, minutes.
const MINUTES: u64 = 10;
/// Selects all property tests, by the name that `properties!` of `osteon-fuzz` gives them.
const TESTS: [&str; 5] = ["test", "--workspace", "--tests", "--", "on_random_cases"];
/// The environment variable that sets their seed.
const SEED_VARIABLE: &str = "OSTEON_TEST_SEED";

/// What the words of the command ask for.
#[derive(Debug, PartialEq)]
struct RandomTestArguments {
    duration: Duration,
    /// Seed of the first round; later rounds count up from it.
    seed: Option<u64>,
}

/// Runs rounds, each with its own seed, until the time in `words` has passed or one fails.
pub(crate) fn rounds(words: &[String]) -> Result<()> {
    let RandomTestArguments { duration, seed } = request(words)?;
    let mut seed = seed.unwrap_or_else(fresh_seed);
    // Building is not included in the time.
    cargo(&mut cargo_command(&["test", "--workspace", "--tests", "--no-run"]))?;
    let begin = Instant::now();
    let mut round = 1;
    loop {
        say(&format!("round {round}: seed {seed}"))?;
        cargo(cargo_command(&TESTS).env(SEED_VARIABLE, seed.to_string()))
            .with_context(|| format!("round {round} failed; to repeat it: {}", command(seed)))?;
        if begin.elapsed() >= duration {
            return say(&format!("{round} rounds passed"));
        }
        round += 1;
        seed = seed.wrapping_add(1);
    }
}

fn request(words: &[String]) -> Result<RandomTestArguments> {
    let (mut minutes, mut seed) = (MINUTES, None);
    let mut words = words.iter();
    while let Some(word) = words.next() {
        let number: u64 = words.next().context(USAGE)?.parse().context(USAGE)?;
        match word.as_str() {
            "--minutes" => minutes = number,
            "--seed" => seed = Some(number),
            _ => bail!(USAGE),
        }
    }
    Ok(RandomTestArguments { duration: Duration::from_secs(minutes.saturating_mul(60)), seed })
}

/// Returns a new seed, made from the clock.
fn fresh_seed() -> u64 {
    let time = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    // Rounds count up by one, while the seeds of two runs are seconds apart.
    time.as_secs() << 20
}

/// Returns the command that repeats a round.
fn command(seed: u64) -> String {
    format!("{SEED_VARIABLE}={seed} cargo {}", TESTS.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request_of(words: &str) -> Result<RandomTestArguments> {
        request(&words.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn minutes_and_seed_are_taken() {
        let request = |minutes: u64, seed| RandomTestArguments {
            duration: Duration::from_secs(60 * minutes),
            seed,
        };
        assert_eq!(request_of("").unwrap(), request(MINUTES, None));
        assert_eq!(request_of("--seed 7 --minutes 3").unwrap(), request(3, Some(7)));
        for wrong in ["--seed", "--seed x", "--hours 1", "5"] {
            assert!(format!("{:#}", request_of(wrong).unwrap_err()).contains("usage"), "{wrong}");
        }
    }

    #[test]
    fn a_round_is_repeated_by_its_seed() {
        let expected = "OSTEON_TEST_SEED=7 cargo test --workspace --tests -- on_random_cases";
        assert_eq!(command(7), expected);
    }
}
