//! Studies of several bones of few velocities each: how often intervals hold the truth, and how far estimates are
//! from it, alone and with `[groups] pooled = true`.
//!
//! The velocity of a bone is that of its bulk wave, √(c1111/ρ), so that a thousand identifications take seconds.

use std::convert::Infallible;

use osteon_common::case::Setup;
use osteon_common::conclusions::{BudgetQuantity, Inference, QuantityErrors};
use osteon_common::data::Group;
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{
    Data, JobKind, JobSpecification, MonteCarlo, Objective, Range, Sampling, Search, SearchMethod,
};
use osteon_common::known_quantities::KnownQuantities;
use osteon_common::observables::ObservedColumns;
use osteon_common::outcome::RealizationResult;
use osteon_common::parameters::{Parameter, Point};
use osteon_common::pooling::{GroupEstimate, Pooling};
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::realization::Ensemble;
use osteon_common::special::standard_normal_quantile;
use osteon_common::systematic::Systematic;

use crate::blocks::{FinishedBlock, in_blocks};
use crate::generator::Generator;
use crate::table::MarkdownTable;
use crate::twins::{Twins, bulk_velocity};
use crate::{RowCallback, StudyError};

/// Default number of simulated studies of each row.
pub const STUDIES: u64 = 200;
/// Velocities of each bone.
const VELOCITIES: u64 = 8;
/// The mean bone: the paper's optimum.
const BONE: [f64; 7] = [1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029];
/// Bounds of e_L (Pa), above the one of least c1111 so that a velocity has one e_L, and of the dispersion.
const MODULUS_BOUNDS: [f64; 2] = [12e9, 30e9];
const DISPERSION_BOUNDS: [f64; 2] = [0.005, 0.6];
/// Standard deviations of ln e_L and ln δ between bones that are about as large as the errors of one bone.
const SCATTERS: [f64; 2] = [0.035, 0.28];
/// Number of realizations of the model.
const REALIZATIONS: u64 = 64;
/// Numbers of bones, and their scatter in [`SCATTERS`].
const ROWS: [(usize, f64); 7] =
    [(12, 0.0), (12, 1.0), (12, 2.0), (12, 3.0), (5, 1.0), (3, 1.0), (3, 3.0)];
/// The quantities.
const QUANTITIES: [BudgetQuantity; 3] = [
    BudgetQuantity::BulkVelocity,
    BudgetQuantity::Parameter(Parameter::LongitudinalYoungModulus),
    BudgetQuantity::Parameter(Parameter::Dispersion),
];

/// What was counted of one quantity.
#[derive(Debug, Clone, Copy, Default)]
struct CountedIntervals {
    all: u64,
    /// Intervals of bones alone, and of pooled ones, that hold the truth.
    alone: u64,
    pooled: u64,
    /// Intervals of differences from the first bone.
    pairs: u64,
    differences: u64,
    /// Sums of squares of the errors of the logarithm.
    alone_square: f64,
    pooled_square: f64,
}

impl CountedIntervals {
    fn add(&mut self, other: &Self) {
        self.all += other.all;
        self.alone += other.alone;
        self.pooled += other.pooled;
        self.pairs += other.pairs;
        self.differences += other.differences;
        self.alone_square += other.alone_square;
        self.pooled_square += other.pooled_square;
    }

    fn cells(&self) -> [String; 5] {
        let share = |part: u64, all: u64| format!("{:.1}", 100.0 * part as f64 / all.max(1) as f64);
        let error = (self.alone_square / self.all.max(1) as f64).sqrt();
        let ratio = (self.pooled_square / self.alone_square).sqrt();
        [
            share(self.alone, self.all),
            share(self.pooled, self.all),
            share(self.differences, self.pairs),
            format!("{:.1}", 100.0 * error),
            format!("{ratio:.2}"),
        ]
    }
}

/// Counts the 95 % intervals of √(c1111/ρ), e_L and the dispersion that hold the truth, by the number of bones and
/// by how far they scatter, and compares the errors of pooled values with those of each bone alone.
///
/// # Errors
/// If a point has no ensemble, or an identification fails.
pub fn table(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[
        "bones",
        "scatter/error",
        "quantity",
        "alone (%)",
        "pooled (%)",
        "differences (%)",
        "r.m.s. error alone (%)",
        "pooled/alone",
    ]);
    for (bones, scatter) in ROWS {
        let mut counted = [CountedIntervals::default(); QUANTITIES.len()];
        let study = |number| count_study(twins.seed, number, bones, scatter).map(Some);
        for block in in_blocks(twins.repetitions, study) {
            let FinishedBlock { found, .. } = block?;
            let pairs = found.iter().flat_map(|found| found.iter().enumerate());
            pairs.for_each(|(place, found)| counted[place].add(found));
        }
        for (quantity, counted) in QUANTITIES.iter().zip(counted) {
            let name = quantity.name().replace('_', " ");
            let named = [bones.to_string(), format!("{scatter:.0}"), name];
            table.push([&named[..], &counted.cells()].concat());
            progress(&table.last_row());
        }
    }
    Ok(table)
}

/// Simulates one study of bones, and identifies them.
fn count_study(
    seed: u64,
    number: u64,
    bones: usize,
    scatter: f64,
) -> Result<[CountedIntervals; QUANTITIES.len()], StudyError> {
    let mut generator = Generator::for_index(seed, number);
    let mut truth = || {
        let mut drawn =
            |scale: f64| libm::exp(scale * scatter * standard_normal_quantile(generator.uniform()));
        let mut values = BONE;
        values[1] *= drawn(SCATTERS[0]);
        values[6] *= drawn(SCATTERS[1]).min(0.5 / BONE[6]);
        Point::of_bone(values)
    };
    let truths: Vec<Point> = (0..bones).map(|_| truth()).collect();
    let group = |(place, truth): (usize, &Point)| {
        let seed = (seed + number) * 1000 + place as u64;
        let drawn = MonteCarlo { realizations: VELOCITIES, seed, ..MonteCarlo::default() };
        let ensemble = Ensemble::drawn(truth, drawn.germs())?;
        Ok(Group {
            name: format!("bone {place}"),
            velocities: speeds(&ensemble, VELOCITIES),
            subjects: None,
            observables: ObservedColumns::default(),
            known: KnownQuantities::default(),
        })
    };
    let groups = truths.iter().enumerate().map(group).collect::<Result<Vec<_>, StudyError>>()?;
    let specification = specification(groups, seed + number);
    let job = osteon_search::identify(&specification, |realizations| {
        let speeds = speeds(&realizations.ensemble, realizations.count);
        let solved = |speed| RealizationResult::solved(speed, 1e-5);
        Ok::<_, Infallible>(speeds.into_iter().map(solved).collect())
    })?;
    let inferences: Vec<Option<Inference>> =
        job.result.groups.into_iter().map(|group| group.conclusions.inference).collect();
    Ok(QUANTITIES.map(|quantity| count_quantity(quantity, &truths, &inferences)))
}

/// Counts the intervals of one quantity.
fn count_quantity(
    quantity: BudgetQuantity,
    truths: &[Point],
    inferences: &[Option<Inference>],
) -> CountedIntervals {
    let known = truths.iter().zip(inferences).filter_map(|(truth, found)| {
        let found = found.as_ref()?;
        let errors = found.errors.iter().find(|errors| errors.quantity == quantity)?;
        let (truth, found) = match quantity {
            BudgetQuantity::BulkVelocity => (bulk_velocity(truth), found.bulk_velocity),
            BudgetQuantity::Parameter(parameter) => {
                let found = found.parameters.iter().find(|(one, _)| *one == parameter)?;
                (truth.get(parameter), found.1)
            }
        };
        Some((truth, found, estimate(errors)))
    });
    let known: Vec<_> = known.collect();
    let estimates = known.iter().map(|(.., estimate)| estimate.clone()).collect();
    let mut counted = CountedIntervals::default();
    let Some(pooling) = Pooling::new(estimates) else { return counted };
    let holds = |[low, high]: [f64; 2], truth: f64| u64::from(low <= truth && truth <= high);
    let first = known.first().map_or(f64::NAN, |(truth, ..)| libm::log(*truth));
    for (place, (truth, found, _)) in known.iter().enumerate() {
        let (logarithm, pooled) = (libm::log(*truth), pooling.group(place));
        counted.all += 1;
        counted.alone += found.known.map_or(0, |known| holds(known.interval, *truth));
        counted.pooled += holds(pooled.interval, logarithm);
        let [alone, pooled] = [libm::log(found.value), pooled.value].map(|value| value - logarithm);
        counted.alone_square += alone * alone;
        counted.pooled_square += pooled * pooled;
        if place > 0 {
            counted.pairs += 1;
            let difference = pooling.difference(place, 0).interval;
            counted.differences += holds(difference, logarithm - first);
        }
    }
    counted
}

fn estimate(errors: &QuantityErrors) -> GroupEstimate {
    let systematic = errors.systematic.iter().map(|(_, moved)| *moved);
    GroupEstimate {
        value: errors.estimate,
        error: errors.data,
        freedom: errors.freedom,
        common: errors.sampling.iter().copied().chain(systematic).collect(),
    }
}

/// Returns the speeds of the bulk wave of the first realizations.
fn speeds(ensemble: &Ensemble, count: u64) -> Vec<f64> {
    let speed = |index| {
        let bone = ensemble.bone(index).ok()?;
        Some((bone.elasticity.rows()[0][0] / bone.density).sqrt())
    };
    (0..count).filter_map(speed).collect()
}

fn specification(groups: Vec<Group>, seed: u64) -> JobSpecification {
    let mut parameters = Range::of_bone(BONE.map(Range::Fixed));
    let free = |[lower, upper]: [f64; 2], start| Range::Free { start, lower, upper };
    parameters[Parameter::LongitudinalYoungModulus as usize] = free(MODULUS_BOUNDS, BONE[1]);
    parameters[Parameter::Dispersion as usize] = free(DISPERSION_BOUNDS, BONE[6]);
    JobSpecification {
        kind: JobKind::Identification,
        setup: Setup::default(),
        data: Some(Data::from_groups(groups)),
        parameters,
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings { pooled: true },
        monte_carlo: MonteCarlo {
            realizations: REALIZATIONS,
            seed,
            sampling: Sampling::Sobol,
            ..MonteCarlo::default()
        },
        objective: Objective::ChiSquare,
        search: Search::by(SearchMethod::Newton),
        posterior: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pooled_bones_are_nearer_to_the_truth_and_their_intervals_hold() {
        let mut counted = [CountedIntervals::default(); QUANTITIES.len()];
        for number in 0..40 {
            let found = count_study(3, number, 12, 1.0).unwrap();
            counted.iter_mut().zip(&found).for_each(|(counted, found)| counted.add(found));
        }
        for (counted, quantity) in counted.iter().zip(QUANTITIES) {
            let share = counted.pooled as f64 / counted.all as f64;
            // The standard deviation of a share of 480 intervals, of which those of a study depend on each other.
            assert!((0.92..=0.98).contains(&share), "{quantity:?} {counted:?}");
            let ratio = (counted.pooled_square / counted.alone_square).sqrt();
            assert!(ratio < 0.8, "{quantity:?} {ratio}");
        }
    }
}
