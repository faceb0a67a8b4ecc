//! Scatter of the moments between seeds, by sampling method, and accuracy of their reported
//! standard errors.

use osteon_common::case::Setup;
use osteon_common::job::{MonteCarlo, Sampling};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::realization::{Ensemble, PointError};
use osteon_common::results::{Estimate, Moments};
use osteon_common::statistics;
use osteon_solver::{Isa, Solver};

use crate::draws::{OPTIMUM, solve_realizations};
use crate::table::{MarkdownTable, two_digits};
use crate::{RowCallback, StudyError};

/// Dispersions.
const DISPERSIONS: [f64; 2] = [0.1029, 0.3];
/// Realizations of each estimate.
const REALIZATIONS: [u64; 3] = [256, 1024, 4096];
/// Sampling methods, with the number of scrambles; the others are compared with the first.
const SAMPLINGS: [(Sampling, u64); 3] =
    [(Sampling::MonteCarlo, 1), (Sampling::Sobol, 1), (Sampling::Sobol, 8)];
/// Default number of seeds.
pub const SEEDS: u64 = 20;

/// The estimates to be repeated, and the instruction set.
#[derive(Debug, Clone, Copy)]
pub struct Repetitions {
    /// Number of repetitions, each with its own seed.
    pub seeds: u64,
    /// The first seed; the others follow it.
    pub first: u64,
    /// Instruction set, which affects only the time.
    pub isa: Isa,
}

/// Result of the repetitions of one estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeedScatter {
    /// Standard deviations of the moments over the seeds: of the mean in m/s, and of the
    /// coefficient of variation.
    pub deviation: Moments,
    /// Root mean square of the reported standard errors.
    pub reported: Moments,
    /// Number of failed realizations, over all seeds.
    pub failed: usize,
}

/// Returns the standard deviations of mean and coefficient of variation over seeds at the paper's
/// optimum, the ratio of their squares to those of plain Monte Carlo, and the ratio of reported
/// standard errors to them, by dispersion, number of realizations, sampling and use of the control
/// variate.
///
/// # Errors
/// If there are no draws at a dispersion.
pub fn table(
    repetitions: &Repetitions,
    progress: RowCallback<'_>,
) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[
        "dispersion",
        "realizations",
        "sampling",
        "scrambles",
        "control variate",
        "failed",
        "mean: deviation (m/s)",
        "gain",
        "reported / deviation",
        "CoV: deviation",
        "gain",
        "reported / deviation",
    ]);
    for (dispersion, realizations) in
        DISPERSIONS.into_iter().flat_map(|dispersion| REALIZATIONS.map(|count| (dispersion, count)))
    {
        let mut point = OPTIMUM;
        point.0[Parameter::Dispersion as usize] = dispersion;
        let mut plain = None;
        for (sampling, scrambles) in SAMPLINGS {
            let both = scatter(&point, realizations, sampling, scrambles, repetitions)?;
            for (control_variate, found) in [false, true].into_iter().zip(both) {
                let plain = *plain.get_or_insert(found);
                let mut row = vec![dispersion.to_string(), realizations.to_string()];
                row.extend([sampling.name().to_owned(), scrambles.to_string()]);
                row.push(if control_variate { "yes" } else { "no" }.to_owned());
                row.push(found.failed.to_string());
                row.extend(cells(&found, &plain));
                table.push(row);
            }
            progress(&table.last_row());
        }
    }
    Ok(table)
}

/// Returns the scatter without and with the control variate, on the same realizations.
///
/// # Errors
/// If there is no ensemble at the point.
pub fn scatter(
    point: &Point,
    realizations: u64,
    sampling: Sampling,
    scrambles: u64,
    repetitions: &Repetitions,
) -> Result<[SeedScatter; 2], PointError> {
    let solver = Solver::with_isa(&Setup::default(), repetitions.isa);
    let mut estimates = [Vec::new(), Vec::new()];
    let mut failed = 0;
    for seed in repetitions.first..repetitions.first + repetitions.seeds {
        let plain = MonteCarlo { realizations, seed, sampling, scrambles, ..MonteCarlo::default() };
        let ensemble = Ensemble::drawn(point, plain.germs())?;
        let solved = solve_realizations(&solver, &ensemble, realizations);
        let outcomes: Vec<_> = solved.into_iter().map(|one| one.outcome).collect();
        failed += outcomes.iter().filter(|outcome| outcome.is_err()).count();
        for (estimates, control_variate) in estimates.iter_mut().zip([false, true]) {
            let monte_carlo = MonteCarlo { control_variate, ..plain };
            estimates.extend(statistics::estimate(&monte_carlo, point, &outcomes));
        }
    }
    Ok(estimates.map(|estimates| SeedScatter::new(&estimates, failed)))
}

impl SeedScatter {
    fn new(estimates: &[Estimate], failed: usize) -> Self {
        let spread_of = |moment: fn(&Moments) -> f64| {
            let values = || estimates.iter().map(|estimate| moment(&estimate.moments));
            let mean = values().sum::<f64>() / estimates.len() as f64;
            let squares: f64 = values().map(|value| (value - mean) * (value - mean)).sum();
            let errors = estimates.iter().map(|estimate| moment(&estimate.standard_error));
            let error_squares: f64 = errors.map(|error| error * error).sum();
            let deviation = (squares / (estimates.len() as f64 - 1.0)).sqrt();
            (deviation, (error_squares / estimates.len() as f64).sqrt())
        };
        let mean = spread_of(|moments| moments.mean);
        let variation = spread_of(|moments| moments.coefficient_of_variation);
        let moments = |mean, coefficient_of_variation| Moments { mean, coefficient_of_variation };
        Self {
            deviation: moments(mean.0, variation.0),
            reported: moments(mean.1, variation.1),
            failed,
        }
    }
}

fn cells(found: &SeedScatter, plain: &SeedScatter) -> Vec<String> {
    let spread_of = |moment: fn(&Moments) -> f64| {
        let deviation = moment(&found.deviation);
        let ratio = moment(&plain.deviation) / deviation;
        [deviation, ratio * ratio, moment(&found.reported) / deviation]
    };
    let mean = spread_of(|moments| moments.mean);
    let variation = spread_of(|moments| moments.coefficient_of_variation);
    mean.into_iter().chain(variation).map(|number| two_digits(Some(number))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const REPETITIONS: fn() -> Repetitions =
        || Repetitions { seeds: 20, first: 1, isa: Isa::fastest() };

    fn gain(found: &SeedScatter, plain: &SeedScatter) -> [f64; 2] {
        let square = |ratio: f64| ratio * ratio;
        [
            square(plain.deviation.mean / found.deviation.mean),
            square(
                plain.deviation.coefficient_of_variation / found.deviation.coefficient_of_variation,
            ),
        ]
    }

    fn check_errors(found: &SeedScatter, what: &str) {
        let ratios = [
            found.reported.mean / found.deviation.mean,
            found.reported.coefficient_of_variation / found.deviation.coefficient_of_variation,
        ];
        for ratio in ratios {
            assert!((1.0 / 1.5..1.5).contains(&ratio), "{what}: {ratios:?}, seeds 1 to 20");
        }
    }

    /// Checks the statement of the documentation about 1024 points.
    #[test]
    fn sobol_points_are_worth_a_thousand_times_their_number() {
        let spread_of = |sampling| scatter(&OPTIMUM, 1024, sampling, 1, &REPETITIONS()).unwrap();
        let [plain, controlled] = spread_of(Sampling::MonteCarlo);
        let [sobol, both] = spread_of(Sampling::Sobol);
        let check = |found: &SeedScatter, least: [f64; 2], what: &str| {
            let gain = gain(found, &plain);
            assert!(gain[0] > least[0] && gain[1] > least[1], "{what}: {gain:?}");
            check_errors(found, what);
        };
        check(&plain, [0.99, 0.99], "plain");
        check(&controlled, [300.0, 100.0], "control variate");
        check(&sobol, [1000.0, 100.0], "sobol");
        check(&both, [10_000.0, 1000.0], "sobol and control variate");
    }

    #[test]
    fn the_scatter_of_estimates() {
        let estimate = |mean, error| Estimate {
            moments: Moments { mean, coefficient_of_variation: 0.1 * mean },
            standard_error: Moments { mean: error, coefficient_of_variation: 1.0 },
            controlled: false,
        };
        let found = SeedScatter::new(&[estimate(1.0, 3.0), estimate(3.0, 4.0)], 5);
        assert!((found.deviation.mean - 2.0_f64.sqrt()).abs() < 1e-15);
        assert!((found.deviation.coefficient_of_variation - 0.02_f64.sqrt()).abs() < 1e-15);
        assert!((found.reported.mean - 12.5_f64.sqrt()).abs() < 1e-15);
        assert_eq!((found.reported.coefficient_of_variation, found.failed), (1.0, 5));
        assert_eq!(cells(&found, &found)[..3], ["1.4", "1.0", "2.5"]);
    }
}
