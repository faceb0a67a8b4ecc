//! Canonical TOML of cases and jobs: every key with its value, in the shortest decimals that read
//! back to the same bits.

use std::fmt::{self, Write as _};

use osteon_common::bone::{Bone, CaseBone, Sublayer};
use osteon_common::bone_structure::{BoneStructure, MeanSolid, MeanSublayer};
use osteon_common::case::{Case, Setup};
use osteon_common::elasticity::Elasticity;
use osteon_common::field_path::entry_path;
use osteon_common::fields::{DeclaredKey, DeclaredValue, Key, Section, entries};
use osteon_common::group_settings::GroupSettings;
use osteon_common::job::{
    Data, Group, JobSpecification, Measurements, PosteriorSettings, Prior, Range, Search,
};
use osteon_common::observables::ObservedColumns;
use osteon_common::parameters::Parameter;
use osteon_common::porosity::{POROSITY, PorosityModel};
use osteon_common::pulse::PulseForm;
use osteon_common::setup_quantity::SetupQuantity;
use osteon_common::signal_layout::SignalLayout;
use osteon_common::wave_settings::WaveSettings;

use crate::job_file::decays;
use crate::probe_file::{ProbeDescription, SIGNALS};

/// Number of velocities per line of an inlined data set.
const NUMBERS_PER_LINE: usize = 6;

/// Returns the complete case file of `case`, with `mandel`.
///
/// Reading it gives `case` back to the bit, if it passes [`osteon_common::check::setup`] and its density is
/// finite and above 0.
pub fn case(case: &Case) -> String {
    written(|out| {
        let sublayers = match &case.bone {
            CaseBone::Homogeneous(bone) => {
                setup(out, &case.setup, &[])?;
                writeln!(out, "\n[bone]")?;
                return solid(out, bone);
            }
            CaseBone::Layered(sublayers) => sublayers,
        };
        setup(out, &case.setup, &[SetupQuantity::BoneThickness.mean_key()])?;
        sublayers.iter().try_for_each(|Sublayer { thickness, solid: own }| {
            sublayer(out, *thickness)?;
            solid(out, own)
        })
    })
}

/// Returns the complete job file of `specification`, with defaults filled in and data inlined.
///
/// Reading it as the same kind of job gives `specification` back to the bit, if it passes
/// [`JobSpecification::check`].
pub fn job(specification: &JobSpecification) -> String {
    written(|out| {
        let bone = &specification.setup.structure;
        let whole = [SetupQuantity::BoneThickness.mean_key()];
        setup(out, &specification.setup, if bone.is_layered() { &whole } else { &[] })?;
        structure(out, bone)?;
        if let Some(given) = &specification.data {
            data(out, given)?;
        }
        for parameter in specification.parameters_ranged() {
            range(out, parameter, specification.range(parameter))?;
        }
        run(out, specification)
    })
}

/// Returns the complete probe file of a description.
///
/// Reading it gives the description back to the bit, if it passes its checks.
pub fn probe(description: &ProbeDescription) -> String {
    written(|out| {
        setup(out, &description.setup, &[])?;
        let SignalLayout { axes, transmitters, .. } = &description.signals;
        writeln!(out)?;
        section(out, SIGNALS, &mut description.signals.clone())?;
        let names = |names: Vec<&str>| format!("{names:?}");
        if !axes.is_empty() {
            let axes = axes.iter().map(|axis| axis.name()).collect();
            writeln!(out, "{} = {}", SignalLayout::AXES.name, names(axes))?;
        }
        let transmitters = transmitters.iter().map(|one| one.name()).collect();
        writeln!(out, "{} = {}", SignalLayout::TRANSMITTERS.name, names(transmitters))?;
        if description.waves == WaveSettings::default() {
            return Ok(());
        }
        writeln!(out)?;
        section(out, WaveSettings::KEY, &mut description.waves.clone())
    })
}

fn written(write: impl FnOnce(&mut String) -> fmt::Result) -> String {
    let mut out = String::new();
    // Writing to a string fails only if a value's own formatting does, and none here does.
    let _infallible = write(&mut out);
    out
}

/// Writes the sections of a setup without the keys with these paths.
fn setup(out: &mut String, setup: &Setup, left_out: &[&str]) -> fmt::Result {
    let mut setup = setup.clone();
    let pulse_form = setup.probe.pulse.clone();
    for (index, (key, declared)) in setup.sections().into_iter().enumerate() {
        if index > 0 {
            writeln!(out)?;
        }
        let mut entries = entries(declared);
        leave_out(&mut entries, key.name, left_out);
        write_entries(out, key, &entries)?;
        if key.name == "probe" {
            pulse(out, &pulse_form)?;
        }
    }
    Ok(())
}

/// Writes the form of a pulse.
fn pulse(out: &mut String, form: &PulseForm) -> fmt::Result {
    write!(out, "{} = ", PulseForm::KEY.name)?;
    match form {
        PulseForm::Tone { cycles } => writeln!(out, "{{ tone = {cycles:?} }}  # cycles"),
        PulseForm::Samples(samples) => {
            let (step, values) = (samples.step(), samples.values());
            writeln!(out, "{{ step = {step:?}, samples = {values:?} }}  # s")
        }
        PulseForm::Paper | PulseForm::Ricker => {
            let named = PulseForm::NAMED.iter().find(|(_, named)| named == form);
            writeln!(out, "\"{}\"", named.map_or("", |(name, _)| name))
        }
    }
}

/// Writes the section of a job's pores or sublayers, if there are any.
fn structure(out: &mut String, structure: &BoneStructure) -> fmt::Result {
    if !structure.is_given() {
        return Ok(());
    }
    let (mut profile, mut model) = (structure.profile.clone(), structure.model);
    let porosity = match structure.porosity {
        Some(porosity) => Some(format!("{porosity:?}")),
        None => inline_table(&entries(&mut profile)).filter(|_| !structure.is_layered()),
    };
    let model = inline_table(&entries(&mut model)).filter(|_| structure.has_pores());
    writeln!(out, "\n[{}]", BoneStructure::KEY.name)?;
    for (key, text) in [(POROSITY, porosity), (PorosityModel::KEY, model)] {
        text.map_or(Ok(()), |text| writeln!(out, "{} = {text}", key.name))?;
    }
    structure.sublayers.iter().try_for_each(|MeanSublayer { thickness, solid: mean }| {
        sublayer(out, *thickness)?;
        match mean {
            MeanSolid::Porous(porosity) => writeln!(out, "{} = {porosity:?}", POROSITY.name),
            MeanSolid::Given(bone) => solid(out, bone),
        }
    })
}

/// Writes the head of a sublayer, and its thickness.
fn sublayer(out: &mut String, thickness: f64) -> fmt::Result {
    writeln!(out, "\n[[bone.sublayers]]\nthickness = {thickness:?}  # m")
}

/// Removes the keys with these paths from the entries of a table.
fn leave_out(entries: &mut Vec<DeclaredKey>, table: &str, paths: &[&str]) {
    entries.retain_mut(|entry| {
        let path = entry_path(table, entry.key.name);
        if let DeclaredValue::Table(entries) = &mut entry.value {
            leave_out(entries, &path, paths);
        }
        !paths.contains(&path.as_str())
    });
}

/// Writes a section: each key on a line, with its unit as a comment.
fn section(out: &mut String, key: Key, section: &mut dyn Section) -> fmt::Result {
    write_entries(out, key, &entries(section))
}

fn write_entries(out: &mut String, key: Key, entries: &[DeclaredKey]) -> fmt::Result {
    writeln!(out, "[{}]", key.name)?;
    for entry in entries.iter().filter(|entry| entry.applies()) {
        let Some(value) = value(&entry.value) else { continue };
        write!(out, "{} = {value}", entry.key.name)?;
        let mut units = Vec::new();
        units_of(&entry.value, &mut units);
        if units.is_empty() { writeln!(out)? } else { writeln!(out, "  # {}", units.join(", "))? }
    }
    Ok(())
}

/// Returns the text of a value; `None` if it is absent or written elsewhere.
pub(crate) fn value(value: &DeclaredValue) -> Option<String> {
    Some(match value {
        DeclaredValue::Number(number, _) => format!("{:?}", (*number)?),
        DeclaredValue::Whole(whole, _) => whole.to_string(),
        DeclaredValue::Boolean(truth) => truth.to_string(),
        DeclaredValue::Choice { chosen, .. } => format!("\"{chosen}\""),
        DeclaredValue::Table(entries) => return inline_table(entries),
        DeclaredValue::List { elements, .. } if elements.is_empty() => return None,
        DeclaredValue::List { elements, .. } => {
            let elements = elements.iter().filter_map(|entries| inline_table(entries));
            format!("[{}]", elements.collect::<Vec<_>>().join(", "))
        }
        DeclaredValue::Numbers { values, .. } if values.is_empty() => return None,
        DeclaredValue::Numbers { values, .. } => format!("{values:?}"),
        DeclaredValue::CustomTable => return None,
    })
}

/// Returns a table on one line; `None` if all its keys are absent.
fn inline_table(entries: &[DeclaredKey]) -> Option<String> {
    let keys = entries.iter().filter(|entry| entry.applies());
    let keys = keys.filter_map(|entry| Some((entry.key.name, value(&entry.value)?)));
    let keys: Vec<_> = keys.map(|(name, value)| format!("{name} = {value}")).collect();
    (!keys.is_empty()).then(|| format!("{{ {} }}", keys.join(", ")))
}

/// Adds the units of a value, each once.
fn units_of(value: &DeclaredValue, units: &mut Vec<&'static str>) {
    match value {
        DeclaredValue::Number(Some(_), accepted) => {
            let unit = accepted.interval.unit();
            if !unit.is_empty() && !units.contains(&unit) {
                units.push(unit);
            }
        }
        DeclaredValue::Table(entries) => {
            let entries = entries.iter().filter(|entry| entry.applies());
            entries.for_each(|entry| units_of(&entry.value, units));
        }
        DeclaredValue::List { elements, .. } => {
            elements.iter().flatten().for_each(|entry| units_of(&entry.value, units));
        }
        _ => {}
    }
}

/// Writes the keys of a solid.
fn solid(out: &mut String, solid: &Bone) -> fmt::Result {
    writeln!(out, "density = {:?}  # kg/m³", solid.density)?;
    mandel(out, &solid.elasticity)
}

fn mandel(out: &mut String, elasticity: &Elasticity) -> fmt::Result {
    writeln!(out, "mandel = [  # Pa, Kelvin-Mandel, order 11 22 33 23 31 12")?;
    for row in elasticity.rows() {
        writeln!(out, "    {row:?},")?;
    }
    writeln!(out, "]")
}

fn data(out: &mut String, data: &Data) -> fmt::Result {
    let repeatability = data.repeatability;
    let of_decays = decays::to_toml(data);
    if !data.is_grouped() || repeatability != 0.0 || !of_decays.is_empty() {
        writeln!(out, "\n[data]  # m/s")?;
    }
    match &data.measurements {
        Measurements::Velocities { velocities: measured, subjects, observables } => {
            set(out, measured, subjects.as_deref(), observables)?;
        }
        Measurements::Groups(_) => {}
        Measurements::Moments { mean, coefficient_of_variation, count } => {
            writeln!(out, "mean = {mean:?}")?;
            writeln!(out, "coefficient_of_variation = {coefficient_of_variation:?}")?;
            if let Some(count) = count {
                writeln!(out, "count = {count}")?;
            }
        }
    }
    if repeatability != 0.0 {
        writeln!(out, "repeatability = {repeatability:?}")?;
    }
    out.push_str(&of_decays);
    if data.is_grouped() { groups(out, data.groups()) } else { Ok(()) }
}

/// Writes groups in their order: as lists of one table, or, if any has more than velocities, each as a
/// table.
fn groups(out: &mut String, groups: &[Group]) -> fmt::Result {
    let has_more = |group: &Group| {
        group.subjects.is_some() || !group.observables.which().is_empty() || !group.known.is_empty()
    };
    if groups.iter().any(has_more) {
        return groups.iter().try_for_each(|group| {
            writeln!(out, "\n[data.groups.{}]  # m/s", quoted(&group.name))?;
            for (parameter, value) in group.known.given() {
                write!(out, "{} = {value:?}", parameter.name())?;
                match parameter.unit() {
                    "" => writeln!(out)?,
                    unit => writeln!(out, "  # {unit}")?,
                }
            }
            set(out, &group.velocities, group.subjects.as_deref(), &group.observables)
        });
    }
    writeln!(out, "\n[data.groups]  # m/s")?;
    groups.iter().try_for_each(|group| list(out, &quoted(&group.name), &group.velocities))
}

fn set(
    out: &mut String,
    velocities: &[f64],
    subjects: Option<&[u32]>,
    observables: &ObservedColumns,
) -> fmt::Result {
    list(out, "velocities", velocities)?;
    subjects.map_or(Ok(()), |subjects| list(out, "subjects", subjects))?;
    // A table of groups has the unit of velocities in its head.
    observables.present().try_for_each(|(observable, values)| {
        writeln!(out, "# {}", observable.row().unit)?;
        list(out, observable.row().plural, values)
    })
}

fn list(out: &mut String, key: &str, numbers: &[impl fmt::Debug]) -> fmt::Result {
    writeln!(out, "{key} = [")?;
    for line in numbers.chunks(NUMBERS_PER_LINE) {
        let line: Vec<_> = line.iter().map(|number| format!("{number:?}")).collect();
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
    // Most data are not grouped, and then its key means nothing.
    let is_unused =
        |key: Key| key == GroupSettings::KEY && specification.groups == GroupSettings::default();
    for (key, declared) in specification.run_settings().sections() {
        if is_unused(key) {
            continue;
        }
        writeln!(out)?;
        section(out, key, declared)?;
    }
    priors(out, &specification.search)?;
    specification.posterior.map_or(Ok(()), |settings| posterior(out, settings))
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

fn posterior(out: &mut String, mut settings: PosteriorSettings) -> fmt::Result {
    writeln!(out)?;
    section(out, PosteriorSettings::KEY, &mut settings)?;
    for (parameter, prior) in Parameter::ALL.iter().zip(settings.priors) {
        if let Some([center, spread]) = prior.numbers() {
            writeln!(out, "\n[posterior.priors.{}]", parameter.name())?;
            writeln!(out, "distribution = \"{}\"", prior.distribution().name())?;
            writeln!(out, "center = {center:?}\nspread = {spread:?}")?;
        }
    }
    Ok(())
}
