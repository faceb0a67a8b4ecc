//! Both methods on bones of sublayers: random solids, pores, fluids, probes and pulses.

use osteon_common::bone::{CaseBone, Sublayer, Sublayers};
use osteon_common::case::{Case, Setup};
use osteon_common::check;
use osteon_common::fluid_sublayers::{FluidSublayer, FluidSublayers};
use osteon_common::layers::Fluid;
use osteon_common::porosity::{BoneMatrix, PorosityModel};
use osteon_common::probe::{Probe, Receivers, Source};
use osteon_common::pulse::PulseForm;
use osteon_common::realization::{Ensemble, PointError};
use osteon_common::settings::{Extremum, Method, SolverSettings};
use osteon_common::violations::Violations;
use osteon_solver::check::{Difference, difference};
use osteon_solver::{Arrival, Failure, Isa, Solver, Workspace};

use crate::blocks::{FinishedBlock, in_blocks};
use crate::draws::Draws;
use crate::generator::Generator;
use crate::setups::point;
use crate::spread::{DifferenceSummary, keeps_stated_errors};
use crate::table::{MarkdownTable, percent, two_digits};
use crate::{RowCallback, StudyError};

/// Default number of stacks.
pub const REALIZATIONS: u64 = 300;
/// Refinements of the exact and of the hybrid method in each row, and the agreement that is wanted.
const ROWS: [([f64; 2], f64); 2] = [([1.0, 1.0], 1e-4), ([3.0, 2.0], 1e-5)];
/// Largest number of sublayers of a stack.
const SUBLAYERS: f64 = 8.0;
/// Maximum number of attempts to draw an admissible stack.
const TRIES_MAX: usize = 1000;

/// Solutions of one stack by both methods, for each of [`ROWS`].
struct Solutions {
    index: u64,
    case: Case,
    pairs: [[Result<Arrival, Failure>; 2]; ROWS.len()],
}

/// Returns the relative differences of the exact method's and the hybrid method's velocities for stacks of 2
/// to 8 sublayers, at default settings and refined; a difference is kept if it is not larger than the errors
/// that both state. A stack on which they agree less well than wanted is reported individually.
///
/// # Errors
/// If a mean model or dispersion has no ensemble.
pub fn table(draws: &Draws, progress: RowCallback<'_>) -> Result<MarkdownTable, StudyError> {
    let mut solved = Vec::new();
    let solve = |index| case(draws.seed, index).map(|found| Some(solve(index, found?, draws.isa)));
    for block in in_blocks(draws.realizations, solve) {
        let FinishedBlock { done, found } = block?;
        found.iter().flat_map(describe).for_each(|line| progress(&line));
        progress(&format!("{done} stacks"));
        solved.extend(found);
    }
    let mut table = MarkdownTable::new(&[
        "refinement, exact",
        "hybrid",
        "stacks",
        "with velocities",
        "other outcome",
        "median difference",
        "99 %",
        "largest",
        "wanted",
        "within (%)",
        "kept (%)",
    ]);
    for (row, ([exact, hybrid], wanted)) in ROWS.into_iter().enumerate() {
        let differences: Vec<_> =
            solved.iter().map(|one| compare(&one.case, &one.pairs[row])).collect();
        let spread = DifferenceSummary::new(&differences);
        let errors: Vec<f64> = differences.iter().filter_map(|one| one.velocity()).collect();
        let within = errors.iter().filter(|&&error| error <= wanted).count();
        let mut cells = vec![exact.to_string(), hybrid.to_string(), solved.len().to_string()];
        cells.extend([errors.len().to_string(), spread.different_picks.to_string()]);
        cells.extend([0.5, 0.99, 1.0].map(|p| two_digits(spread.velocity(p))));
        let kept = solved.iter().filter(|one| one.keeps_stated_errors(row)).count();
        cells.push(format!("{wanted:e}"));
        cells.extend([within, kept].map(|count| percent(count as u64, errors.len() as u64)));
        table.push(cells);
    }
    Ok(table)
}

fn solve(index: u64, case: Case, isa: Isa) -> Solutions {
    let mut workspace = Workspace::default();
    let pairs = ROWS.map(|(refinements, _)| pair(&case, refinements, isa, &mut workspace));
    Solutions { index, case, pairs }
}

/// Returns the solutions of the exact and of the hybrid method at these refinements.
fn pair(
    case: &Case,
    [exact, hybrid]: [f64; 2],
    isa: Isa,
    workspace: &mut Workspace,
) -> [Result<Arrival, Failure>; 2] {
    [(Method::Exact, exact), (Method::Hybrid, hybrid)].map(|(method, refinement)| {
        let solver = SolverSettings { method, refinement, ..case.setup.solver };
        let setup = Setup { solver, ..case.setup.clone() };
        Solver::with_isa(&setup, isa).arrival(&case.bone, workspace)
    })
}

impl Solutions {
    /// Returns whether both methods have a velocity in a row, and these differ by no more than both state.
    fn keeps_stated_errors(&self, row: usize) -> bool {
        let [exact, hybrid] = &self.pairs[row];
        let difference = compare(&self.case, &self.pairs[row]);
        keeps_stated_errors(difference, [exact, hybrid]) == Some(true)
    }
}

fn compare(case: &Case, [exact, hybrid]: &[Result<Arrival, Failure>; 2]) -> Difference {
    difference(&case.setup, hybrid, exact)
}

/// Returns a line for each row in which the methods agree less well than wanted.
fn describe(one: &Solutions) -> Vec<String> {
    let outcome = |outcome: &Result<Arrival, Failure>| match outcome {
        Ok(arrival) => format!("{:.3} m/s (± {:.0e})", arrival.velocity, arrival.estimated_error),
        Err(failure) => failure.kind.name().to_owned(),
    };
    let mut lines = Vec::new();
    for (pair, ([_, refinement], wanted)) in one.pairs.iter().zip(ROWS) {
        let difference = compare(&one.case, pair);
        let is_close = difference.velocity().is_some_and(|error| error <= wanted);
        if is_close || difference == Difference::BothFailed {
            continue;
        }
        let [exact, hybrid] = [0, 1].map(|method| outcome(&pair[method]));
        let setup = &one.case.setup;
        lines.push(format!(
            "stack {}: {exact} exactly, {hybrid} by the hybrid method at refinement {refinement} ({:?}); \
             {:.2} mm, {:.2} MHz",
            one.index,
            difference,
            setup.layers.bone_thickness * 1e3,
            setup.probe.center_frequency / 1e6,
        ));
    }
    lines
}

/// Returns stack `index` of the study; `None` if no admissible one was drawn.
fn case(seed: u64, index: u64) -> Result<Option<Case>, PointError> {
    let mut generator = Generator::for_index(seed, index);
    for _ in 0..TRIES_MAX {
        let Some(sublayers) = sublayers(&mut generator, seed, index)? else { continue };
        let setup = setup(&mut generator, sublayers.thickness());
        let mut violations = Violations::new();
        check::setup(&setup, &mut violations);
        if violations.is_empty() {
            return Ok(Some(Case { setup, bone: CaseBone::Layered(sublayers) }));
        }
    }
    Ok(None)
}

/// Each sublayer is porous, or has any constants.
fn sublayers(
    generator: &mut Generator,
    seed: u64,
    index: u64,
) -> Result<Option<Sublayers>, PointError> {
    let whole = generator.decades(1e-3, 6e-3);
    let count = generator.between(2.0, SUBLAYERS + 1.0) as u64;
    let shares: Vec<f64> = (0..count).map(|_| generator.between(0.3, 1.0)).collect();
    let sum: f64 = shares.iter().sum();
    let mut all = Vec::new();
    for (place, share) in (0..count).zip(shares) {
        let porosity = generator.between(0.01, 0.4);
        let solid = if generator.uniform() < 0.5 {
            PorosityModel::default().bone(&BoneMatrix::default(), porosity).ok()
        } else {
            Ensemble::new(&point(generator), seed)?.bone(SUBLAYERS as u64 * index + place).ok()
        };
        let Some(solid) = solid else { return Ok(None) };
        all.push(Sublayer { thickness: whole * share / sum, solid });
    }
    Ok(Sublayers::new(&all))
}

fn setup(generator: &mut Generator, bone_thickness: f64) -> Setup {
    let mut setup = Setup::default();
    setup.layers.bone_thickness = bone_thickness;
    for layer in [&mut setup.layers.coupling, &mut setup.layers.marrow] {
        draw_fluids(layer, generator);
    }
    let mut draw = |from, to| generator.between(from, to);
    setup.probe = Probe {
        center_frequency: draw(0.5e6, 1.5e6),
        source: Source { x1: 0.0, x3: draw(0.5e-3, 4e-3) },
        receivers: Receivers {
            first_x1: draw(12e-3, 18e-3),
            pitch: draw(0.8e-3, 1.4e-3),
            count: draw(8.0, 16.0) as u32,
            x3: draw(0.5e-3, 4e-3),
        },
        ..Probe::default()
    };
    let mut is_drawn = |share| generator.uniform() < share;
    setup.probe.bidirectional = is_drawn(0.3);
    if is_drawn(0.3) {
        setup.picking.extremum = Extremum::Second;
    }
    if is_drawn(0.3) {
        setup.probe.element_width = 0.4e-3;
    }
    if is_drawn(0.15) {
        setup.probe.pulse = PulseForm::Ricker;
    }
    setup
}

/// Changes a layer to one, two or three fluids.
fn draw_fluids(layer: &mut Fluid, generator: &mut Generator) {
    let mut draw = |from, to| generator.between(from, to);
    let count = draw(1.0, 4.0) as usize;
    let mut fluid = || FluidSublayer {
        thickness: draw(1.5e-3, 6e-3),
        density: draw(800.0, 1300.0),
        sound_speed: draw(1300.0, 1700.0),
    };
    if count == 1 {
        let FluidSublayer { thickness, density, sound_speed } = fluid();
        *layer = Fluid { thickness, density, sound_speed, ..*layer };
    } else {
        let all: Vec<FluidSublayer> = (0..count).map(|_| fluid()).collect();
        layer.sublayers = FluidSublayers::new(&all).unwrap_or_default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stack_follows_from_seed_and_index() {
        for index in 0..20 {
            let one = case(1, index).unwrap().unwrap();
            assert_eq!(case(1, index).unwrap().unwrap(), one);
            assert_ne!(case(2, index).unwrap().unwrap(), one);
            assert_ne!(case(1, index + 1).unwrap().unwrap(), one);
        }
    }

    #[test]
    fn both_methods_agree_on_a_random_stack() {
        let ([(refinements, wanted), _], index) = (ROWS, 1);
        let case = case(1, index).unwrap().unwrap();
        let pair = pair(&case, refinements, Isa::fastest(), &mut Workspace::default());
        let found = compare(&case, &pair).velocity().unwrap();
        assert!(found <= wanted, "{found:e}");
        let solved = Solutions { index, case, pairs: [pair.clone(), pair] };
        assert!(solved.keeps_stated_errors(0));
        // The refined row wants more than the default one has.
        assert!(describe(&solved).len() <= 1);
    }
}
