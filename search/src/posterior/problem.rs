//! What a posterior depends on except for the model, and populations of weighted points that stand for it.
//!
//! Independent importance sampling by Sobol' points: the moments are drawn from the likelihood, the
//! parameters from the prior, but for the pivots, which are solved for (`pivot.rs`). A point's weight
//! is posterior density over density of its draw; with the pivots z it is π(z) L(y)/(q(y) |∂y/∂z|).

use std::ops::Range;

use osteon_common::bone_structure::BoneStructure;
use osteon_common::ensemble::GERMS;
use osteon_common::germ_source::sobol_points;
use osteon_common::job::JobSpecification;
use osteon_common::moments::MomentVector;
use osteon_common::parameters::{PARAMETERS, Parameter, Point};

use super::draw_law::DrawLaw;
use super::features::{Features, features};
use super::likelihood::SetLikelihood;
use super::moments_grid::{LogSpan, MomentsGrid};
use super::pivot::{Pivots, solve};
use super::population::{Member, Population};
use super::prior::ParameterPrior;
use super::surrogate::{Deviations, RULE_OF_THUMB, Scale, Surrogate};
use crate::search_box::admissible;

/// Number of points drawn from the prior for scales and ranges.
const PRIOR_POINTS: u64 = 1024;
/// How far ln v may be from ln √(c1111/ρ), and ln Δ from ln δ: far more than in any plate. Nothing
/// is drawn beyond.
const REACH: [[f64; 2]; 2] = [[-0.3, 0.3], [-2.2, -0.5]];
/// Maximum number of corrections of the pivots for one point.
const CORRECTIONS_MAX: usize = 64;
/// Number of corrections after which every second one is followed by an extrapolation. A pivot that hardly moves the
/// velocity, such as the porosity at the far side of a thick plate, though it moves that of the mean solid, would
/// else be corrected by a small part of its error at a time.
const PLAIN_CORRECTIONS: usize = 40;
/// Corrections end when the deviations change by at most this.
const CORRECTED: f64 = 1e-9;
/// Points whose moments differ from those wanted by more than this are no solutions.
const UNSOLVED: f64 = 1e-8;
/// Fraction of the bounds' distance by which a pivot may leave them while it is corrected. It stays
/// there meanwhile, since only the solution has to be within the bounds.
const OVERSHOOT: f64 = 0.1;
/// Step of the derivatives by the pivots, relative to the bounds' distance.
const STEP: f64 = 1e-5;

/// How often a population is drawn anew about the weights of the one before, if other observables were
/// measured.
const LAWS: usize = 2;
/// Points of the populations before the last one: enough to tell where the weights are.
const LAW_POINTS: u64 = 1 << 14;
/// Largest number of threads that draw a population.
const THREADS_MAX: usize = 16;
/// Power of the likelihood of widened populations.
const WIDENED: f64 = 0.5;

/// Everything that a posterior depends on except for the model.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PosteriorProblem {
    pub(super) likelihood: SetLikelihood,
    pub(super) priors: Vec<ParameterPrior>,
    pub(super) scale: Scale,
    /// Pores of the setup.
    pub(super) structure: BoneStructure,
    /// Values of the fixed parameters, and medians of the others.
    base: Point,
    pivots: Pivots,
    /// Moments that models within the bounds can have.
    reach: [LogSpan; 2],
    grid: MomentsGrid,
    /// The law about points near the data, if points of the prior do not match.
    near: Option<DrawLaw>,
    seed: u64,
}

impl PosteriorProblem {
    /// Creates the problem of a job with this likelihood of its data; `None` if no point within the
    /// bounds is admissible, or no parameter is free.
    pub(super) fn new(specification: &JobSpecification, likelihood: SetLikelihood) -> Option<Self> {
        let priors = ParameterPrior::of_job(specification);
        let mut base = specification.start();
        for prior in &priors {
            base.0[prior.parameter as usize] = prior.quantile(0.5);
        }
        let seed = specification.monte_carlo.seed;
        let structure = specification.setup.structure.clone();
        let points = prior_points((&priors, &structure), &base, seed, 0..PRIOR_POINTS);
        let sample: Vec<Features> =
            points.iter().filter_map(|point| features(&structure, point)).collect();
        if priors.is_empty() || sample.is_empty() {
            return None;
        }
        let reach = reach(&sample);
        let grid = MomentsGrid::new(&likelihood.velocities, reach);
        let pivots = Pivots::choose(&priors, &structure, points.first().unwrap_or(&base));
        let scale = Scale::from_sample(&sample);
        Some(Self {
            likelihood,
            priors,
            scale,
            structure,
            base,
            pivots,
            reach,
            grid,
            near: None,
            seed,
        })
    }

    /// Returns the problem with a model whose moments have these relative standard errors.
    pub(super) fn with_model_errors(&self, errors: MomentVector) -> Self {
        let likelihood = self.likelihood.clone().with_model_errors(errors);
        let grid = MomentsGrid::new(&likelihood.velocities, self.reach);
        Self { likelihood, grid, ..self.clone() }
    }

    /// Returns the problem whose populations are at first drawn about these points.
    pub(super) fn drawn_near(self, points: &[&Point]) -> Self {
        let priors: Vec<&ParameterPrior> =
            self.priors.iter().filter(|prior| !self.is_pivot(prior.parameter)).collect();
        let coordinates = |point: &&Point| -> Vec<f64> {
            priors.iter().map(|prior| prior.probability_below(point.get(prior.parameter))).collect()
        };
        let all: Vec<Vec<f64>> = points.iter().map(coordinates).collect();
        let all: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
        let near = DrawLaw::about(&all, &vec![1.0 / all.len() as f64; all.len()]);
        // A sample of the prior says nothing of corners.
        let there: Vec<Features> =
            points.iter().filter_map(|point| features(&self.structure, point)).collect();
        let (known, there) = (self.reach, reach(&there));
        let reach = [0, 1].map(|k| [known[k][0].min(there[k][0]), known[k][1].max(there[k][1])]);
        let grid = MomentsGrid::new(&self.likelihood.velocities, reach);
        Self { near, reach, grid, ..self }
    }

    /// Returns the admissible points of those with these numbers that are drawn from the prior.
    pub(super) fn prior_points(&self, numbers: Range<u64>) -> Vec<Point> {
        prior_points((&self.priors, &self.structure), &self.base, self.seed, numbers)
    }

    /// Draws the population of an interpolated model from `count` Sobol' points; `number` chooses
    /// among independent ones.
    pub(super) fn population(&self, model: &Surrogate, count: u64, number: u64) -> Population {
        let has_others = !self.likelihood.observables().is_empty();
        let by_prior = self.drawn_parameters() == 0 || self.near.is_none() && !has_others;
        let mut law = self.near.clone();
        for _ in 0..if by_prior { 0 } else { LAWS } {
            let scouts = self.drawn_by(law.as_ref(), model, count.min(LAW_POINTS), number);
            law = self.draw_law(&scouts).or(law);
        }
        self.drawn_by(law.as_ref(), model, count, number)
    }

    /// Draws a population whose parameters other than the pivots come from a law, or from the prior.
    fn drawn_by(
        &self,
        law: Option<&DrawLaw>,
        model: &Surrogate,
        count: u64,
        number: u64,
    ) -> Population {
        let points = sobol_points(self.seed, u64::MAX - 1 - number, count);
        let branches = self.pivots.branches();
        let members = in_parallel(&points, |index, uniforms| {
            let place = (law, index);
            (0..branches)
                .filter_map(|branch| self.member(model, place, uniforms, branch))
                .collect::<Vec<Member>>()
        });
        Population::new(members.into_iter().flatten().collect())
    }

    /// Returns the law about the weights of a population; `None` if these do not scatter.
    fn draw_law(&self, population: &Population) -> Option<DrawLaw> {
        let drawn = self.drawn_parameters();
        let coordinates: Vec<&[f64]> =
            population.members.iter().map(|member| &member.coordinates[..drawn]).collect();
        DrawLaw::about(&coordinates, &population.weights)
    }

    /// Returns the number of free parameters that are not pivots.
    fn drawn_parameters(&self) -> usize {
        self.priors.iter().filter(|prior| !self.is_pivot(prior.parameter)).count()
    }

    /// Returns the square distance of the moments of a model, in logarithms, from the data's, in units of the data's
    /// noise.
    pub(super) fn distance(&self, values: &MomentVector) -> f64 {
        let data = self.likelihood.data.in_logarithms(&self.likelihood.data);
        self.in_noise(values.iter().zip(data).map(|(value, data)| (value - data) * (value - data)))
    }

    /// Returns the sum of square errors of the compared moments, in units of the data's noise.
    pub(super) fn in_noise(&self, squares: impl Iterator<Item = f64>) -> f64 {
        let terms = squares.zip(self.likelihood.errors());
        terms.map(|(square, error)| square / (error * error)).sum()
    }

    /// Returns whether there are at most two free parameters: the result is then exact to 1e-3 of a
    /// standard deviation.
    pub(super) fn is_of_few(&self) -> bool {
        self.priors.len() <= 2
    }

    /// Returns the population of a likelihood that is wider by a half power: draws from it show the
    /// errors in the tails, which the ends of intervals depend on.
    pub(super) fn widened(&self, population: Population) -> Population {
        let wider = |member: Member| {
            let log_likelihood = self.likelihood.log(&member.moments);
            let log_weight = member.log_weight - (1.0 - WIDENED) * log_likelihood;
            Member { log_weight, ..member }
        };
        Population::new(population.members.into_iter().map(wider).collect())
    }

    fn member(
        &self,
        model: &Surrogate,
        (law, index): (Option<&DrawLaw>, usize),
        uniforms: &[f64; GERMS],
        branch: usize,
    ) -> Option<Member> {
        let wanted = [self.pivots.mean.is_some(), self.pivots.dispersion];
        let draw = self.grid.draw(wanted, [uniforms[0], uniforms[1]]);
        let mut point = self.base;
        let own = &uniforms[2..2 + self.drawn_parameters()];
        let drawn = law.map_or_else(|| own.to_vec(), |law| law.draw(index, own));
        let mut coordinates = [0.0; PARAMETERS];
        let priors = self.priors.iter().filter(|prior| !self.is_pivot(prior.parameter));
        for ((prior, &u), slot) in priors.zip(&drawn).zip(&mut coordinates) {
            if !(0.0..1.0).contains(&u) {
                return None;
            }
            point.0[prior.parameter as usize] = prior.quantile(u);
            *slot = u;
        }
        let (point, deviations) = self.solved(model, point, draw.at, branch)?;
        let mut log_prior = 0.0;
        for prior in self.priors.iter().filter(|prior| self.is_pivot(prior.parameter)) {
            log_prior += prior.log_density(point.get(prior.parameter))?;
        }
        if !admissible(&self.structure, &point) {
            return None;
        }
        let at = features(&self.structure, &point)?;
        let moments =
            with_closed_form(model.mean_beside(deviations, &at), &self.structure, &point)?;
        let jacobian = self.jacobian(model, &point, [moments[0], moments[1]])?;
        let log_law = law.map_or(0.0, |law| law.log_density(&drawn));
        let log_weight = log_prior + self.likelihood.log(&moments)
            - draw.log_density
            - libm::log(jacobian)
            - log_law;
        let member = Member { point, moments, log_weight, coordinates };
        log_weight.is_finite().then_some(member)
    }

    /// Solves for the pivots: returns the point at which the model has the moments `wanted`, as far
    /// as pivots can be chosen for that, and the deviations of ln v and ln Δ there. The pivots of `point` are
    /// where the corrections begin.
    fn solved(
        &self,
        model: &Surrogate,
        mut point: Point,
        wanted: [f64; 2],
        branch: usize,
    ) -> Option<(Point, [f64; 2])> {
        let first = features(&self.structure, &point).map(|at| model.mean_of_velocities(&at));
        let mut deviations = first.unwrap_or([RULE_OF_THUMB[0], RULE_OF_THUMB[1]]);
        let mut before = deviations;
        for correction in 0..CORRECTIONS_MAX {
            let found = self.correct(model, &mut point, (wanted, deviations), branch)?;
            let change = (found[0] - deviations[0]).abs().max((found[1] - deviations[1]).abs());
            let sequence = [before, deviations, found];
            (before, deviations) = (deviations, found);
            if change <= CORRECTED {
                break;
            }
            if correction >= PLAIN_CORRECTIONS && correction.is_multiple_of(2) {
                deviations = [0, 1].map(|k| limit(sequence.map(|one| one[k])));
            }
        }
        let closed = closed_form(&self.structure, &point)?;
        let is_solved =
            |k: usize| (closed[k] + deviations[k] - wanted[k]).abs() <= UNSOLVED || !self.solves(k);
        (is_solved(0) && is_solved(1)).then_some((point, deviations))
    }

    /// Moves the pivots to where the moments are those wanted with the deviations given; returns the deviations there.
    fn correct(
        &self,
        model: &Surrogate,
        point: &mut Point,
        (wanted, deviations): ([f64; 2], [f64; 2]),
        branch: usize,
    ) -> Option<[f64; 2]> {
        if self.pivots.dispersion {
            let dispersion = libm::exp(wanted[1] - deviations[1]);
            self.set(point, Parameter::Dispersion, dispersion)?;
        }
        if let Some(pivot) = self.pivots.mean {
            let wanted = wanted[0] - deviations[0];
            let value = solve(&self.structure, point, pivot, wanted, branch)?;
            self.set(point, pivot, value)?;
        }
        Some(model.mean_of_velocities(&features(&self.structure, point)?))
    }

    /// Returns whether a pivot is solved for ln v (0) or ln Δ (1).
    fn solves(&self, moment: usize) -> bool {
        if moment == 0 { self.pivots.mean.is_some() } else { self.pivots.dispersion }
    }

    /// Sets a pivot to a value, or to the nearest one not far outside its bounds.
    fn set(&self, point: &mut Point, parameter: Parameter, value: f64) -> Option<()> {
        let prior = self.priors.iter().find(|prior| prior.parameter == parameter)?;
        let slack = OVERSHOOT * (prior.upper - prior.lower);
        // What is positive within the bounds stays so.
        let low = if prior.lower > 0.0 { 0.5 * prior.lower } else { f64::NEG_INFINITY };
        let low = low.max(prior.lower - slack);
        point.0[parameter as usize] = value.clamp(low, prior.upper + slack);
        Some(())
    }

    /// Returns |∂y/∂z| for the pivots z; 1 if there are none.
    fn jacobian(&self, model: &Surrogate, point: &Point, at: [f64; 2]) -> Option<f64> {
        let slope = |parameter: Parameter| {
            let prior = self.priors.iter().find(|prior| prior.parameter == parameter)?;
            let step = STEP * (prior.upper - prior.lower);
            let mut beside = *point;
            beside.0[parameter as usize] -= step;
            let found = moments_of_velocities(model, &self.structure, &beside)?;
            Some([0, 1].map(|k| (at[k] - found[k]) / step))
        };
        let determinant = match (self.pivots.mean, self.pivots.dispersion) {
            (Some(pivot), true) => {
                let (a, b) = (slope(pivot)?, slope(Parameter::Dispersion)?);
                a[0] * b[1] - a[1] * b[0]
            }
            (Some(pivot), false) => slope(pivot)?[0],
            (None, true) => slope(Parameter::Dispersion)?[1],
            (None, false) => 1.0,
        };
        (determinant != 0.0).then_some(determinant.abs())
    }

    fn is_pivot(&self, parameter: Parameter) -> bool {
        self.pivots.mean == Some(parameter)
            || self.pivots.dispersion && parameter == Parameter::Dispersion
    }
}

/// Returns the limit of a sequence of these three members whose differences fall by one factor (A. C. Aitken, Proc.
/// Royal Soc. Edinburgh 46 (1927)); the last of them if there is none.
fn limit([first, second, third]: [f64; 3]) -> f64 {
    let (step, next) = (second - first, third - second);
    let limit = third - next * next / (next - step);
    if limit.is_finite() { limit } else { third }
}

/// Returns what `compute` makes of each item and its place, in their order; several threads share the items,
/// and none changes what another computes.
fn in_parallel<T: Sync, R: Send>(items: &[T], compute: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(THREADS_MAX);
    let share = items.len().div_ceil(threads).max(1);
    let of_share = |(number, share_of): (usize, &[T])| -> Vec<R> {
        let first = number * share;
        share_of.iter().enumerate().map(|(k, item)| compute(first + k, item)).collect()
    };
    std::thread::scope(|scope| {
        let shares: Vec<_> = items.chunks(share).enumerate().collect();
        let handles: Vec<_> =
            shares.into_iter().map(|share| scope.spawn(move || of_share(share))).collect();
        let results = handles
            .into_iter()
            .map(|handle| handle.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        results.flatten().collect()
    })
}

/// Returns the compared moments of an interpolated model at a point, in logarithms.
pub(super) fn moments(
    model: &Surrogate,
    structure: &BoneStructure,
    point: &Point,
) -> Option<MomentVector> {
    with_closed_form(model.mean(&features(structure, point)?), structure, point)
}

/// Returns the moments of these deviations at a point.
fn with_closed_form(
    mut deviations: Deviations,
    structure: &BoneStructure,
    point: &Point,
) -> Option<MomentVector> {
    let closed = closed_form(structure, point)?;
    deviations.iter_mut().zip(closed).for_each(|(one, closed)| *one += closed);
    Some(deviations)
}

/// Returns ln v and ln Δ of an interpolated model at a point.
fn moments_of_velocities(
    model: &Surrogate,
    structure: &BoneStructure,
    point: &Point,
) -> Option<[f64; 2]> {
    let [mean, variation] = model.mean_of_velocities(&features(structure, point)?);
    let closed = closed_form(structure, point)?;
    Some([closed[0] + mean, closed[1] + variation])
}

/// Returns ln √(c1111/ρ) and ln δ at a point.
pub(crate) fn closed_form(structure: &BoneStructure, point: &Point) -> Option<[f64; 2]> {
    Some([structure.bulk_logarithm(point).ok()?, libm::log(point.dispersion())])
}

/// Returns how far the logarithms of both moments may reach of models with these features.
fn reach(sample: &[Features]) -> [LogSpan; 2] {
    let reach = |k: usize, of: fn(&Features) -> f64| {
        let low = sample.iter().map(of).fold(f64::INFINITY, f64::min);
        let high = sample.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        [low + REACH[k][0], high + REACH[k][1]]
    };
    [reach(0, |one| 0.5 * one[5]), reach(1, |one| one[6])]
}

fn prior_points(
    (priors, structure): (&[ParameterPrior], &BoneStructure),
    base: &Point,
    seed: u64,
    numbers: Range<u64>,
) -> Vec<Point> {
    let drawn = sobol_points(seed, u64::MAX, numbers.end);
    let point = |uniforms: &[f64; GERMS]| {
        let mut point = *base;
        for (prior, u) in priors.iter().zip(uniforms) {
            point.0[prior.parameter as usize] = prior.quantile(*u);
        }
        point
    };
    let wanted = drawn.iter().skip(numbers.start as usize);
    wanted.map(point).filter(|point| admissible(structure, point)).collect()
}
