//! The JSON Schema of `result.json`.

use osteon_common::outcome::FailureKind;
use osteon_common::parameters::Parameter;
use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform as _};
use serde_json::{Value, json};

use super::Document;

/// The JSON Schema (draft 2020-12) of `result.json` of every kind, with a final newline.
pub fn schema() -> String {
    let generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
    let mut schema = generator.into_root_schema_for::<Document<'static>>();
    RecursiveTransform(unwrap_description).transform(&mut schema);
    format!("{:#}\n", schema.as_value())
}

/// Takes the line breaks of the source out of a description.
fn unwrap_description(schema: &mut Schema) {
    if let Some(Value::String(text)) = schema.get_mut("description") {
        *text = text.replace('\n', " ");
    }
}

/// Names the keys of an object that has an entry for each of some parameters.
pub(super) fn keyed_by_parameter(schema: &mut Schema) {
    let names = Parameter::ALL.map(Parameter::name);
    schema.insert("propertyNames".to_owned(), json!({ "enum": names }));
}

/// Names the keys of an object that has an entry for each of some kinds of failure.
pub(super) fn keyed_by_failure(schema: &mut Schema) {
    let names = FailureKind::ALL.map(FailureKind::name);
    schema.insert("propertyNames".to_owned(), json!({ "enum": names }));
}
