//! Messages of the sections of a job: each field of a message is the key of the same name.
//!
//! The conversion follows from the keys that a section declares and from the descriptors of the
//! messages, so that a new key needs no code here.

use std::sync::LazyLock;

use osteon_common::field_path::element_path;
use osteon_common::fields::{
    self, Choice, Condition, DeclaredKey, DeclaredValue, Fields, Interval, Key, List, Number,
    Section, Whole, WholeRange,
};
use osteon_common::violations::Violations;
use prost::{Message, Name};
use prost_reflect::{
    DescriptorPool, DynamicMessage, EnumDescriptor, FieldDescriptor, Kind, MessageDescriptor,
    ReflectMessage, Value as FieldValue,
};

use crate::v1;

/// Returns the message of a section. Every key is present that is meaningful with the values of the
/// section and has a value.
pub(crate) fn to_message<M: Message + Name + Default>(section: &mut dyn Section) -> M {
    let mut message = DynamicMessage::new(descriptor::<M>());
    fill(&mut message, &fields::entries(section));
    transcoded(&message)
}

/// Sets the keys of `section`, the table `name` of a job, to the fields of `message`. A key whose
/// field is absent keeps its value; numbers are not checked here. Unknown enumeration values, and
/// fields that are not meaningful with other ones, are added to `violations`.
pub(crate) fn from_message<M: Message + Name>(
    name: &str,
    message: &M,
    section: &mut dyn Section,
    violations: &mut Violations,
) {
    let mut dynamic = DynamicMessage::new(descriptor::<M>());
    if let Err(error) = dynamic.transcode_from(message) {
        return violations.add(name, error.to_string());
    }
    section.declare(&mut MessageReader { path: name.to_owned(), message: dynamic, violations });
}

static POOL: LazyLock<DescriptorPool> = LazyLock::new(|| {
    // Only damaged descriptors are refused, and these were compiled into the program.
    DescriptorPool::decode(v1::FILE_DESCRIPTOR_SET).unwrap_or_default()
});

#[expect(clippy::expect_used, reason = "every message type of the package has a descriptor")]
fn descriptor<M: Name>() -> MessageDescriptor {
    POOL.get_message_by_name(&M::full_name()).expect("the message is in the descriptor set")
}

#[expect(clippy::expect_used, reason = "the message was built by the descriptor of its type")]
fn transcoded<M: Message + Default>(message: &DynamicMessage) -> M {
    message.transcode_to().expect("the message has its own type")
}

fn fill(message: &mut DynamicMessage, entries: &[DeclaredKey]) {
    for entry in entries.iter().filter(|entry| entry.applies()) {
        let Some(field) = message.descriptor().get_field_by_name(entry.key.name) else { continue };
        if let Some(value) = field_value(&field, &entry.value) {
            message.set_field(&field, value);
        }
    }
}

fn field_value(field: &FieldDescriptor, value: &DeclaredValue) -> Option<FieldValue> {
    Some(match (value, field.kind()) {
        (DeclaredValue::Number(number, _), _) => FieldValue::F64((*number)?),
        (DeclaredValue::Whole(whole, _), Kind::Uint32) => {
            FieldValue::U32(u32::try_from(*whole).unwrap_or(u32::MAX))
        }
        (DeclaredValue::Whole(whole, _), _) => FieldValue::U64(*whole),
        (DeclaredValue::Boolean(truth), _) => FieldValue::Bool(*truth),
        (DeclaredValue::Choice { chosen, .. }, Kind::Enum(names)) => {
            let found = names.values().find(|value| short_name(&names, value.name()) == *chosen)?;
            FieldValue::EnumNumber(found.number())
        }
        (DeclaredValue::Table(entries), Kind::Message(descriptor)) => {
            let mut message = DynamicMessage::new(descriptor);
            fill(&mut message, entries);
            FieldValue::Message(message)
        }
        (DeclaredValue::List { elements, .. }, Kind::Message(descriptor)) => {
            let message = |entries: &Vec<DeclaredKey>| {
                let mut message = DynamicMessage::new(descriptor.clone());
                fill(&mut message, entries);
                FieldValue::Message(message)
            };
            FieldValue::List(elements.iter().map(message).collect())
        }
        (DeclaredValue::Numbers { values, .. }, _) => {
            FieldValue::List(values.iter().copied().map(FieldValue::F64).collect())
        }
        (
            DeclaredValue::Choice { .. }
            | DeclaredValue::Table(_)
            | DeclaredValue::List { .. }
            | DeclaredValue::CustomTable,
            _,
        ) => return None,
    })
}

/// Returns the name of an enumeration's value in a file, e.g. `monte_carlo` of
/// `SAMPLING_MONTE_CARLO`: without the prefix that it shares with the unspecified value.
fn short_name(names: &EnumDescriptor, name: &str) -> String {
    let unspecified = names.default_value();
    let prefix = unspecified.name().strip_suffix("UNSPECIFIED").unwrap_or_default();
    name.strip_prefix(prefix).unwrap_or(name).to_lowercase()
}

struct MessageReader<'v> {
    path: String,
    message: DynamicMessage,
    violations: &'v mut Violations,
}

impl MessageReader<'_> {
    /// Returns the field of a key; `None` if it is absent.
    fn get(&self, key: &str) -> Option<(FieldDescriptor, FieldValue)> {
        let field = self.message.descriptor().get_field_by_name(key)?;
        let present = self.message.has_field(&field);
        present.then(|| (field.clone(), self.message.get_field(&field).into_owned()))
    }

    fn path(&self, key: &str) -> String {
        format!("{}.{key}", self.path)
    }
}

impl Fields for MessageReader<'_> {
    fn number(&mut self, key: Key, field: &mut f64, _: Number) {
        if let Some(number) = self.get(key.name).and_then(|(_, value)| value.as_f64()) {
            *field = number;
        }
    }

    fn optional_number(&mut self, key: Key, field: &mut Option<f64>, _: Number) {
        *field = self.get(key.name).and_then(|(_, value)| value.as_f64()).or(*field);
    }

    fn whole(&mut self, key: Key, field: &mut dyn Whole, _: WholeRange) {
        let value = self.get(key.name).map(|(_, value)| value);
        if let Some(whole) =
            value.and_then(|value| value.as_u64().or(value.as_u32().map(u64::from)))
        {
            field.set(whole);
        }
    }

    fn boolean(&mut self, key: Key, field: &mut bool) {
        if let Some(truth) = self.get(key.name).and_then(|(_, value)| value.as_bool()) {
            *field = truth;
        }
    }

    fn choice(&mut self, key: Key, field: &mut dyn Choice) {
        let Some((descriptor, FieldValue::EnumNumber(number))) = self.get(key.name) else { return };
        let Kind::Enum(names) = descriptor.kind() else { return };
        let named = names.get_value(number).map(|value| short_name(&names, value.name()));
        if !named.is_some_and(|name| field.choose(&name)) {
            let known = names.values().filter(|value| value.number() != 0);
            let known: Vec<_> = known.map(|value| value.name().to_owned()).collect();
            let known = known.join(" or ");
            let message = format!("is {number}, which is not known; it must be {known}");
            self.violations.add(self.path(key.name), message);
        }
    }

    fn table(&mut self, key: Key, declare: &mut dyn FnMut(&mut dyn Fields)) {
        if let Some((_, FieldValue::Message(message))) = self.get(key.name) {
            let path = self.path(key.name);
            declare(&mut MessageReader { path, message, violations: self.violations });
        }
    }

    fn list(&mut self, key: Key, field: &mut dyn List) {
        let Some((_, FieldValue::List(elements))) = self.get(key.name) else { return };
        let (path, max) = (self.path(key.name), field.max());
        if elements.len() > max {
            let count = elements.len();
            self.violations.add(path, format!("has {count} elements; at most {max} are accepted"));
            return;
        }
        field.resize(elements.len());
        for (index, element) in elements.into_iter().enumerate() {
            let FieldValue::Message(message) = element else { continue };
            let path = element_path(&path, index);
            let violations = &mut *self.violations;
            field.element(index).declare(&mut MessageReader { path, message, violations });
        }
    }

    fn numbers(&mut self, key: Key, field: &mut Vec<f64>, _: Interval, _: usize) {
        let Some((_, FieldValue::List(elements))) = self.get(key.name) else { return };
        *field = elements.iter().filter_map(FieldValue::as_f64).collect();
    }

    fn only_if(&mut self, condition: &Condition, declare: &mut dyn FnMut(&mut dyn Fields)) {
        if condition.holds {
            return declare(self);
        }
        // If the deciding field is unknown, so is whether these fields are meaningful.
        if self.violations.has_at_or_below(&self.path(condition.decided_by)) {
            return;
        }
        for name in fields::names(declare) {
            if self.get(name).is_some() {
                self.violations.add(self.path(name), condition.refusal.as_str());
            }
        }
    }

    fn custom_table(&mut self, _: Key) {}
}

#[cfg(test)]
mod tests {
    use osteon_common::case::Setup;
    use osteon_common::job::{MonteCarlo, Objective, PosteriorSettings, Search};

    use super::*;

    /// Checks that the keys are exactly the fields of the message, each of a type that holds it.
    fn check(entries: &[DeclaredKey], message: &MessageDescriptor) {
        let mut keys: Vec<_> = entries.iter().map(|entry| entry.key.name).collect();
        let mut names: Vec<_> = message.fields().map(|field| field.name().to_owned()).collect();
        keys.sort_unstable();
        names.sort_unstable();
        assert_eq!(keys, names, "{}", message.full_name());
        for DeclaredKey { key, value, .. } in entries {
            let field = message.get_field_by_name(key.name).unwrap();
            match (value, field.kind()) {
                (DeclaredValue::Number(..), Kind::Double)
                | (DeclaredValue::Boolean(_), Kind::Bool) => {
                    assert!(field.supports_presence(), "{}", field.full_name());
                }
                (DeclaredValue::Whole(_, accepted), kind) => {
                    assert!(field.supports_presence(), "{}", field.full_name());
                    let fits = match kind {
                        Kind::Uint32 => accepted.max <= u64::from(u32::MAX),
                        Kind::Uint64 => true,
                        _ => false,
                    };
                    assert!(fits, "{}", field.full_name());
                }
                (DeclaredValue::Choice { names, .. }, Kind::Enum(descriptor)) => {
                    let known = descriptor.values().skip(1);
                    let known: Vec<_> =
                        known.map(|value| short_name(&descriptor, value.name())).collect();
                    assert_eq!(*names, known, "{}", field.full_name());
                }
                (DeclaredValue::Table(entries), Kind::Message(inner)) => check(entries, &inner),
                (DeclaredValue::List { keys, .. }, Kind::Message(inner)) => {
                    assert!(field.is_list(), "{}", field.full_name());
                    check(keys, &inner);
                }
                (DeclaredValue::Numbers { .. }, Kind::Double) => assert!(field.is_list()),
                (DeclaredValue::CustomTable, Kind::Message(_)) => {}
                (value, kind) => panic!("{}: {value:?} as {kind:?}", field.full_name()),
            }
        }
    }

    #[test]
    fn every_key_is_a_field_and_every_field_a_key() {
        let mut setup = Setup::default();
        check(&fields::entries(&mut setup.layers), &descriptor::<v1::Layers>());
        check(&fields::entries(&mut setup.probe), &descriptor::<v1::Probe>());
        check(&fields::entries(&mut setup.picking), &descriptor::<v1::Picking>());
        check(&fields::entries(&mut setup.solver), &descriptor::<v1::SolverSettings>());
        check(&fields::entries(&mut setup.structure), &descriptor::<v1::Bone>());
        check(&fields::entries(&mut MonteCarlo::default()), &descriptor::<v1::MonteCarlo>());
        check(&fields::entries(&mut Objective::default()), &descriptor::<v1::Objective>());
        check(&fields::entries(&mut Search::default()), &descriptor::<v1::Search>());
        check(
            &fields::entries(&mut PosteriorSettings::default()),
            &descriptor::<v1::PosteriorSettings>(),
        );
    }
}
