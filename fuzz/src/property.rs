//! Property tests on random cases that are the same in every run and on every machine, unless
//! another seed is requested.

use std::any::Any;
use std::env;
use std::fmt::Debug;
use std::path::Path;

use proptest::strategy::Strategy;
use proptest::test_runner::{
    Config, FailurePersistence, FileFailurePersistence, PersistedSeed, RngAlgorithm, RngSeed,
    TestCaseResult, TestRunner,
};

/// Default number of cases of a property.
pub const CASES: u32 = 256;
/// Default seed.
const SEED: u64 = 1;
/// The environment variable that sets another seed: a whole number.
const SEED_VARIABLE: &str = "OSTEON_TEST_SEED";
/// Extension of the files, beside the sources, with cases that are tried first.
const KEPT: &str = "regressions";

/// Declares tests, each of a property that must hold for all values of its strategies.
///
/// ```text
/// properties! {
///     #![cases(1000)]
///
///     /// In any order.
///     fn sums_have_no_order(a in 0..100, b in 0..100) {
///         prop_assert_eq!(a + b, b + a);
///     }
/// }
/// ```
///
/// It replaces `proptest!`, where environment variables override the settings. Without `cases`
/// there are [`CASES`]. The test is called `sums_have_no_order::on_random_cases`; by the last part
/// of this name `cargo xtask test random` finds all of them.
#[macro_export]
macro_rules! properties {
    (@run $cases:expr; $(
        $(#[$meta:meta])*
        fn $name:ident($($pattern:pat in $strategy:expr),+ $(,)?) $body:block
    )*) => {$(
        $(#[$meta])*
        mod $name {
            use super::*;

            #[test]
            fn on_random_cases() {
                $crate::check(&$crate::here!(), $cases, ($($strategy,)+), |($($pattern,)+)| {
                    $body
                    Ok(())
                });
            }
        }
    )*};
    (#![cases($cases:expr)] $($properties:tt)*) => {
        $crate::properties!(@run $cases; $($properties)*);
    };
    ($($properties:tt)*) => {
        $crate::properties!(@run $crate::CASES; $($properties)*);
    };
}

/// Returns the [`Place`] of the macro call.
#[macro_export]
macro_rules! here {
    () => {
        $crate::Place { package: env!("CARGO_PKG_NAME"), module: module_path!(), source: file!() }
    };
}

/// Location of a test.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Package of the test.
    pub package: &'static str,
    /// Module of the test, beginning with the crate.
    pub module: &'static str,
    /// Source file of the test.
    pub source: &'static str,
}

/// Checks a property: first on the cases in the `.regressions` file beside the source, if there is
/// one, then on the given number of new ones.
///
/// # Panics
/// If one fails, with the command that repeats it. Nothing is written: the line to be added to that
/// file is printed. Also panics if `OSTEON_TEST_SEED` is not a whole number.
pub fn check<S: Strategy>(
    place: &Place,
    cases: u32,
    strategy: S,
    property: impl Fn(S::Value) -> TestCaseResult,
) {
    check_with(seed(), place, cases, strategy, property);
}

#[expect(clippy::panic, reason = "a test that fails")]
fn check_with<S: Strategy>(
    seed: u64,
    place: &Place,
    cases: u32,
    strategy: S,
    property: impl Fn(S::Value) -> TestCaseResult,
) {
    let mut runner = TestRunner::new(config(seed, place, cases));
    if let Err(error) = runner.run(&strategy, property) {
        let Place { package, module, .. } = place;
        let test = module.split_once("::").map_or("", |(_, test)| test);
        panic!(
            "{error}\nTo repeat this: {SEED_VARIABLE}={seed} cargo test --package {package} {test}"
        );
    }
}

#[expect(clippy::panic, reason = "a test that cannot go on should say why")]
fn seed() -> u64 {
    match env::var(SEED_VARIABLE) {
        Ok(text) => text.parse().unwrap_or_else(|_| {
            panic!("{SEED_VARIABLE} is {text:?}; it must be a whole number from 0 to 2^64 - 1")
        }),
        Err(_) => SEED,
    }
}

/// Sets every option on which cases depend, because the defaults would come from the environment.
fn config(seed: u64, place: &Place, cases: u32) -> Config {
    Config {
        cases,
        max_local_rejects: 65_536,
        max_global_rejects: 1024,
        max_flat_map_regens: 1_000_000,
        max_shrink_time: 0,
        max_shrink_iters: u32::MAX,
        max_default_size_range: 100,
        rng_algorithm: RngAlgorithm::ChaCha,
        rng_seed: RngSeed::Fixed(seed),
        failure_persistence: Some(Box::new(Kept)),
        source_file: Some(place.source),
        ..Config::default()
    }
}

/// Reads the cases stored beside a source, and writes none: a run must not change the next one.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Kept;

impl FailurePersistence for Kept {
    fn load_persisted_failures2(&self, source: Option<&'static str>) -> Vec<PersistedSeed> {
        FileFailurePersistence::WithSource(KEPT).load_persisted_failures2(source)
    }

    fn save_persisted_failure2(
        &mut self,
        source: Option<&'static str>,
        seed: PersistedSeed,
        shrunken: &dyn Debug,
    ) {
        let file = Path::new(source.unwrap_or_default()).with_extension(KEPT);
        let line = format!("{seed} # shrinks to {shrunken:?}").replace(['\n', '\r'], " ");
        eprintln!(
            "To try this case before all others, add this line to {}:\n{line}",
            file.display()
        );
    }

    fn box_clone(&self) -> Box<dyn FailurePersistence> {
        Box::new(*self)
    }

    fn eq(&self, other: &dyn FailurePersistence) -> bool {
        other.as_any().is::<Self>()
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::process::Command;

    use proptest::prelude::*;

    use super::*;

    fn cases_of(seed: u64, cases: u32) -> Vec<u64> {
        let made = RefCell::new(Vec::new());
        check_with(seed, &here!(), cases, any::<u64>(), |case| {
            made.borrow_mut().push(case);
            Ok(())
        });
        made.into_inner()
    }

    #[test]
    fn a_seed_has_its_cases() {
        let cases = cases_of(1, 300);
        assert_eq!(cases.len(), 300);
        assert_eq!(cases[..2], [11_133_506_992_611_388_537, 1_049_773_478_275_322_121]);
        assert_eq!(cases, cases_of(1, 300));
        assert_ne!(cases, cases_of(2, 300));
    }

    /// Runs the test above in a process with the environment variables that proptest reads.
    #[test]
    fn the_environment_does_not_change_them() {
        let test = "property::tests::a_seed_has_its_cases";
        let output = Command::new(env::current_exe().unwrap())
            .args(["--exact", test])
            .env("PROPTEST_CASES", "3")
            .env("PROPTEST_RNG_SEED", "7")
            .env("PROPTEST_RNG_ALGORITHM", "xs")
            .env("PROPTEST_MAX_GLOBAL_REJECTS", "1")
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && text.contains("1 passed"), "{text}");
    }

    #[test]
    fn a_failure_says_how_to_repeat_it_and_writes_nothing() {
        let below = |case| {
            prop_assert!(case < 1000, "{case} is large");
            Ok(())
        };
        let checked = || check_with(5, &here!(), CASES, 0..1_000_000_u32, below);
        let panic = catch_unwind(AssertUnwindSafe(checked)).unwrap_err();
        let text = panic.downcast_ref::<String>().unwrap();
        assert!(text.contains("minimal failing input: 1000"), "{text}");
        let command = "OSTEON_TEST_SEED=5 cargo test --package osteon-fuzz property::tests";
        assert!(text.contains(command), "{text}");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/property.rs");
        assert!(source.is_file() && !source.with_extension(KEPT).exists());
    }

    properties! {
        #![cases(10)]

        fn patterns_and_strategies_are_those_of_proptest(mut a in 0..9_u8, (b, c) in (0..9_u8, Just(1))) {
            prop_assume!(a != b);
            a += c;
            prop_assert!(a >= 1 && b < 9);
        }
    }
}
