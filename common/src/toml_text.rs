//! Canonical TOML of cases and jobs: every key with its value, in the shortest decimals that read
//! back to the same bits.

use std::fmt::{self, Write as _};

use crate::case::{Case, Setup};
use crate::elasticity::Elasticity;
use crate::job::{Data, JobSpecification, Prior, Range, Search};
use crate::layers::Fluid;
use crate::parameters::Parameter;
use crate::settings::{Method, SolverSettings};

/// Number of velocities per line of an inlined data set.
const VELOCITIES_PER_LINE: usize = 6;

/// Returns the complete case file of `case`, with `mandel`.
///
/// Reading it gives `case` back to the bit, if it passes [`crate::check::setup`] and its density is
/// finite and above 0.
pub fn case(case: &Case) -> String {
    written(|out| {
        setup(out, &case.setup)?;
        writeln!(out, "\n[bone]\ndensity = {:?}  # kg/m³", case.bone.density)?;
        mandel(out, &case.bone.elasticity)
    })
}

/// Returns the complete job file of `specification`, with defaults filled in and data inlined.
///
/// Reading it as the same kind of job gives `specification` back to the bit, if it passes
/// [`JobSpecification::check`].
pub fn job(specification: &JobSpecification) -> String {
    written(|out| {
        setup(out, &specification.setup)?;
        if let Some(given) = &specification.data {
            data(out, given)?;
        }
        for parameter in Parameter::ALL {
            range(out, parameter, specification.range(parameter))?;
        }
        run(out, specification)
    })
}

fn written(write: impl FnOnce(&mut String) -> fmt::Result) -> String {
    let mut out = String::new();
    // Writing to a string fails only if a value's own formatting does, and none here does.
    let _infallible = write(&mut out);
    out
}

fn setup(out: &mut String, setup: &Setup) -> fmt::Result {
    let (layers, probe) = (&setup.layers, &setup.probe);
    let (source, receivers) = (&probe.source, &probe.receivers);
    writeln!(out, "[layers]  # thickness m, density kg/m³, sound speed m/s")?;
    fluid(out, "coupling", &layers.coupling)?;
    writeln!(out, "bone = {{ thickness = {:?} }}", layers.bone_thickness)?;
    fluid(out, "marrow", &layers.marrow)?;
    writeln!(out, "\n[probe]  # m, Hz, N")?;
    writeln!(out, "center_frequency = {:?}", probe.center_frequency)?;
    writeln!(out, "amplitude = {:?}", probe.amplitude)?;
    writeln!(out, "source = {{ x1 = {:?}, x3 = {:?} }}", source.x1, source.x3)?;
    writeln!(
        out,
        "receivers = {{ first_x1 = {:?}, pitch = {:?}, count = {}, x3 = {:?} }}",
        receivers.first_x1, receivers.pitch, receivers.count, receivers.x3
    )?;
    writeln!(out, "\n[picking]")?;
    writeln!(out, "extremum = \"{}\"", setup.picking.extremum.name())?;
    writeln!(out, "threshold = {:?}  # of the packet's peak", setup.picking.threshold)?;
    solver(out, &setup.solver)
}

fn solver(out: &mut String, solver: &SolverSettings) -> fmt::Result {
    writeln!(out, "\n[solver]")?;
    writeln!(out, "method = \"{}\"", solver.method.name())?;
    writeln!(out, "refinement = {:?}", solver.refinement)?;
    if solver.method == Method::Hybrid {
        writeln!(out, "element_size = {:?}  # m", solver.element_size)?;
        writeln!(out, "element_order = {}", solver.element_order)?;
        if let Some(time_step) = solver.time_step {
            writeln!(out, "time_step = {time_step:?}  # s")?;
        }
    }
    Ok(())
}

fn fluid(out: &mut String, key: &str, fluid: &Fluid) -> fmt::Result {
    let Fluid { thickness, density, sound_speed } = fluid;
    writeln!(
        out,
        "{key} = {{ thickness = {thickness:?}, density = {density:?}, sound_speed = {sound_speed:?} }}"
    )
}

fn mandel(out: &mut String, elasticity: &Elasticity) -> fmt::Result {
    writeln!(out, "mandel = [  # Pa, Kelvin-Mandel, order 11 22 33 23 31 12")?;
    for row in elasticity.rows() {
        writeln!(out, "    {row:?},")?;
    }
    writeln!(out, "]")
}

fn data(out: &mut String, data: &Data) -> fmt::Result {
    match data {
        Data::Groups(_) => writeln!(out, "\n[data.groups]  # m/s")?,
        Data::Velocities(_) | Data::Moments { .. } => writeln!(out, "\n[data]  # m/s")?,
    }
    match data {
        Data::Velocities(measured) => velocities(out, "velocities", measured),
        Data::Groups(groups) => groups
            .iter()
            .try_for_each(|group| velocities(out, &quoted(&group.name), &group.velocities)),
        Data::Moments { mean, coefficient_of_variation } => {
            writeln!(out, "mean = {mean:?}")?;
            writeln!(out, "coefficient_of_variation = {coefficient_of_variation:?}")
        }
    }
}

fn velocities(out: &mut String, key: &str, velocities: &[f64]) -> fmt::Result {
    writeln!(out, "{key} = [")?;
    for line in velocities.chunks(VELOCITIES_PER_LINE) {
        let line: Vec<_> = line.iter().map(|velocity| format!("{velocity:?}")).collect();
        writeln!(out, "    {},", line.join(", "))?;
    }
    writeln!(out, "]")
}

/// Returns a name as a quoted key; it contains no control characters.
fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
}

fn range(out: &mut String, parameter: Parameter, range: Range) -> fmt::Result {
    write!(out, "\n[parameters.{}]", parameter.name())?;
    match parameter.unit() {
        "" => writeln!(out)?,
        unit => writeln!(out, "  # {unit}")?,
    }
    match range {
        Range::Fixed(value) => writeln!(out, "fixed = {value:?}"),
        Range::Free { start, lower, upper } => {
            writeln!(out, "start = {start:?}\nbounds = [{lower:?}, {upper:?}]")
        }
    }
}

fn run(out: &mut String, specification: &JobSpecification) -> fmt::Result {
    let (monte_carlo, search) = (&specification.monte_carlo, &specification.search);
    writeln!(out, "\n[monte_carlo]")?;
    writeln!(out, "realizations = {}", monte_carlo.realizations)?;
    writeln!(out, "seed = {}", monte_carlo.seed)?;
    writeln!(out, "sampling = \"{}\"", monte_carlo.sampling.name())?;
    writeln!(out, "scrambles = {}", monte_carlo.scrambles)?;
    writeln!(out, "control_variate = {}", monte_carlo.control_variate)?;
    writeln!(out, "max_failed_fraction = {:?}", monte_carlo.max_failed_fraction)?;
    writeln!(out, "\n[objective]")?;
    writeln!(out, "kind = \"{}\"", specification.objective.name())?;
    writeln!(out, "\n[search]  # size and step as fractions of the box")?;
    writeln!(out, "method = \"{}\"", search.method.name())?;
    writeln!(out, "max_evaluations = {}", search.max_evaluations)?;
    writeln!(out, "cost_tolerance = {:?}", search.cost_tolerance)?;
    writeln!(out, "size_tolerance = {:?}", search.size_tolerance)?;
    writeln!(out, "initial_step = {:?}", search.initial_step)?;
    writeln!(out, "starts = {}", search.starts)?;
    writeln!(out, "sensitivities = {}", search.sensitivities)?;
    priors(out, search)
}

fn priors(out: &mut String, search: &Search) -> fmt::Result {
    for (parameter, prior) in Parameter::ALL.iter().zip(&search.priors) {
        if let Some(Prior { value, weight }) = prior {
            writeln!(out, "\n[search.priors.{}]", parameter.name())?;
            writeln!(out, "value = {value:?}\nweight = {weight:?}")?;
        }
    }
    Ok(())
}
