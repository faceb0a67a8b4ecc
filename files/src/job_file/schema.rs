//! The JSON Schema of job files, by which editors complete them.

use osteon_common::array_decay::ELEMENT_LENGTH;
use osteon_common::bone::Sublayers;
use osteon_common::bone_structure::{BoneStructure, PorosityProfile};
use osteon_common::case::Setup;
use osteon_common::check::{COUNT, DECAY_ERROR, REPEATABILITY};
use osteon_common::fields::{Choice, DeclaredKey, DeclaredValue, Edge, Interval, Key, entries};
use osteon_common::job::{PosteriorSettings, PriorDistribution, RunSettings};
use osteon_common::limits::SUBLAYERS_MAX;
use osteon_common::observables::Observable;
use osteon_common::parameters::Parameter;
use osteon_common::porosity::{self, POROSITY, PorosityModel};
use osteon_common::pulse::{PulseForm, TONE_CYCLES};
use osteon_common::pulse_samples::{SAMPLES, STEP};
use osteon_common::version::VERSION;
use serde_json::{Map, Value as Json, json};

use crate::materials::Material;
use crate::{materials, pulse};

use super::csv_format::{LINES, MISSING_MAX};
use super::data_section::GROUP_COLUMNS_MAX;
use super::observables;
use super::{data_section, decays, parameters, posterior, priors};
use crate::velocities::{DecimalMark, Separator, VelocityUnit};

/// Returns the JSON Schema (draft 2020-12) of a job file in TOML or JSON, with a final newline. It
/// states names, types and ranges; relations between keys are checked when a file is read.
pub fn schema() -> String {
    let mut properties = Map::new();
    let mut setup = Setup::default();
    for (key, section) in setup.sections() {
        properties.insert(key.name.to_owned(), described(table(&entries(section)), key));
    }
    properties["probe"]["properties"][PulseForm::KEY.name] = described(pulse(), PulseForm::KEY);
    properties
        .insert(BoneStructure::KEY.name.to_owned(), described(structure(), BoneStructure::KEY));
    let data_key = Key { name: "data", meaning: "measured velocities, or their moments" };
    properties.insert(data_key.name.to_owned(), described(data(), data_key));
    let meaning = "the range of each parameter: fixed, or free between bounds";
    let ranges_key = Key { name: "parameters", meaning };
    properties.insert(ranges_key.name.to_owned(), described(ranges(), ranges_key));
    for (key, section) in RunSettings::default().sections() {
        properties.insert(key.name.to_owned(), described(table(&entries(section)), key));
    }
    properties["search"]["properties"]["priors"]["properties"] = each_parameter(prior);
    let key = PosteriorSettings::KEY;
    let settings = table(&entries(&mut PosteriorSettings::default()));
    properties.insert(key.name.to_owned(), described(settings, key));
    properties[key.name]["properties"]["priors"]["properties"] = each_parameter(posterior_prior);
    let schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        // A name by which tools keep the schemas of versions apart; nothing is at this address.
        "$id": format!("https://osteon.invalid/{VERSION}/job.schema.json"),
        "title": "Job file of osteon",
        "description": "Units are SI: m, s, kg/m³, Pa, Hz.",
        "type": "object",
        "properties": properties,
        "required": ["parameters"],
        "additionalProperties": false,
    });
    format!("{schema:#}\n")
}

fn object(properties: Json) -> Json {
    json!({ "type": "object", "properties": properties, "additionalProperties": false })
}

fn table(entries: &[DeclaredKey]) -> Json {
    let property = |entry: &DeclaredKey| (entry.key.name.to_owned(), property(entry));
    object(entries.iter().map(property).collect::<Map<_, _>>().into())
}

fn property(DeclaredKey { key, value, condition }: &DeclaredKey) -> Json {
    let mut property = match value {
        DeclaredValue::Number(default, accepted) => number(*default, accepted.interval),
        DeclaredValue::Whole(default, accepted) => json!({
            "type": "integer",
            "minimum": accepted.min,
            "maximum": accepted.max,
            "default": default,
        }),
        DeclaredValue::Boolean(default) => json!({ "type": "boolean", "default": default }),
        DeclaredValue::Choice { chosen, names } => json!({ "enum": names, "default": chosen }),
        DeclaredValue::Table(entries) => table(entries),
        DeclaredValue::List { keys, max, .. } => list(key.name, keys, *max),
        DeclaredValue::Numbers { accepted, max, .. } => {
            json!({ "type": "array", "items": number(None, *accepted), "maxItems": max })
        }
        DeclaredValue::CustomTable => object(json!({})),
    };
    let only = condition.as_ref().map(|condition| format!("only {}: ", condition.description));
    let meaning = format!("{}{}", only.unwrap_or_default(), key.meaning);
    property["description"] = plain(&meaning).into();
    property
}

/// Returns the schema of a list of tables whose numbers must all be given.
fn list(name: &str, keys: &[DeclaredKey], max: usize) -> Json {
    let mut element = table(keys);
    element["description"] = format!("one of {name}").into();
    element["required"] = keys.iter().map(|entry| entry.key.name).collect();
    for DeclaredKey { key, value, .. } in keys {
        if let DeclaredValue::Number(_, accepted) = value {
            let mut number = number(None, accepted.interval);
            number["description"] = plain(key.meaning).into();
            element["properties"][key.name] = number;
        }
    }
    json!({ "type": "array", "items": element, "minItems": 1, "maxItems": max })
}

fn number(default: Option<f64>, accepted: Interval) -> Json {
    let mut number = json!({ "type": "number" });
    let (lower, upper) = accepted.edges();
    let limits = [("minimum", "exclusiveMinimum", lower), ("maximum", "exclusiveMaximum", upper)];
    for (closed, open, edge) in limits {
        match edge {
            Edge::None => {}
            Edge::Open(limit) => number[open] = limit.into(),
            Edge::Closed(limit) => number[closed] = limit.into(),
        }
    }
    if let Some(default) = default {
        number["default"] = default.into();
    }
    number
}

fn described(schema: Json, Key { meaning, .. }: Key) -> Json {
    said_to_be(schema, meaning)
}

fn said_to_be(mut schema: Json, meaning: &str) -> Json {
    schema["description"] = plain(meaning).into();
    schema
}

fn pulse() -> Json {
    let names = PulseForm::NAMED.map(|(name, _)| name);
    let [tone, file, step, samples] = pulse::KEYS;
    let all = json!({
        "type": "array",
        "items": { "type": "number" },
        "minItems": SAMPLES.min,
        "maxItems": SAMPLES.max,
    });
    let values = [
        (tone, number(None, TONE_CYCLES)),
        (file, json!({ "type": "string" })),
        (step, number(None, STEP)),
        (samples, all),
    ];
    let properties = values.map(|(key, schema)| (key.name.to_owned(), described(schema, key)));
    let mut table = object(properties.into_iter().collect::<Map<_, _>>().into());
    table["minProperties"] = 1.into();
    json!({ "anyOf": [{ "enum": names }, table] })
}

fn structure() -> Json {
    let one = number(None, Parameter::Porosity.row().accepted);
    let mut profile = table(&entries(&mut PorosityProfile::default()));
    profile["dependentRequired"] = json!({ "surface": ["marrow"], "marrow": ["surface"] });
    let model = described(table(&entries(&mut PorosityModel::default())), PorosityModel::KEY);
    let porosity = described(json!({ "anyOf": [one, profile] }), POROSITY);
    let list = described(sublayers(), BoneStructure::SUBLAYERS);
    object(json!({
        POROSITY.name: porosity,
        PorosityModel::KEY.name: model,
        BoneStructure::SUBLAYERS.name: list,
    }))
}

fn sublayers() -> Json {
    let row =
        json!({ "type": "array", "items": { "type": "number" }, "minItems": 6, "maxItems": 6 });
    let matrix = json!({ "type": "array", "items": row, "minItems": 6, "maxItems": 6 });
    let mut properties = json!({
        "thickness": said_to_be(number(None, Sublayers::THICKNESS), "thickness, m"),
        "mandel": said_to_be(matrix, "elasticity: the Kelvin-Mandel matrix, Pa, in the order 11 22 33 23 31 12"),
        materials::KEY: said_to_be(json!({ "enum": materials::NAMES }), "name of a material"),
        POROSITY.name: said_to_be(number(None, porosity::ACCEPTED), "porosity, instead of all others"),
    });
    for parameter in Material::PARAMETERS {
        let value = number(None, parameter.row().accepted);
        properties[parameter.name()] = said_to_be(value, &meaning(parameter));
    }
    let mut element = said_to_be(object(properties), "one of sublayers");
    element["required"] = json!(["thickness"]);
    json!({ "type": "array", "items": element, "minItems": 1, "maxItems": SUBLAYERS_MAX })
}

fn data() -> Json {
    let above_zero = || json!({ "type": "number", "exclusiveMinimum": 0 });
    let list = || json!({ "type": "array", "items": above_zero() });
    let name = || json!({ "type": "string" });
    let subjects = || json!({ "type": "array", "items": { "type": "integer", "minimum": 0 } });
    let values =
        |one: Observable| json!({ "type": "array", "items": number(None, one.row().accepted) });
    let of_group = [
        (Key { name: "velocities", meaning: "velocities of the group, m/s" }, list()),
        (Key { name: "subjects", meaning: "subject of each velocity, a whole number" }, subjects()),
    ];
    let of_observables = observables::list_keys().into_iter().zip(Observable::ALL.map(values));
    let of_group = of_group.into_iter().chain(of_observables);
    let of_group = of_group.map(|(key, schema)| (key.name.to_owned(), described(schema, key)));
    let known = |schema: &dyn Fn(Parameter) -> Json| {
        Parameter::OF_SETUP.map(|parameter| (parameter.name().to_owned(), schema(parameter)))
    };
    let value = |parameter: Parameter| {
        let unit = match parameter.unit() {
            "" => String::new(),
            unit => format!(", {unit}"),
        };
        let mut value = above_zero();
        value["description"] = format!("value that is known of the group{unit}").into();
        value
    };
    let properties = of_group.chain(known(&value));
    let mut group = object(properties.collect::<Map<_, _>>().into());
    let column = |_| {
        let meaning = "name of the CSV column that holds the value for each group";
        described(name(), Key { name: "", meaning })
    };
    let columns = object(known(&column).into_iter().collect::<Map<_, _>>().into());
    group["required"] = json!(["velocities"]);
    let group = json!({ "anyOf": [list(), group] });
    let choice = |choice: &dyn Choice| json!({ "enum": choice.names(), "default": choice.name() });
    let texts = |most: usize| json!({ "type": "array", "items": name(), "maxItems": most });
    let mut group_columns = texts(GROUP_COLUMNS_MAX);
    group_columns["minItems"] = 1.into();
    let lines = || json!({ "type": "integer", "minimum": LINES.min, "maximum": LINES.max });
    // In the order of the keys.
    let of_a_file = [
        json!({ "anyOf": [name(), list()] }),
        name(),
        choice(&VelocityUnit::default()),
        choice(&Separator::default()),
        choice(&DecimalMark::default()),
        texts(MISSING_MAX),
        name(),
        lines(),
        lines(),
        json!({ "anyOf": [name(), group_columns] }),
        name(),
        name(),
    ];
    let of_groups =
        [columns, json!({ "type": "object", "additionalProperties": group }), subjects()];
    let of_moments = [
        above_zero(),
        above_zero(),
        json!({ "type": "integer", "minimum": COUNT.min, "maximum": COUNT.max }),
        number(Some(0.0), REPEATABILITY),
    ];
    let spreading = json!({ "anyOf": [{ "enum": decays::NAMES }, number(None, ELEMENT_LENGTH)] });
    let of_decays = [spreading, number(None, DECAY_ERROR)];
    let types = of_a_file.into_iter().chain(Observable::ALL.map(|_| name())).chain(of_groups);
    let types = types.chain(Observable::ALL.map(values)).chain(of_moments).chain(of_decays);
    let properties = data_section::keys().into_iter().zip(types);
    let properties = properties.map(|(key, schema)| (key.name.to_owned(), described(schema, key)));
    object(properties.collect::<Map<_, _>>().into())
}

fn each_parameter(schema: fn(Parameter) -> Json) -> Json {
    let properties =
        Parameter::ALL.map(|parameter| (parameter.name().to_owned(), schema(parameter)));
    properties.into_iter().collect::<Map<_, _>>().into()
}

fn ranges() -> Json {
    let mut ranges = object(each_parameter(range));
    let material = described(json!({ "enum": materials::NAMES }), parameters::MATERIAL);
    ranges["properties"][parameters::MATERIAL.name] = material;
    ranges["required"] = json!([Parameter::Dispersion.name()]);
    ranges
}

fn range(parameter: Parameter) -> Json {
    let value = || number(None, parameter.row().accepted);
    let bounds = json!({ "type": "array", "items": value(), "minItems": 2, "maxItems": 2 });
    let [start, bounds, fixed] = {
        let [start_key, bounds_key, fixed_key] = parameters::KEYS;
        [
            (start_key.name, described(value(), start_key)),
            (bounds_key.name, described(bounds, bounds_key)),
            (fixed_key.name, described(value(), fixed_key)),
        ]
    };
    let range = if parameter.of_setup().is_some() {
        let mut range = object(json!({ start.0: start.1, bounds.0: bounds.1 }));
        range["required"] = json!([bounds.0]);
        range
    } else {
        // With a material, `bounds` alone are enough.
        let required = [json!({ "required": [bounds.0] }), json!({ "required": [fixed.0] })];
        let mut range = object(json!({ start.0: start.1, bounds.0: bounds.1, fixed.0: fixed.1 }));
        range["oneOf"] = required.to_vec().into();
        range
    };
    said_to_be(range, &meaning(parameter))
}

fn prior(parameter: Parameter) -> Json {
    let [value, weight] = priors::KEYS;
    let properties = json!({
        value.name: described(number(None, parameter.row().accepted), value),
        weight.name: described(number(None, Interval::above(0.0, "")), weight),
    });
    let mut prior = object(properties);
    prior["required"] = json!([value.name, weight.name]);
    said_to_be(prior, &meaning(parameter))
}

fn posterior_prior(parameter: Parameter) -> Json {
    let [distribution, center, spread] = posterior::KEYS;
    let names = PriorDistribution::ALL.map(PriorDistribution::name);
    let properties = json!({
        distribution.name: described(json!({ "enum": names }), distribution),
        center.name: described(json!({ "type": "number" }), center),
        spread.name: described(number(None, Interval::above(0.0, "")), spread),
    });
    let mut prior = object(properties);
    prior["required"] = json!([distribution.name]);
    said_to_be(prior, &meaning(parameter))
}

/// Returns what a parameter is, with its unit.
fn meaning(parameter: Parameter) -> String {
    match parameter.unit() {
        "" => parameter.row().meaning.to_owned(),
        unit => format!("{}, {unit}", parameter.row().meaning),
    }
}

/// Returns Markdown as plain text: links without their targets, code without its marks.
fn plain(markdown: &str) -> String {
    let mut text = String::new();
    let mut rest = markdown;
    while let Some((before, (label, after))) = rest.split_once('[').and_then(|(before, link)| {
        let (label, after) = link.split_once("](")?;
        Some((before, (label, after.split_once(')')?.1)))
    }) {
        text.push_str(before);
        text.push_str(label);
        rest = after;
    }
    text.push_str(rest);
    text.replace('`', "")
}
