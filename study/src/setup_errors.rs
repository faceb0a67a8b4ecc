//! Identifications from velocities of another setup than the job's: how often intervals hold the truth, with and
//! without what is usually not known of a setup.

use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::inference::{DerivedQuantity, Inference};
use osteon_common::job::{
    Data, JobKind, JobSpecification, MonteCarlo, Objective, Range, Sampling, Search, SearchMethod,
};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::random_quantities::{RandomDistribution, RandomQuantities};
use osteon_common::special::standard_normal_quantile;
use osteon_common::systematic::{Systematic, SystematicQuantity, usual};

use crate::blocks::{FinishedBlock, in_blocks};
use crate::generator::Generator;
use crate::identify::{RealizationCache, Surroundings, identify};
use crate::table::MarkdownTable;
use crate::twins::{Twins, bulk_velocity, data_seed};
use crate::{RowCallback, StudyError};

/// Default number of bones.
pub const BONES: u64 = 300;
/// Numbers of velocities of the data.
const VELOCITIES: [usize; 3] = [20, 100, 2747];
/// Intervals from which true Young's moduli (Pa) and dispersions are drawn, and the bounds of their search.
const MODULI: [f64; 2] = [14e9, 22e9];
const DISPERSIONS: [f64; 2] = [0.05, 0.2];
const MODULUS_BOUNDS: [f64; 2] = [5e9, 60e9];
const DISPERSION_BOUNDS: [f64; 2] = [0.01, 0.5];
/// The other parameters: the paper's optimum.
const BONE: [f64; 7] = [1598.8, 18e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1];
/// Number of realizations of the model.
const REALIZATIONS: u64 = 64;
/// Maximum fraction of failed realizations of the model.
const FAILED_MAX: f64 = 0.05;
/// Half the width of the 50 % interval in standard errors.
const HALF: f64 = 0.674_489_750_196_081_7;

/// How often intervals hold the truth.
#[derive(Debug, Clone, Copy, Default)]
struct Held {
    all: u64,
    most: u64,
    half: u64,
}

/// What was found of √(c1111/ρ) and the dispersion, with the truths.
type Recovered = [(Option<DerivedQuantity>, f64); 2];

/// Counts the intervals of √(c1111/ρ) and of the dispersion that hold the truth, by the number of velocities and by
/// whether the job says `[systematic] usual = true`. The velocities come from setups in which each quantity is
/// drawn from its usual law; the job has the default setup.
///
/// # Errors
/// If a point has no ensemble, or an identification fails.
pub fn coverage(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut held = [[[Held::default(); 2]; 2]; VELOCITIES.len()];
    for block in in_blocks(twins.repetitions, |number| identify_bone(twins, number, &VELOCITIES)) {
        let FinishedBlock { done, found } = block?;
        for found in &found {
            let places = held.iter_mut().flatten().flatten();
            places.zip(found.iter().flatten().flatten()).for_each(|(held, found)| held.add(found));
        }
        progress(&format!("{done} bones: {held:?}"));
    }
    let mut table = MarkdownTable::new(&[
        "velocities",
        "usual",
        "quantity",
        "intervals",
        "95 % intervals that hold it (%)",
        "50 % intervals that hold it (%)",
    ]);
    for (velocities, by_job) in VELOCITIES.iter().zip(held) {
        for (usual, by_quantity) in ["false", "true"].into_iter().zip(by_job) {
            for (name, held) in ["√(c1111/ρ)", "dispersion"].into_iter().zip(by_quantity) {
                let named = [velocities.to_string(), usual.to_owned(), name.to_owned()];
                table.push([&named[..], &held.cells()].concat());
            }
        }
    }
    Ok(table)
}

impl Held {
    fn add(&mut self, (found, truth): &(Option<DerivedQuantity>, f64)) {
        let Some((found, known)) = found.and_then(|found| Some((found, found.known?))) else {
            return;
        };
        let [lower, upper] = known.interval;
        self.all += 1;
        self.most += u64::from((lower..=upper).contains(truth));
        self.half += u64::from((found.value - truth).abs() <= HALF * known.standard_error);
    }

    fn cells(&self) -> [String; 3] {
        let share = |part: u64| format!("{:.1}", 100.0 * part as f64 / self.all.max(1) as f64);
        [self.all.to_string(), share(self.most), share(self.half)]
    }
}

/// Identifies bone number `number` from each number of velocities, without and with the usual errors. `None` if it
/// has too few velocities.
fn identify_bone(
    twins: &Twins,
    number: u64,
    counts: &[usize],
) -> Result<Option<Vec<[Recovered; 2]>>, StudyError> {
    let mut generator = Generator::for_index(twins.seed, number);
    let (modulus, dispersion) = (
        generator.between(MODULI[0], MODULI[1]),
        generator.between(DISPERSIONS[0], DISPERSIONS[1]),
    );
    let truth = point(modulus, dispersion);
    let job_setup = Setup::default();
    let TrueSetup { setup, factor, offset } = TrueSetup::draw(&job_setup, &mut generator);
    let most = counts.iter().max().copied().unwrap_or_default();
    let drawn = most as u64 + most as u64 / 20;
    let bones = Surroundings { setup, ..Surroundings::default() };
    let seed = data_seed(twins.seed, number);
    let mut velocities = bones.velocities(&truth, drawn, seed, twins.isa)?;
    velocities.iter_mut().for_each(|one| *one = factor.mul_add(*one, offset));
    if velocities.len() < most {
        return Ok(None);
    }
    let identified = |count: usize| {
        let of_job = |usual| {
            let data = velocities[..count].to_vec();
            let specification = specification(&job_setup, data, usual, twins.seed + number);
            let job = identify(&specification, &mut RealizationCache::new(), twins.isa)?;
            let inference = job.result.conclusions.inference;
            let of = |quantity: fn(&Inference) -> DerivedQuantity| inference.as_ref().map(quantity);
            Ok::<Recovered, StudyError>([
                (of(|found| found.bulk_velocity), bulk_velocity(&truth)),
                (of(|found| found.dispersion), truth.dispersion()),
            ])
        };
        Ok([of_job(false)?, of_job(true)?])
    };
    counts.iter().copied().map(identified).collect::<Result<_, StudyError>>().map(Some)
}

/// The setup of which data are, and what a device makes of its velocities.
struct TrueSetup {
    setup: Setup,
    /// The pitch that the device takes over the true one.
    factor: f64,
    /// Offset of its velocities, m/s.
    offset: f64,
}

impl TrueSetup {
    /// Draws each quantity from its usual law about its value in a setup.
    fn draw(about: &Setup, generator: &mut Generator) -> Self {
        let mut drawn = Self { setup: about.clone(), factor: 1.0, offset: 0.0 };
        for quantity in SystematicQuantity::ALL {
            let normal = standard_normal_quantile(generator.uniform());
            let Some((distribution, spread)) = usual::law(quantity, about) else { continue };
            let centre = match quantity {
                SystematicQuantity::BoneQualityFactor => Some(usual::QUALITY_FACTOR),
                _ => quantity.value_in(about),
            };
            let Some(centre) = centre else { continue };
            let value = match distribution {
                RandomDistribution::LogNormal => centre * libm::exp(spread * normal),
                _ => spread.mul_add(normal, centre),
            };
            match quantity {
                SystematicQuantity::VelocityOffset => drawn.offset = value,
                SystematicQuantity::Pitch => drawn.factor = centre / value,
                _ => {}
            }
            drawn.setup = quantity.with(value, drawn.setup);
        }
        drawn
    }
}

fn specification(setup: &Setup, data: Vec<f64>, usual: bool, seed: u64) -> JobSpecification {
    let mut parameters = point(BONE[1], BONE[6]).0.map(Range::Fixed);
    let free = |[lower, upper]: [f64; 2], start| Range::Free { start, lower, upper };
    parameters[Parameter::LongitudinalYoungModulus as usize] = free(MODULUS_BOUNDS, BONE[1]);
    parameters[Parameter::Dispersion as usize] = free(DISPERSION_BOUNDS, BONE[6]);
    JobSpecification {
        kind: JobKind::Identification,
        setup: setup.clone(),
        data: Some(Data::from_velocities(data)),
        parameters,
        random: RandomQuantities::default(),
        systematic: Systematic { usual, ..Systematic::default() },
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo {
            realizations: REALIZATIONS,
            seed,
            sampling: Sampling::Sobol,
            control_variate: true,
            max_failed_fraction: FAILED_MAX,
            ..MonteCarlo::default()
        },
        objective: Objective::default(),
        search: Search::by(SearchMethod::Newton),
        posterior: None,
    }
}

/// Returns the point of this longitudinal Young's modulus (Pa) and dispersion.
fn point(modulus: f64, dispersion: f64) -> Point {
    let mut values = BONE;
    (values[1], values[6]) = (modulus, dispersion);
    Point::of_bone(values)
}

#[cfg(test)]
mod tests {
    use osteon_solver::Isa;

    use super::*;

    #[test]
    fn intervals_hold_the_truth_of_another_setup_only_if_the_job_says_what_is_not_known() {
        let twins = Twins { repetitions: 0, seed: 5, isa: Isa::fastest() };
        let found = identify_bone(&twins, 0, &[200]).unwrap().unwrap();
        let [without, with] = found[0].map(|[velocity, _]| velocity);
        let is_held = |(found, truth): (Option<DerivedQuantity>, f64)| {
            let [lower, upper] = found.unwrap().known.unwrap().interval;
            (lower..=upper).contains(&truth)
        };
        assert!(!is_held(without), "{without:?}");
        assert!(is_held(with), "{with:?}");
    }
}
