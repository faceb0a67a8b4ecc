//! The fields of a request's body.

use serde_json::{Map, Value};

use super::protocol_error::ProtocolError;

/// The body of a request, whose fields are read one by one.
#[derive(Debug, Clone)]
pub(super) struct RequestFields(Map<String, Value>);

impl RequestFields {
    /// Parses a body, whatever its content type is said to be.
    ///
    /// # Errors
    /// If it is not a JSON object.
    pub(super) fn parse(body: &[u8]) -> Result<Self, ProtocolError> {
        match serde_json::from_slice(body) {
            Ok(Value::Object(fields)) => Ok(Self(fields)),
            Ok(_) => Err(ProtocolError::input(
                "the body is not a JSON object; it must be one, with the model's name as \"name\"",
            )),
            Err(error) => Err(ProtocolError::input(format!(
                "the body is not JSON: {error} (JSON has no NaN and no Infinity)"
            ))),
        }
    }

    /// Returns the name of the model.
    ///
    /// # Errors
    /// If there is none.
    pub(super) fn name(&self) -> Result<&str, ProtocolError> {
        let name = self.0.get("name").and_then(Value::as_str);
        name.ok_or_else(|| {
            ProtocolError::input("name is missing; it must be a text, the name of a model")
        })
    }

    /// Returns the configuration, if there is one.
    pub(super) fn config(&self) -> Option<&Value> {
        self.0.get("config")
    }

    /// Returns the only vector of `input`, of `size` numbers. Where a list of one is meant, a bare
    /// number does.
    ///
    /// # Errors
    /// If it has another shape.
    pub(super) fn input(&self, size: usize) -> Result<Vec<f64>, ProtocolError> {
        let wanted = format!("it must be a list of one list of {size} numbers, [[…]]");
        let given = self.0.get("input");
        let given =
            given.ok_or_else(|| ProtocolError::input(format!("input is missing; {wanted}")))?;
        let vector = match given {
            Value::Array(vectors) => match vectors.as_slice() {
                [vector] => vector,
                _ => {
                    let count = vectors.len();
                    let message = format!("input has {count} entries; {wanted}");
                    return Err(ProtocolError::input(message));
                }
            },
            number => number,
        };
        numbers("input[0]", vector, size)
    }

    /// Returns a vector of `size` numbers, or a bare number if that is one.
    ///
    /// # Errors
    /// If it is missing, or has another shape.
    pub(super) fn vector(&self, name: &str, size: usize) -> Result<Vec<f64>, ProtocolError> {
        match self.0.get(name) {
            Some(value) => numbers(name, value, size),
            None => Err(ProtocolError::input(format!(
                "{name} is missing; it must be a list of {size} numbers"
            ))),
        }
    }

    /// Checks the index of the only input or output.
    ///
    /// # Errors
    /// If it is missing, or is not 0.
    pub(super) fn only_index(&self, name: &str) -> Result<(), ProtocolError> {
        match self.0.get(name) {
            Some(value) if value.as_f64() == Some(0.0) => Ok(()),
            Some(value @ Value::Number(_)) => Err(ProtocolError::input(format!(
                "{name} is {value}; it must be 0, as every model has one input vector and one \
                 output vector, and indices begin at 0"
            ))),
            Some(_) => Err(ProtocolError::input(format!("{name} is not a number; it must be 0"))),
            None => Err(ProtocolError::input(format!("{name} is missing; it must be 0"))),
        }
    }
}

fn numbers(name: &str, value: &Value, size: usize) -> Result<Vec<f64>, ProtocolError> {
    let values = match value {
        Value::Array(values) => values.as_slice(),
        number => std::slice::from_ref(number),
    };
    if values.len() != size {
        let length = values.len();
        let message = format!("{name} has the length {length}; it must have the length {size}");
        return Err(ProtocolError::input(message));
    }
    let number = |(k, value): (usize, &Value)| {
        value.as_f64().ok_or_else(|| {
            let found = match value {
                Value::Array(_) => "a list",
                Value::Object(_) => "an object",
                Value::String(_) => "a text",
                Value::Null => "null",
                Value::Bool(_) | Value::Number(_) => "no number",
            };
            ProtocolError::input(format!("{name}[{k}] is {found}; it must be a number"))
        })
    };
    values.iter().enumerate().map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(body: &str) -> RequestFields {
        RequestFields::parse(body.as_bytes()).unwrap()
    }

    #[test]
    fn vectors_are_read_in_every_shape_that_clients_send() {
        let input = |body: &str, size| fields(body).input(size).map_err(|error| error.message);
        assert_eq!(input(r#"{"input": [[1, 2.5]]}"#, 2), Ok(vec![1.0, 2.5]));
        for one in ["[[3]]", "[3]", "3"] {
            assert_eq!(input(&format!(r#"{{"input": {one}}}"#), 1), Ok(vec![3.0]), "{one}");
        }
        for (body, expected) in [
            ("{}", "input is missing; it must be a list of one list of 2 numbers"),
            (r#"{"input": [1, 2]}"#, "input has 2 entries; it must be a list of one list"),
            (r#"{"input": []}"#, "input has 0 entries"),
            (r#"{"input": [[1, 2, 3]]}"#, "input[0] has the length 3; it must have the length 2"),
            (r#"{"input": [[1, [2]]]}"#, "input[0][1] is a list; it must be a number"),
            (r#"{"input": [[1, null]]}"#, "input[0][1] is null"),
            (r#"{"input": [["1", 2]]}"#, "input[0][0] is a text"),
            (r#"{"input": "x"}"#, "input[0] has the length 1"),
        ] {
            let message = input(body, 2).unwrap_err();
            assert!(message.starts_with(expected), "{body}: {message}");
        }
    }

    #[test]
    fn only_the_first_index_exists() {
        let index = |value: &str| {
            let body = format!(r#"{{"inWrt": {value}}}"#);
            fields(&body).only_index("inWrt").map_err(|error| error.message)
        };
        assert_eq!(index("0"), Ok(()));
        assert_eq!(index("0.0"), Ok(()));
        assert!(index("1").unwrap_err().contains("indices begin at 0"));
        assert!(index("-1").unwrap_err().starts_with("inWrt is -1; it must be 0"));
        assert!(index("\"0\"").unwrap_err().starts_with("inWrt is not a number"));
        assert!(fields("{}").only_index("inWrt").is_err());
    }

    #[test]
    fn a_body_that_is_no_object_is_refused() {
        for (body, expected) in [
            ("", "the body is not JSON"),
            ("[1]", "the body is not a JSON object"),
            ("{\"input\": [[NaN]]}", "JSON has no NaN"),
            ("{\"input\": [[1e999]]}", "number out of range"),
        ] {
            let message = RequestFields::parse(body.as_bytes()).unwrap_err().message;
            assert!(message.contains(expected), "{body}: {message}");
        }
        let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
        assert!(RequestFields::parse(deep.as_bytes()).is_err());
        assert!(fields("{}").name().is_err());
        assert!(fields(r#"{"name": 1}"#).name().is_err());
    }
}
