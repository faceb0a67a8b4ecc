//! Rules on files, packages, imports and calls.

use std::collections::BTreeMap;

use prost_types::{DescriptorProto, FileDescriptorProto, FileDescriptorSet};

use crate::names::{is_lower_snake, is_pascal};
use crate::{Findings, full_name};

/// Rules on one file.
pub(crate) fn file(file: &FileDescriptorProto, set: &FileDescriptorSet, findings: &mut Findings) {
    let (name, package) = (file.name(), file.package());
    let mut demand = |holds, rule, message: &str| findings.demand(holds, rule, name, message);
    demand(file.syntax() == "proto3", "SYNTAX_SPECIFIED", "begin with syntax = \"proto3\"");
    demand(!package.is_empty(), "PACKAGE_DEFINED", "name a package");
    let (directory, base) = name.rsplit_once('/').unwrap_or(("", name));
    let expected = package.replace('.', "/");
    demand(directory == expected, "PACKAGE_DIRECTORY_MATCH", "lie in the package's directory");
    let base = base.strip_suffix(".proto").unwrap_or_default();
    demand(is_lower_snake(base), "FILE_LOWER_SNAKE_CASE", "be in lower_snake_case");
    let parts: Vec<&str> = package.split('.').collect();
    let lower = parts.iter().all(|part| is_lower_snake(part));
    demand(lower, "PACKAGE_LOWER_SNAKE_CASE", "have a package in lower_snake_case");
    let version = parts.last().and_then(|part| part.strip_prefix('v'));
    let versioned = version.is_some_and(|number| number.parse().is_ok_and(|n: u32| n > 0));
    demand(versioned, "PACKAGE_VERSION_SUFFIX", "have a package that ends in its version");
    demand(file.public_dependency.is_empty(), "IMPORT_NO_PUBLIC", "have no public import");
    demand(file.weak_dependency.is_empty(), "IMPORT_NO_WEAK", "have no weak import");
    let used = used_types(file);
    for import in &file.dependency {
        let Some(imported) = set.file.iter().find(|file| file.name() == import) else { continue };
        let mut types = declared_types(imported);
        let is_used = types.any(|name| used.iter().any(|used| used.starts_with(&name)));
        demand(is_used, "IMPORT_USED", &format!("not import {import}, of which it uses nothing"));
    }
}

/// Rules on calls, over all files.
pub(crate) fn calls(set: &FileDescriptorSet, findings: &mut Findings) {
    let mut users: BTreeMap<String, u32> = BTreeMap::new();
    let methods = || {
        let services = set.file.iter().flat_map(|file| {
            file.service.iter().map(move |service| (full_name(file, service.name()), service))
        });
        services.flat_map(|(place, service)| {
            service.method.iter().map(move |method| (place.clone(), service.name(), method))
        })
    };
    for (_, _, method) in methods() {
        for message in [method.input_type(), method.output_type()] {
            *users.entry(message.to_owned()).or_default() += 1;
        }
    }
    for (service_place, service, method) in methods() {
        let (name, place) = (method.name(), format!("{service_place}.{}", method.name()));
        let mut demand = |holds, rule, message: &str| findings.demand(holds, rule, &place, message);
        demand(is_pascal(name), "RPC_PASCAL_CASE", "be in PascalCase");
        let pascal: String = name.split('_').map(capitalized).collect();
        for (rule, message, suffix) in [
            ("RPC_REQUEST_STANDARD_NAME", method.input_type(), "Request"),
            ("RPC_RESPONSE_STANDARD_NAME", method.output_type(), "Response"),
        ] {
            let last = message.rsplit('.').next().unwrap_or_default();
            let standard = [format!("{pascal}{suffix}"), format!("{service}{pascal}{suffix}")];
            let text = format!("have a message {}", standard.join(" or "));
            demand(standard.iter().any(|name| name == last), rule, &text);
        }
        let unique =
            [method.input_type(), method.output_type()].iter().all(|name| users[*name] == 1);
        demand(unique, "RPC_REQUEST_RESPONSE_UNIQUE", "share its messages with no other call");
    }
}

fn capitalized(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map(|first| first.to_ascii_uppercase()).into_iter().chain(letters).collect()
}

/// Full names of all types that a file's fields and calls have.
fn used_types(file: &FileDescriptorProto) -> Vec<String> {
    fn of_message(message: &DescriptorProto, used: &mut Vec<String>) {
        used.extend(message.field.iter().map(|field| field.type_name().to_owned()));
        message.nested_type.iter().for_each(|nested| of_message(nested, used));
    }
    let mut used = Vec::new();
    file.message_type.iter().for_each(|message| of_message(message, &mut used));
    for method in file.service.iter().flat_map(|service| &service.method) {
        used.extend([method.input_type().to_owned(), method.output_type().to_owned()]);
    }
    used
}

/// Full names of the outermost types of a file.
fn declared_types(file: &FileDescriptorProto) -> impl Iterator<Item = String> {
    let messages = file.message_type.iter().map(|message| message.name());
    let names = messages.chain(file.enum_type.iter().map(|declared| declared.name()));
    names.map(|name| format!(".{}", full_name(file, name)))
}
