//! Rules on names.

use prost_types::{DescriptorProto, EnumDescriptorProto, FileDescriptorProto};

use crate::{Findings, full_name};

/// Rules on everything that a file names.
pub(crate) fn file(file: &FileDescriptorProto, findings: &mut Findings) {
    for declared in &file.message_type {
        message(&full_name(file, declared.name()), declared, findings);
    }
    for declared in &file.enum_type {
        enumeration(&full_name(file, declared.name()), declared, findings);
    }
    for service in &file.service {
        let (name, place) = (service.name(), full_name(file, service.name()));
        findings.demand(is_pascal(name), "SERVICE_PASCAL_CASE", &place, "be in PascalCase");
        let suffix = name.ends_with("Service");
        findings.demand(suffix, "SERVICE_SUFFIX", &place, "end in Service");
    }
}

/// Whether a name is in `lower_snake_case`.
pub(crate) fn is_lower_snake(name: &str) -> bool {
    let letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
    name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.split('_').all(|word| !word.is_empty() && word.chars().all(letter))
}

/// Whether a name is in `PascalCase`.
pub(crate) fn is_pascal(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_uppercase())
        && name.chars().all(|c| c.is_ascii_alphanumeric())
}

fn message(place: &str, message: &DescriptorProto, findings: &mut Findings) {
    let pascal = is_pascal(message.name());
    findings.demand(pascal, "MESSAGE_PASCAL_CASE", place, "be in PascalCase");
    for field in &message.field {
        let (name, place) = (field.name(), format!("{place}.{}", field.name()));
        let lower = is_lower_snake(name);
        findings.demand(lower, "FIELD_LOWER_SNAKE_CASE", &place, "be in lower_snake_case");
    }
    // Those of optional fields have names of their own.
    for oneof in message.oneof_decl.iter().filter(|oneof| !oneof.name().starts_with('_')) {
        let (name, place) = (oneof.name(), format!("{place}.{}", oneof.name()));
        let lower = is_lower_snake(name);
        findings.demand(lower, "ONEOF_LOWER_SNAKE_CASE", &place, "be in lower_snake_case");
    }
    for nested in &message.nested_type {
        self::message(&format!("{place}.{}", nested.name()), nested, findings);
    }
    for declared in &message.enum_type {
        enumeration(&format!("{place}.{}", declared.name()), declared, findings);
    }
}

fn enumeration(place: &str, declared: &EnumDescriptorProto, findings: &mut Findings) {
    let name = declared.name();
    findings.demand(is_pascal(name), "ENUM_PASCAL_CASE", place, "be in PascalCase");
    let alias = declared.options.as_ref().is_some_and(|options| options.allow_alias());
    findings.demand(!alias, "ENUM_NO_ALLOW_ALIAS", place, "not allow aliases");
    let first = declared.value.first().map_or(0, |value| value.number());
    findings.demand(first == 0, "ENUM_FIRST_VALUE_ZERO", place, "begin with 0");
    let prefix = upper_snake(name) + "_";
    for value in &declared.value {
        let (name, place) = (value.name(), format!("{place}.{}", value.name()));
        let mut demand = |holds, rule, message: &str| findings.demand(holds, rule, &place, message);
        let upper = name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_');
        demand(upper, "ENUM_VALUE_UPPER_SNAKE_CASE", "be in UPPER_SNAKE_CASE");
        demand(name.starts_with(&prefix), "ENUM_VALUE_PREFIX", &format!("begin with {prefix}"));
        let suffix = value.number() != 0 || name.ends_with("_UNSPECIFIED");
        demand(suffix, "ENUM_ZERO_VALUE_SUFFIX", "end in _UNSPECIFIED");
    }
}

/// `JobState` as `JOB_STATE`.
fn upper_snake(pascal: &str) -> String {
    let mut snake = String::new();
    for (at, letter) in pascal.chars().enumerate() {
        if at > 0 && letter.is_ascii_uppercase() && !snake.ends_with('_') {
            snake.push('_');
        }
        snake.push(letter.to_ascii_uppercase());
    }
    snake
}
