//! Twin experiments: whether an identification recovers the parameters that made its data, and how
//! often its intervals contain them.

use std::convert::Infallible;

use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::inference::{DerivedQuantity, Inference, Uncertainty};
use osteon_common::job::{
    Data, JobKind, JobSpecification, MonteCarlo, Objective, Range, Sampling, Search, SearchMethod,
};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::random_quantities::{RandomDistribution, RandomQuantities, Scatter};
use osteon_common::realization::PointError;
use osteon_common::systematic::Systematic;
use osteon_search::IdentifyError;
use osteon_solver::Isa;

use crate::draws::OPTIMUM;
use crate::generator::Generator;
use crate::identify::{RealizationCache, Surroundings, identify};
use crate::models::{BOUNDS, mean_model};
use crate::table::{MarkdownTable, two_digits};
use crate::{RowCallback, StudyError};

/// Number of repetitions, seed and instruction set.
#[derive(Debug, Clone, Copy)]
pub struct Twins {
    /// Number of parameter sets or data sets.
    pub repetitions: u64,
    /// Seed of the parameter sets, the data and the germs.
    pub seed: u64,
    /// Instruction set, which affects only the time.
    pub isa: Isa,
}

/// Default number of parameter sets of [`table`].
pub const SETS: u64 = 28;
/// Default number of data sets of [`coverage`] and [`populations`].
pub const REPETITIONS: u64 = 200;
/// Number of velocities of the data of each parameter set, as many as the paper has.
const VELOCITIES: u64 = 2747;
/// Number of velocities of each data set in [`coverage`] and [`populations`].
const COUNTED: u64 = 100;
/// Maximum fraction of failed realizations of the data.
const FAILED_MAX: f64 = 0.01;
/// Number of realizations of the model.
const REALIZATIONS: u64 = 256;
/// The parameters searched together with the dispersion, one after another.
const SEARCHED: [Parameter; 7] = [
    Parameter::LongitudinalYoungModulus,
    Parameter::Density,
    Parameter::LongitudinalPoissonRatio,
    Parameter::TransverseYoungModulus,
    Parameter::TransversePoissonRatio,
    Parameter::BoneThickness,
    Parameter::BoneQualityFactor,
];
/// Truths of the bone's thickness, m, and bounds of its search: in thicker plates the velocity hardly
/// depends on it.
const THICKNESSES: [(f64, f64); 2] = [(0.8e-3, 1.4e-3), (0.6e-3, 1.6e-3)];
/// Truths of the quality factor, and bounds of its search.
const QUALITY_FACTORS: [(f64, f64); 2] = [(8.0, 20.0), (4.0, 40.0)];

/// Identifies parameters from the velocities of known parameter sets, with the dispersion and one
/// of seven other parameters free and the rest fixed. Returns the values found, and their distance
/// from the truth in reported standard errors.
///
/// The sets are uniform within the bounds of the paper's example, the dispersion in 0.05 to 0.2;
/// sets for which more than one realization in a hundred fails are drawn again.
///
/// # Errors
/// If a point has no ensemble.
pub fn table(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[
        "set",
        "searched",
        "true",
        "found",
        "error/s.e.",
        "true δ",
        "found δ",
        "error/s.e.",
    ]);
    let mut candidates = 0..;
    for (set, &searched) in (0..twins.repetitions).zip(SEARCHED.iter().cycle()) {
        let (truth, data) = draw_set(twins, searched, &mut candidates)?;
        let specification = specification(&truth, searched, data, twins.seed);
        let found = identify_data(&specification, &mut RealizationCache::new(), twins.isa)?;
        let mut row = vec![(set + 1).to_string(), searched.name().replace('_', " ")];
        for parameter in [searched, Parameter::Dispersion] {
            let quantity = found.as_ref().and_then(|found| quantity_of(found, parameter));
            let truth = truth.get(parameter);
            row.push(format!("{truth:.5e}"));
            row.push(quantity.map_or("–".to_owned(), |found| format!("{:.5e}", found.value)));
            row.push(two_digits(quantity.and_then(|found| errors(&found, truth))));
        }
        table.push(row);
        progress(&table.last_row());
    }
    Ok(table)
}

/// Counts the 95 % intervals of √(c1111/ρ) and of the dispersion that contain the truth, over data
/// sets of a hundred velocities drawn at the paper's optimum, with e_L and the dispersion free.
///
/// # Errors
/// If a point has no ensemble.
pub fn coverage(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let usual = Surroundings::default();
    let counts = Counts::count_over_data_sets(twins, &usual, &usual, progress)?;
    let mut table = MarkdownTable::new(&COUNTED_COLUMNS);
    counts.rows().into_iter().for_each(|row| table.push(row));
    Ok(table)
}

/// As [`coverage`], but for bones of a population: thicknesses of 4 ± 0.5 mm and quality factors of 15 ± 2, a
/// coupling of 1500 ± 15 m/s, and a probe's tilt of 0 ± 0.5°. The model knows these laws, or takes the
/// means for all bones.
///
/// # Errors
/// If a point has no ensemble.
pub fn populations(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let columns: Vec<&str> = [&["the model's laws"], &COUNTED_COLUMNS[..]].concat();
    let mut table = MarkdownTable::new(&columns);
    let population = population();
    let means = Surroundings { random: RandomQuantities::default(), ..population.clone() };
    for (model, name) in [(&population, "those of the data"), (&means, "none")] {
        let counts = Counts::count_over_data_sets(twins, &population, model, progress)?;
        for row in counts.rows() {
            table.push([vec![name.to_owned()], row].concat());
        }
    }
    Ok(table)
}

/// The setup and the laws of the bones of [`populations`].
fn population() -> Surroundings {
    let scatter = |standard_deviation, distribution| Scatter {
        standard_deviation: Some(standard_deviation),
        distribution,
    };
    let mut setup = Setup::default();
    setup.layers.bone_attenuation.quality_factor = Some(15.0);
    let random = RandomQuantities {
        bone_thickness: scatter(0.5e-3, RandomDistribution::Normal),
        bone_quality_factor: scatter(2.0, RandomDistribution::LogNormal),
        coupling_sound_speed: scatter(15.0, RandomDistribution::Uniform),
        probe_tilt: scatter(0.5_f64.to_radians(), RandomDistribution::Normal),
        ..RandomQuantities::default()
    };
    Surroundings { setup, random }
}

/// Columns of a table of [`Counts`].
const COUNTED_COLUMNS: [&str; 4] =
    ["quantity", "data sets", "intervals that hold it (%)", "s.d. of (found - true)/s.e."];

/// How often intervals contain the truth, and the squares of the errors in standard errors: of
/// √(c1111/ρ) and of the dispersion.
struct Counts {
    repetitions: u64,
    held: [u64; 2],
    squares: [f64; 2],
}

impl Counts {
    /// Counts over data sets that are made in the surroundings `data`, and identified by a model in the
    /// surroundings `model`.
    fn count_over_data_sets(
        twins: &Twins,
        data: &Surroundings,
        model: &Surroundings,
        progress: RowCallback<'_>,
    ) -> Result<Self, StudyError> {
        let truths = [bulk_velocity(&OPTIMUM), OPTIMUM.dispersion()];
        let mut counts = Self { repetitions: twins.repetitions, held: [0; 2], squares: [0.0; 2] };
        let mut known = RealizationCache::new();
        for repetition in 0..twins.repetitions {
            let seed = data_seed(twins.seed, repetition);
            let velocities = data.velocities(&OPTIMUM, COUNTED, seed, twins.isa)?;
            let specification = two_parameter_specification(model, velocities, twins.seed);
            let found = identify_data(&specification, &mut known, twins.isa)?;
            let quantities = found.map(|found| [found.bulk_velocity, found.dispersion]);
            for (i, quantity) in quantities.iter().flatten().enumerate() {
                let Some(Uncertainty { interval: [lower, upper], .. }) = quantity.known else {
                    continue;
                };
                counts.held[i] += u64::from((lower..=upper).contains(&truths[i]));
                counts.squares[i] +=
                    errors(quantity, truths[i]).map_or(f64::NAN, |errors| errors * errors);
            }
            progress(&format!("{}: {:?}", repetition + 1, counts.held));
        }
        Ok(counts)
    }

    fn rows(&self) -> Vec<Vec<String>> {
        let all = self.repetitions as f64;
        let row = |(i, name): (usize, &str)| {
            vec![
                name.to_owned(),
                self.repetitions.to_string(),
                format!("{:.1}", 100.0 * self.held[i] as f64 / all),
                format!("{:.2}", (self.squares[i] / all).sqrt()),
            ]
        };
        ["√(c1111/ρ)", "dispersion"].into_iter().enumerate().map(row).collect()
    }
}

/// Returns a specification in which e_L and the dispersion are free, with the same start for all data
/// sets, different from the truth.
fn two_parameter_specification(
    model: &Surroundings,
    velocities: Vec<f64>,
    seed: u64,
) -> JobSpecification {
    let searched = Parameter::LongitudinalYoungModulus;
    let mut specification = specification(&OPTIMUM, searched, velocities, seed);
    specification.parameters[searched as usize] = free(searched, 19e9);
    specification.parameters[Parameter::Dispersion as usize] = free(Parameter::Dispersion, 0.12);
    let Surroundings { setup, random } = model.clone();
    JobSpecification { setup, random, ..specification }
}

/// Returns the next parameter set for which enough velocities can be computed, with these
/// velocities.
fn draw_set(
    twins: &Twins,
    searched: Parameter,
    candidates: &mut impl Iterator<Item = u64>,
) -> Result<(Point, Vec<f64>), PointError> {
    loop {
        let number = candidates.next().unwrap_or_default();
        let mut point = mean_model(twins.seed, number);
        let (lower, upper) = BOUNDS[Parameter::Dispersion as usize];
        let share = (point.dispersion() - lower) / (upper - lower);
        point.0[Parameter::Dispersion as usize] = 0.05 + 0.15 * share;
        if let Some([(lower, upper), _]) = setup_ranges(searched) {
            let share = Generator::for_index(twins.seed, number).between(0.0, 1.0);
            point.0[searched as usize] = lower + share * (upper - lower);
        }
        let around =
            Surroundings { setup: point.setup(&setup_for(searched)), ..Surroundings::default() };
        let seed = data_seed(twins.seed, number);
        let data = around.velocities(&point, VELOCITIES, seed, twins.isa)?;
        if data.len() as f64 >= (1.0 - FAILED_MAX) * VELOCITIES as f64 {
            return Ok((point, data));
        }
    }
}

/// Returns the truths and the bounds of a parameter of the setup.
fn setup_ranges(parameter: Parameter) -> Option<[(f64, f64); 2]> {
    match parameter {
        Parameter::BoneThickness => Some(THICKNESSES),
        Parameter::BoneQualityFactor => Some(QUALITY_FACTORS),
        _ => None,
    }
}

fn bounds(parameter: Parameter) -> (f64, f64) {
    setup_ranges(parameter).map_or_else(|| BOUNDS[parameter as usize], |[_, bounds]| bounds)
}

/// Returns the paper's geometry; with attenuation if its quality factor is searched.
fn setup_for(searched: Parameter) -> Setup {
    let mut setup = Setup::default();
    if searched == Parameter::BoneQualityFactor {
        setup.layers.bone_attenuation.quality_factor = Some(15.0);
    }
    setup
}

/// Returns a seed whose germs differ from the model's.
pub(crate) fn data_seed(seed: u64, number: u64) -> u64 {
    seed + 1 + number
}

/// Returns a specification in which dispersion and `searched` are free, with starts in the middle
/// of their bounds, and the rest is known.
fn specification(
    truth: &Point,
    searched: Parameter,
    velocities: Vec<f64>,
    seed: u64,
) -> JobSpecification {
    let middle = |parameter: Parameter| {
        let (lower, upper) = bounds(parameter);
        free(parameter, 0.5 * (lower + upper))
    };
    let range = |parameter: Parameter| match parameter {
        Parameter::Dispersion => middle(parameter),
        _ if parameter == searched => start_between(parameter, truth, middle(parameter)),
        _ => Range::Fixed(truth.get(parameter)),
    };
    JobSpecification {
        kind: JobKind::Identification,
        setup: setup_for(searched),
        data: Some(Data::from_velocities(velocities)),
        parameters: Parameter::ALL.map(range),
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo {
            realizations: REALIZATIONS,
            seed,
            sampling: Sampling::Sobol,
            control_variate: true,
            ..MonteCarlo::default()
        },
        objective: Objective::default(),
        search: Search::by(SearchMethod::Newton),
        posterior: None,
    }
}

/// Returns the middle of the bounds, or, if that is not admissible together with the fixed
/// parameters, a value slightly below the truth.
fn start_between(parameter: Parameter, truth: &Point, middle: Range) -> Range {
    let mut point = *truth;
    point.0[parameter as usize] = middle.start();
    if point.constants().elasticity().is_ok() {
        return middle;
    }
    free(parameter, 0.98 * truth.get(parameter))
}

fn free(parameter: Parameter, start: f64) -> Range {
    let (lower, upper) = bounds(parameter);
    Range::Free { start: start.clamp(lower, upper), lower, upper }
}

fn identify_data(
    specification: &JobSpecification,
    known: &mut RealizationCache,
    isa: Isa,
) -> Result<Option<Inference>, IdentifyError<Infallible>> {
    Ok(identify(specification, known, isa)?.result.conclusions.inference)
}

/// Returns a parameter that was identified; `None` if it was not searched.
pub(crate) fn quantity_of(found: &Inference, parameter: Parameter) -> Option<DerivedQuantity> {
    match parameter {
        Parameter::Dispersion => Some(found.dispersion),
        _ => found.parameters.iter().find(|(name, _)| *name == parameter).map(|(_, found)| *found),
    }
}

/// Returns the distance from the truth in standard errors.
pub(crate) fn errors(found: &DerivedQuantity, truth: f64) -> Option<f64> {
    found.known.map(|known| (found.value - truth) / known.standard_error)
}

/// Returns √(c1111/ρ) of a mean model, m/s; NaN if it is not admissible.
pub(crate) fn bulk_velocity(point: &Point) -> f64 {
    let found = osteon_common::bulk_velocity::bulk_velocity(point);
    found.map_or(f64::NAN, |found| libm::exp(found.logarithm))
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    fn cells(table: &MarkdownTable, column: usize) -> Vec<f64> {
        table.rows().iter().map(|row| row[column].parse().unwrap_or(f64::NAN)).collect()
    }

    #[test]
    fn what_made_the_data_is_found_within_three_standard_errors() {
        let twins = Twins { repetitions: 7, seed: 3, isa: Isa::fastest() };
        let rows = RefCell::new(0);
        let table = table(&twins, &|_| *rows.borrow_mut() += 1).unwrap();
        assert_eq!(*rows.borrow(), 7);
        for column in [4, 7] {
            let within = cells(&table, column).iter().filter(|errors| errors.abs() < 3.0).count();
            assert!(within >= 6, "{table}");
        }
    }

    #[test]
    fn intervals_hold_the_truth_about_as_often_as_they_say() {
        let twins = Twins { repetitions: 12, seed: 5, isa: Isa::fastest() };
        let table = coverage(&twins, &|_| {}).unwrap();
        assert!(cells(&table, 2).iter().all(|share| *share >= 75.0), "{table}");
        assert!(cells(&table, 3).iter().all(|sd| (0.5..1.6).contains(sd)), "{table}");
    }

    /// With the laws of the population the intervals hold; without them the scatter of the population
    /// is taken for dispersion.
    #[test]
    fn a_population_is_not_taken_for_dispersion() {
        let twins = Twins { repetitions: 2, seed: 5, isa: Isa::fastest() };
        let table = populations(&twins, &|_| {}).unwrap();
        let held = cells(&table, 3);
        assert!(held[0] >= 50.0 && held[1] >= 50.0, "{table}");
        let errors = cells(&table, 4);
        assert!(errors[3] > 2.0 * errors[1], "{table}");
    }
}
