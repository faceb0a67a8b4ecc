//! Rules on comments: everything has one, numbers name their unit, calls their errors.

use std::collections::BTreeMap;

use prost_types::field_descriptor_proto::Type;
use prost_types::{DescriptorProto, EnumDescriptorProto, FileDescriptorProto};
use tonic::Code;

use crate::{Findings, full_name};

/// Words of which the comment of a number has one. Names of units, or what stands for one.
const UNITS: [&str; 12] =
    ["m", "s", "rad", "Hz", "N", "Pa", "m/s", "kg/m³", "1/s", "dB/cm", "dimensionless", "unit"];

// Numbers of fields in descriptors, of which the paths of comments are made.
const FILE_MESSAGE: i32 = 4;
const FILE_ENUM: i32 = 5;
const FILE_SERVICE: i32 = 6;
const MESSAGE_FIELD: i32 = 2;
const MESSAGE_NESTED: i32 = 3;
const MESSAGE_ENUM: i32 = 4;
const MESSAGE_ONEOF: i32 = 8;
const ENUM_VALUE: i32 = 2;
const SERVICE_METHOD: i32 = 2;

/// The comments before the declarations of a file, by path.
struct Comments<'f>(BTreeMap<&'f [i32], &'f str>);

impl<'f> Comments<'f> {
    fn of(file: &'f FileDescriptorProto) -> Self {
        let locations = file.source_code_info.iter().flat_map(|info| &info.location);
        Self(locations.map(|at| (at.path.as_slice(), at.leading_comments())).collect())
    }

    /// Demands the comment at `path`; the comment.
    fn demand(&self, path: &[i32], rule: &'static str, place: &str, to: &mut Findings) -> &'f str {
        let comment = self.0.get(path).copied().unwrap_or_default().trim();
        to.demand(!comment.is_empty(), rule, place, "have a comment before it");
        comment
    }
}

/// Rules on everything that a file declares.
pub(crate) fn file(file: &FileDescriptorProto, findings: &mut Findings) {
    let comments = Comments::of(file);
    for (index, declared) in numbered(&file.message_type) {
        let place = full_name(file, declared.name());
        message(&place, &[FILE_MESSAGE, index], declared, &comments, findings);
    }
    for (index, declared) in numbered(&file.enum_type) {
        let place = full_name(file, declared.name());
        enumeration(&place, &[FILE_ENUM, index], declared, &comments, findings);
    }
    for (index, service) in numbered(&file.service) {
        let place = full_name(file, service.name());
        let path = [FILE_SERVICE, index];
        comments.demand(&path, "COMMENT_SERVICE", &place, findings);
        for (index, method) in numbered(&service.method) {
            let place = format!("{place}.{}", method.name());
            let path = below(&path, SERVICE_METHOD, index);
            let comment = comments.demand(&path, "COMMENT_RPC", &place, findings);
            let told = words(comment).any(is_code);
            findings.demand(told, "RPC_ERRORS", &place, "say which status codes it ends with");
        }
    }
}

fn message(
    place: &str,
    path: &[i32],
    message: &DescriptorProto,
    comments: &Comments<'_>,
    findings: &mut Findings,
) {
    comments.demand(path, "COMMENT_MESSAGE", place, findings);
    for (index, field) in numbered(&message.field) {
        let place = format!("{place}.{}", field.name());
        let path = below(path, MESSAGE_FIELD, index);
        let comment = comments.demand(&path, "COMMENT_FIELD", &place, findings);
        if matches!(field.r#type(), Type::Double | Type::Float) {
            let has_unit = words(comment).any(|word| UNITS.contains(&word));
            findings.demand(has_unit, "FIELD_UNIT", &place, "name its unit, or `dimensionless`");
        }
    }
    // Those of optional fields stand nowhere.
    let oneofs = numbered(&message.oneof_decl);
    for (index, oneof) in oneofs.filter(|(_, oneof)| !oneof.name().starts_with('_')) {
        let place = format!("{place}.{}", oneof.name());
        comments.demand(&below(path, MESSAGE_ONEOF, index), "COMMENT_ONEOF", &place, findings);
    }
    for (index, nested) in numbered(&message.nested_type) {
        let place = format!("{place}.{}", nested.name());
        self::message(&place, &below(path, MESSAGE_NESTED, index), nested, comments, findings);
    }
    for (index, declared) in numbered(&message.enum_type) {
        let place = format!("{place}.{}", declared.name());
        enumeration(&place, &below(path, MESSAGE_ENUM, index), declared, comments, findings);
    }
}

fn enumeration(
    place: &str,
    path: &[i32],
    declared: &EnumDescriptorProto,
    comments: &Comments<'_>,
    findings: &mut Findings,
) {
    comments.demand(path, "COMMENT_ENUM", place, findings);
    for (index, value) in numbered(&declared.value) {
        let place = format!("{place}.{}", value.name());
        comments.demand(&below(path, ENUM_VALUE, index), "COMMENT_ENUM_VALUE", &place, findings);
    }
}

/// Whether a word is the name of a gRPC status code, e.g. `NOT_FOUND`.
fn is_code(word: &str) -> bool {
    let camel = |name: &str| -> String {
        let words = name.split('_').map(|word| {
            let (first, rest) = word.split_at(word.len().min(1));
            format!("{first}{}", rest.to_ascii_lowercase())
        });
        words.collect()
    };
    let upper = !word.is_empty() && word.chars().all(|c| c.is_ascii_uppercase() || c == '_');
    upper && (1..=16).any(|code| format!("{:?}", Code::from_i32(code)) == camel(word))
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c.is_whitespace() || ",.;:()`'".contains(c))
}

fn below(path: &[i32], field: i32, index: i32) -> Vec<i32> {
    [path, &[field, index]].concat()
}

fn numbered<T>(items: &[T]) -> impl Iterator<Item = (i32, &T)> {
    (0..).zip(items)
}
