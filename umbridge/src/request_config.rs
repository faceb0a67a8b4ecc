//! `config` of a request: settings that replace those of the job.

use serde_json::Value;

use super::input_space::InputScale;
use super::model::ServedModel;
use super::protocol_error::{ProtocolError, quoted};

/// Settings of one request.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct RequestConfig {
    /// Seed of the germs.
    pub(super) seed: Option<u64>,
    /// Number of realizations.
    pub(super) realizations: Option<u64>,
    /// What the entries of the input are.
    pub(super) inputs: Option<InputScale>,
    /// Name of the group whose data are meant.
    pub(super) group: Option<String>,
}

impl RequestConfig {
    /// Reads the configuration of a request to a model. An empty list is none, as some clients write an
    /// empty object.
    ///
    /// # Errors
    /// If a key is unknown, of no use for the model, or has another value than those allowed.
    pub(super) fn read(model: ServedModel, value: Option<&Value>) -> Result<Self, ProtocolError> {
        let mut config = Self::default();
        let fields = match value {
            None | Some(Value::Null) => return Ok(config),
            Some(Value::Array(list)) if list.is_empty() => return Ok(config),
            Some(Value::Object(fields)) => fields,
            Some(_) => return Err(ProtocolError::input("config is not an object")),
        };
        let known = keys(model);
        for (key, value) in fields {
            if !known.contains(&key.as_str()) {
                let message = format!(
                    "config.{} is not a key of the model {:?}; its keys are: {}",
                    quoted(key),
                    model.name(),
                    known.join(", ")
                );
                return Err(ProtocolError::input(message));
            }
            match key.as_str() {
                "seed" => config.seed = Some(whole(key, value)?),
                "realizations" => config.realizations = Some(whole(key, value)?),
                "inputs" => config.inputs = Some(scale(model, value)?),
                _ => config.group = Some(text(key, value)?.to_owned()),
            }
        }
        Ok(config)
    }
}

/// Returns the keys that a model has.
fn keys(model: ServedModel) -> &'static [&'static str] {
    match model {
        ServedModel::Forward | ServedModel::ForwardSi => &["seed", "realizations"],
        ServedModel::Velocity => &["inputs"],
        ServedModel::Posterior => &["seed", "realizations", "inputs", "group"],
    }
}

fn scale(model: ServedModel, value: &Value) -> Result<InputScale, ProtocolError> {
    let name = text("inputs", value)?;
    let allowed = InputScale::ALL
        .into_iter()
        .filter(|scale| model == ServedModel::Posterior || *scale != InputScale::Bounds);
    let found = allowed.clone().find(|scale| scale.name() == name);
    found.ok_or_else(|| {
        let names: Vec<String> = allowed.map(|scale| format!("{:?}", scale.name())).collect();
        ProtocolError::input(format!(
            "config.inputs is {}; it must be {}",
            quoted(name),
            names.join(" or ")
        ))
    })
}

fn whole(key: &str, value: &Value) -> Result<u64, ProtocolError> {
    // MATLAB has only floating-point numbers, and writes whole ones like integers up to 1e15.
    value.as_u64().ok_or_else(|| {
        ProtocolError::input(format!("config.{key} is not a whole number of at least 0"))
    })
}

fn text<'a>(key: &str, value: &'a Value) -> Result<&'a str, ProtocolError> {
    value.as_str().ok_or_else(|| ProtocolError::input(format!("config.{key} is not a text")))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_model_has_the_keys_that_it_can_use() {
        let read = |model, value: Value| {
            RequestConfig::read(model, Some(&value)).map_err(|error| error.message)
        };
        for none in [json!({}), json!([]), Value::Null] {
            assert_eq!(read(ServedModel::Forward, none), Ok(RequestConfig::default()));
        }
        let all = json!({"seed": 7, "realizations": 20, "inputs": "bounds", "group": "left"});
        let expected = RequestConfig {
            seed: Some(7),
            realizations: Some(20),
            inputs: Some(InputScale::Bounds),
            group: Some("left".to_owned()),
        };
        assert_eq!(read(ServedModel::Posterior, all), Ok(expected));
        for (model, config, expected) in [
            (
                ServedModel::Forward,
                json!({"level": 1}),
                "config.\"level\" is not a key of the model \"forward\"; its keys are: seed, realizations",
            ),
            (ServedModel::Velocity, json!({"seed": 1}), "its keys are: inputs"),
            (
                ServedModel::Velocity,
                json!({"inputs": "bounds"}),
                "it must be \"multiples\" or \"si\"",
            ),
            (ServedModel::Posterior, json!({"inputs": 1}), "config.inputs is not a text"),
            (ServedModel::Posterior, json!({"seed": -1}), "config.seed is not a whole number"),
            (
                ServedModel::Posterior,
                json!({"realizations": 2.5}),
                "config.realizations is not a whole",
            ),
            (ServedModel::Posterior, json!("seed"), "config is not an object"),
        ] {
            let message = read(model, config).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}
