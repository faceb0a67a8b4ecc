//! Identifications of porosity from simulated data. [`coverage`] and [`profiles`] count how often intervals
//! contain the true value; [`unmodelled`] measures the error of a model with one porosity when that of the
//! bones changes through the thickness.

use osteon_common::bone_structure::{BoneStructure, PorosityProfile, ProfileShape};
use osteon_common::case::Setup;
use osteon_common::group_settings::GroupSettings;
use osteon_common::inference::{DerivedQuantity, Uncertainty};
use osteon_common::job::{
    Data, JobKind, JobSpecification, MonteCarlo, Objective, PosteriorSettings, Range, Sampling,
    Search, SearchMethod,
};
use osteon_common::parameters::{Parameter, Point};
use osteon_common::porosity::BoneMatrix;
use osteon_common::posterior::Posterior;
use osteon_common::quantile::quantile;
use osteon_common::random_quantities::RandomQuantities;
use osteon_common::systematic::Systematic;

use crate::blocks::{FinishedBlock, in_blocks};
use crate::generator::Generator;
use crate::identify::{RealizationCache, Surroundings, identify};
use crate::table::{MarkdownTable, millimetres, two_digits};
use crate::twins::{Twins, data_seed, errors, quantity_of};
use crate::{RowCallback, StudyError};

/// Default number of bones of [`coverage`].
pub const BONES: u64 = 500;
/// Default number of bones of [`profiles`].
pub const PROFILES: u64 = 100;
/// Numbers of velocities of the data of [`coverage`].
const COVERAGE_VELOCITIES: [usize; 3] = [20, 100, 2747];
/// Number of velocities of the data of [`profiles`].
const PROFILE_VELOCITIES: u64 = 100;
/// Number of velocities of the data of [`unmodelled`].
const UNMODELLED_VELOCITIES: u64 = 4000;
/// Intervals from which the true porosity and the true dispersion are drawn.
pub(crate) const POROSITIES: [f64; 2] = [0.03, 0.25];
pub(crate) const DISPERSIONS: [f64; 2] = [0.05, 0.2];
/// Bounds of their search.
const POROSITY_BOUNDS: [f64; 2] = [0.002, 0.45];
const DISPERSION_BOUNDS: [f64; 2] = [0.01, 0.4];
/// Truths and bounds of the porosities at the skin's and at the marrow's side in [`profiles`].
const ENDS: [[f64; 2]; 2] = [[0.01, 0.15], [0.02, 0.4]];
/// Number of realizations of the model; the second, where a posterior is computed.
const REALIZATIONS: u64 = 256;
const POSTERIOR_REALIZATIONS: u64 = 64;
/// Maximum fraction of failed realizations of the model.
const FAILED_MAX: f64 = 0.05;
/// Porosities at the skin's and at the marrow's side, and thicknesses of the plate (m), of [`unmodelled`].
const UNMODELLED: [([f64; 2], ProfileShape); 4] = [
    ([0.08, 0.12], ProfileShape::Linear),
    ([0.05, 0.15], ProfileShape::Linear),
    ([0.04, 0.24], ProfileShape::Linear),
    ([0.05, 0.15], ProfileShape::Endosteal),
];
const THICKNESSES: [f64; 2] = [4e-3, 1.5e-3];
/// Dispersion of the bones of [`unmodelled`].
const DISPERSION: f64 = 0.1;

/// Counts the 95 % intervals of porosity and dispersion that hold the truth, by the number of velocities, for
/// bones whose porosity (3 to 25 %) and dispersion (0.05 to 0.2) are drawn uniformly.
///
/// # Errors
/// If a point has no ensemble, or an identification fails.
pub fn coverage(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut counts = [[IntervalCount::default(); 2]; COVERAGE_VELOCITIES.len()];
    for block in in_blocks(twins.repetitions, |number| identify_bone(twins, number)) {
        let FinishedBlock { done, found } = block?;
        for found in &found {
            for (count, found) in counts.iter_mut().flatten().zip(found.iter().flatten()) {
                count.add(found);
            }
        }
        let held = counts.map(|row| row.map(|count| (count.held, count.all)));
        progress(&format!("{done} bones: {held:?}"));
    }
    let mut table = MarkdownTable::new(&[
        "velocities",
        "quantity",
        "intervals",
        "without one",
        "intervals that hold it (%)",
        "r.m.s. of (found - true)/s.e.",
    ]);
    for (velocities, row) in COVERAGE_VELOCITIES.iter().zip(counts) {
        for (name, count) in ["porosity", "dispersion"].into_iter().zip(row) {
            table.push([vec![velocities.to_string(), name.to_owned()], count.cells()].concat());
        }
    }
    Ok(table)
}

/// Counts the posterior intervals that hold the truth for bones whose porosity changes linearly through the
/// thickness, from a hundred velocities, with both ends and the dispersion free. The truths are drawn from
/// the prior.
///
/// # Errors
/// If a point has no ensemble, or an identification fails.
pub fn profiles(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut held = [[0_u64; 2]; PROFILE_QUANTITIES.len()];
    let (mut all, mut unconverged, mut evaluations) = (0, 0, 0);
    for block in in_blocks(twins.repetitions, |number| posterior_of_bone(twins, number)) {
        for (truth, posterior) in &block?.found {
            all += 1;
            unconverged += u64::from(!posterior.converged);
            evaluations += posterior.evaluations;
            for (held, (_, value)) in held.iter_mut().zip(PROFILE_QUANTITIES) {
                for (held, level) in held.iter_mut().zip([0.95, 0.5]) {
                    *held += u64::from(holds(posterior, value, level, value(truth)));
                }
            }
        }
        progress(&format!("{all} posteriors, {unconverged} not converged: {held:?}"));
    }
    let mut table = MarkdownTable::new(&[
        "quantity",
        "posteriors",
        "not converged",
        "evaluations each",
        "95 % intervals that hold it (%)",
        "50 % intervals that hold it (%)",
    ]);
    let share = |part: u64| format!("{:.1}", 100.0 * part as f64 / f64::max(all as f64, 1.0));
    for ((name, _), [most, half]) in PROFILE_QUANTITIES.into_iter().zip(held) {
        let each = evaluations as f64 / f64::max(all as f64, 1.0);
        let counts = [all.to_string(), unconverged.to_string(), format!("{each:.0}")];
        table.push([&[name.to_owned()][..], &counts, &[share(most), share(half)]].concat());
    }
    Ok(table)
}

/// Identifies one porosity from many velocities of bones whose porosity changes through the thickness, with a
/// dispersion of 0.1.
///
/// # Errors
/// If a point has no ensemble, or an identification fails.
pub fn unmodelled(twins: &Twins, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut table = MarkdownTable::new(&[
        "plate (mm)",
        "porosity, skin to marrow",
        "shape",
        "mean",
        "velocity - that of the mean (m/s)",
        "porosity found",
        "dispersion found",
    ]);
    for thickness in THICKNESSES {
        let mut setup = Setup::default();
        setup.layers.bone_thickness = thickness;
        let velocities = |structure: BoneStructure| {
            let bones = Surroundings {
                setup: Setup { structure, ..setup.clone() },
                ..Surroundings::default()
            };
            bones.velocities(
                &matrix_point(DISPERSION),
                UNMODELLED_VELOCITIES,
                twins.seed,
                twins.isa,
            )
        };
        for (ends, shape) in UNMODELLED {
            let [surface, marrow] = ends.map(Some);
            let profile = PorosityProfile { surface, marrow, shape, ..PorosityProfile::default() };
            let profiled = velocities(BoneStructure { profile, ..BoneStructure::default() })?;
            let mean = middle(ends);
            let uniform =
                velocities(BoneStructure { porosity: Some(mean), ..BoneStructure::default() })?;
            let shift = mean_of(&profiled) - mean_of(&uniform);
            let found = identify_pores(&setup, Data::from_velocities(profiled), twins)?;
            let value =
                |k: usize| found.map_or("–".to_owned(), |found| format!("{:.3}", found[k].value));
            table.push(vec![
                millimetres(thickness),
                format!("{} → {}", ends[0], ends[1]),
                shape.name().to_owned(),
                format!("{mean:.2}"),
                format!("{shift:+.0}"),
                value(0),
                value(1),
            ]);
            progress(&table.last_row());
        }
    }
    Ok(table)
}

/// How often intervals of one quantity hold its truth.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct IntervalCount {
    all: u64,
    without: u64,
    held: u64,
    squares: f64,
}

/// A quantity that was identified, and its truth.
pub(crate) type Found = (Option<DerivedQuantity>, f64);

impl IntervalCount {
    pub(crate) fn add(&mut self, (found, truth): &Found) {
        let known = found.as_ref().and_then(|found| found.known.zip(errors(found, *truth)));
        let Some((Uncertainty { interval: [lower, upper], .. }, errors)) = known else {
            self.without += 1;
            return;
        };
        self.all += 1;
        self.held += u64::from((lower..=upper).contains(truth));
        self.squares = errors.mul_add(errors, self.squares);
    }

    pub(crate) fn cells(&self) -> Vec<String> {
        let all = self.all.max(1) as f64;
        let share = format!("{:.1}", 100.0 * self.held as f64 / all);
        let spread = two_digits(Some((self.squares / all).sqrt()));
        vec![self.all.to_string(), self.without.to_string(), share, spread]
    }
}

/// Returns porosity and dispersion of bone number `number` as identified from each number of velocities.
/// `None` if it has too few velocities.
fn identify_bone(
    twins: &Twins,
    number: u64,
) -> Result<Option<[[Found; 2]; COVERAGE_VELOCITIES.len()]>, StudyError> {
    let mut generator = Generator::for_index(twins.seed, number);
    let mut draw = |[from, to]: [f64; 2]| generator.between(from, to);
    let truth = [draw(POROSITIES), draw(DISPERSIONS)];
    let mut bones = Surroundings::default();
    bones.setup.structure.porosity = Some(truth[0]);
    let most = COVERAGE_VELOCITIES.iter().max().copied().unwrap_or_default();
    let drawn = most as u64 + most as u64 / 20;
    let seed = data_seed(twins.seed, number);
    let velocities = bones.velocities(&matrix_point(truth[1]), drawn, seed, twins.isa)?;
    if velocities.len() < most {
        return Ok(None);
    }
    let mut found = [[(None, 0.0); 2]; COVERAGE_VELOCITIES.len()];
    for (found, count) in found.iter_mut().zip(COVERAGE_VELOCITIES) {
        let identified = identify_pores(
            &Setup::default(),
            Data::from_velocities(velocities[..count].to_vec()),
            twins,
        )?;
        *found = [0, 1].map(|k| (identified.map(|identified| identified[k]), truth[k]));
    }
    Ok(Some(found))
}

/// Identifies porosity and dispersion by Newton's method, starting in the middle of the truths. `None` if
/// there are no derivatives at the end.
pub(crate) fn identify_pores(
    setup: &Setup,
    data: Data,
    twins: &Twins,
) -> Result<Option<[DerivedQuantity; 2]>, StudyError> {
    let mut specification = specification(setup, Some(data), REALIZATIONS, twins.seed);
    let start = middle(POROSITIES);
    specification.setup.structure.porosity = Some(start);
    specification.parameters[Parameter::Porosity as usize] = free(POROSITY_BOUNDS, start);
    let found = identify(&specification, &mut RealizationCache::new(), twins.isa)?;
    Ok(found
        .result
        .conclusions
        .inference
        .and_then(|found| Some([quantity_of(&found, Parameter::Porosity)?, found.dispersion])))
}

/// Returns the truth of bone number `number`, drawn from the prior, and its posterior. `None` if the point has
/// too few velocities.
fn posterior_of_bone(twins: &Twins, number: u64) -> Result<Option<(Point, Posterior)>, StudyError> {
    let mut generator = Generator::for_index(twins.seed, number);
    let mut draw = |[from, to]: [f64; 2]| generator.between(from, to);
    let [surface, marrow] = ENDS.map(&mut draw);
    let mut truth = matrix_point(draw(DISPERSIONS));
    truth.0[Parameter::SurfacePorosity as usize] = surface;
    truth.0[Parameter::MarrowPorosity as usize] = marrow;
    let mut bones = Surroundings::default();
    let profile = &mut bones.setup.structure.profile;
    (profile.surface, profile.marrow) = (Some(surface), Some(marrow));
    let seed = data_seed(twins.seed, number);
    let mut velocities = bones.velocities(&truth, 2 * PROFILE_VELOCITIES, seed, twins.isa)?;
    if velocities.len() < PROFILE_VELOCITIES as usize {
        return Ok(None);
    }
    velocities.truncate(PROFILE_VELOCITIES as usize);
    let model_seed = twins.seed + number;
    let mut job = specification(
        &bones.setup,
        Some(Data::from_velocities(velocities)),
        POSTERIOR_REALIZATIONS,
        model_seed,
    );
    let ends = [Parameter::SurfacePorosity, Parameter::MarrowPorosity];
    for (parameter, bounds) in ends.into_iter().zip(ENDS) {
        job.parameters[parameter as usize] = free(bounds, middle(bounds));
    }
    job.parameters[Parameter::Dispersion as usize] = free(DISPERSIONS, middle(DISPERSIONS));
    job.search = Search::by(SearchMethod::Posterior);
    job.posterior = Some(PosteriorSettings::default());
    let found = identify(&job, &mut RealizationCache::new(), twins.isa)?;
    Ok(found.result.conclusions.posterior.map(|posterior| (truth, posterior)))
}

/// A quantity of a point.
type Quantity = fn(&Point) -> f64;

/// Quantities of [`profiles`].
const PROFILE_QUANTITIES: [(&str, Quantity); 4] = [
    ("porosity at the skin's side", |point| point.get(Parameter::SurfacePorosity)),
    ("porosity at the marrow's side", |point| point.get(Parameter::MarrowPorosity)),
    ("mean porosity", |point| {
        0.5 * (point.get(Parameter::SurfacePorosity) + point.get(Parameter::MarrowPorosity))
    }),
    ("dispersion", Point::dispersion),
];

/// Returns whether the central interval of this level holds `truth`.
fn holds(posterior: &Posterior, value: Quantity, level: f64, truth: f64) -> bool {
    let mut values: Vec<f64> = posterior.draws.iter().map(|draw| value(&draw.point)).collect();
    values.sort_unstable_by(f64::total_cmp);
    let end = |probability| quantile(&values, probability);
    let ends = end(0.5 - 0.5 * level).zip(end(0.5 + 0.5 * level));
    ends.is_some_and(|(lower, upper)| (lower..=upper).contains(&truth))
}

/// Returns a job in which the dispersion is free, and everything else fixed at the truth: callers free the
/// porosities.
pub(crate) fn specification(
    setup: &Setup,
    data: Option<Data>,
    realizations: u64,
    seed: u64,
) -> JobSpecification {
    let point = matrix_point(middle(DISPERSIONS));
    let mut parameters = point.0.map(Range::Fixed);
    parameters[Parameter::Dispersion as usize] = free(DISPERSION_BOUNDS, point.dispersion());
    JobSpecification {
        kind: JobKind::Identification,
        setup: setup.clone(),
        data,
        parameters,
        random: RandomQuantities::default(),
        systematic: Systematic::default(),
        groups: GroupSettings::default(),
        monte_carlo: MonteCarlo {
            realizations,
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

/// Returns the point of the default matrix, the bone between the pores, with this dispersion.
pub(crate) fn matrix_point(dispersion: f64) -> Point {
    Point::of_matrix(&BoneMatrix::default(), dispersion)
}

fn free([lower, upper]: [f64; 2], start: f64) -> Range {
    Range::Free { start, lower, upper }
}

fn middle([lower, upper]: [f64; 2]) -> f64 {
    0.5 * (lower + upper)
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use osteon_solver::Isa;

    use super::*;

    #[test]
    fn intervals_of_porosity_and_dispersion_hold_them() {
        let twins = Twins { repetitions: 4, seed: 5, isa: Isa::fastest() };
        let table = coverage(&twins, &|_| {}).unwrap();
        assert_eq!(table.rows().len(), 2 * COVERAGE_VELOCITIES.len());
        for row in table.rows() {
            assert_eq!([&row[2], &row[3]], ["4", "0"], "{table}");
            assert!(row[4].parse::<f64>().unwrap() >= 75.0, "{table}");
        }
    }
}
