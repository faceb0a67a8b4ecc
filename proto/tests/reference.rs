//! docs/grpc-reference.md, which is made from the comments of `osteon/v1/*.proto`.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::{env, fs};

use osteon_proto::v1::FILE_DESCRIPTOR_SET;
use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, FieldDescriptorProto, FileDescriptorProto,
    FileDescriptorSet, MethodDescriptorProto,
};

const HEAD: &str = "\
<!-- Written by `cargo xtask generate reference`; do not edit. -->

# gRPC: services and messages

All that the files `proto/osteon/v1/*.proto` declare, with their comments. [grpc.md](grpc.md) shows a client. A field's
number follows its type.
";

// Numbers of fields in descriptors, of which the paths of comments are made.
const FILE_MESSAGE: i32 = 4;
const FILE_ENUM: i32 = 5;
const FILE_SERVICE: i32 = 6;
/// The fields of a message, the values of an enumeration, or the methods of a service.
const PART: i32 = 2;
const MESSAGE_NESTED: i32 = 3;
const MESSAGE_ENUM: i32 = 4;

/// The comments before the declarations of a file, by path, each as one line of Markdown.
struct CommentLines(BTreeMap<Vec<i32>, String>);

impl CommentLines {
    fn of(file: &FileDescriptorProto) -> Self {
        let locations = file.source_code_info.iter().flat_map(|info| &info.location);
        let line = |text: &str| {
            let words: Vec<_> = text.split_whitespace().collect();
            words.join(" ").replace('<', "\\<").replace('*', "\\*")
        };
        Self(locations.map(|at| (at.path.clone(), line(at.leading_comments()))).collect())
    }

    fn at(&self, path: &[i32]) -> &str {
        self.0.get(path).map(String::as_str).unwrap_or_default()
    }
}

/// `OSTEON_WRITE_DOCS=1` writes the page instead.
#[test]
fn the_page_of_messages_is_that_of_the_files() {
    let set = FileDescriptorSet::decode(FILE_DESCRIPTOR_SET).unwrap();
    let mut page = HEAD.to_owned();
    for name in ["jobs", "specification", "results", "workers"] {
        let name = format!("osteon/v1/{name}.proto");
        file(&mut page, set.file.iter().find(|file| file.name() == name).unwrap());
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/grpc-reference.md");
    if env::var_os("OSTEON_WRITE_DOCS").is_some() {
        fs::write(&path, &page).unwrap();
    }
    let committed = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == page,
        "docs/grpc-reference.md is stale; `cargo xtask generate reference` writes it"
    );
}

fn file(page: &mut String, file: &FileDescriptorProto) {
    let comments = CommentLines::of(file);
    writeln!(page, "\n## `{}`", file.name()).unwrap();
    for (index, service) in (0..).zip(&file.service) {
        let path = [FILE_SERVICE, index];
        writeln!(page, "\n### Service `{}`\n\n{}\n", service.name(), comments.at(&path)).unwrap();
        for (index, method) in (0..).zip(&service.method) {
            let comment = comments.at(&[&path[..], &[PART, index]].concat());
            let call = call(method);
            writeln!(page, "- **{}** ({call}): {comment}", method.name()).unwrap();
        }
    }
    for (index, declared) in (0..).zip(&file.message_type) {
        message(page, declared, "", &[FILE_MESSAGE, index], &comments);
    }
    for (index, declared) in (0..).zip(&file.enum_type) {
        enumeration(page, declared, "", &[FILE_ENUM, index], &comments);
    }
}

fn call(method: &MethodDescriptorProto) -> String {
    let streamed = |name: &str, is_stream: bool| {
        let name = short(name);
        if is_stream { format!("stream of `{name}`") } else { format!("`{name}`") }
    };
    let asked = streamed(method.input_type(), method.client_streaming());
    format!("{asked} → {}", streamed(method.output_type(), method.server_streaming()))
}

fn message(
    page: &mut String,
    declared: &DescriptorProto,
    within: &str,
    path: &[i32],
    comments: &CommentLines,
) {
    let name = format!("{within}{}", declared.name());
    writeln!(page, "\n### `{name}`\n\n{}", comments.at(path)).unwrap();
    for (index, field) in (0..).zip(&declared.field) {
        let comment = comments.at(&[path, &[PART, index]].concat());
        let begin = if index == 0 { "\n" } else { "" };
        let kind = kind(field);
        writeln!(page, "{begin}- `{}` ({kind}, {}): {comment}", field.name(), field.number())
            .unwrap();
    }
    for (index, nested) in (0..).zip(&declared.nested_type) {
        let is_map = nested.options.as_ref().is_some_and(|options| options.map_entry());
        if !is_map {
            let path = [path, &[MESSAGE_NESTED, index]].concat();
            message(page, nested, &format!("{name}."), &path, comments);
        }
    }
    for (index, nested) in (0..).zip(&declared.enum_type) {
        let path = [path, &[MESSAGE_ENUM, index]].concat();
        enumeration(page, nested, &format!("{name}."), &path, comments);
    }
}

fn enumeration(
    page: &mut String,
    declared: &EnumDescriptorProto,
    within: &str,
    path: &[i32],
    comments: &CommentLines,
) {
    let name = declared.name();
    writeln!(page, "\n### `{within}{name}`\n\n{}\n", comments.at(path)).unwrap();
    for (index, value) in (0..).zip(&declared.value) {
        let comment = comments.at(&[path, &[PART, index]].concat());
        writeln!(page, "- `{}` ({}): {comment}", value.name(), value.number()).unwrap();
    }
}

fn kind(field: &FieldDescriptorProto) -> String {
    let one = match field.r#type() {
        Type::Message | Type::Enum | Type::Group => format!("`{}`", short(field.type_name())),
        scalar => scalar.as_str_name().trim_start_matches("TYPE_").to_lowercase(),
    };
    match (field.label(), field.proto3_optional()) {
        (Label::Repeated, _) => format!("repeated {one}"),
        (_, true) => format!("optional {one}"),
        _ => one,
    }
}

/// Returns the last part of a full name.
fn short(name: &str) -> &str {
    name.strip_prefix(".osteon.v1.").unwrap_or(name.trim_start_matches('.'))
}
