//! Values of observables as messages, which name each observable as the table in `osteon-common` does.

use osteon_common::observables::{
    Observable, ObservableSet, ObservableValues, ObservedColumns, PerObservable,
};

use crate::malformed::Malformed;
use crate::v1;

/// Returns the messages of columns of values.
pub fn columns_to_messages(columns: &ObservedColumns) -> Vec<v1::ObservedValues> {
    let message = |(one, values): (Observable, &Vec<f64>)| v1::ObservedValues {
        observable: one.name().to_owned(),
        values: values.clone(),
    };
    columns.present().map(message).collect()
}

/// Returns columns of values.
///
/// # Errors
/// If an observable is unknown, or comes twice.
pub fn columns_from_messages(
    messages: &[v1::ObservedValues],
) -> Result<ObservedColumns, Malformed> {
    let mut columns = ObservedColumns::default();
    for v1::ObservedValues { observable, values } in messages {
        put(&mut columns, observable, values.clone())?;
    }
    Ok(columns)
}

pub(crate) fn means_to_messages(means: &ObservableValues) -> Vec<v1::ObservableMean> {
    let message = |(one, &mean): (Observable, &f64)| v1::ObservableMean {
        observable: one.name().to_owned(),
        mean,
    };
    means.present().map(message).collect()
}

pub(crate) fn means_from_messages(
    messages: &[v1::ObservableMean],
) -> Result<ObservableValues, Malformed> {
    let mut means = ObservableValues::default();
    for v1::ObservableMean { observable, mean } in messages {
        put(&mut means, observable, *mean)?;
    }
    Ok(means)
}

pub(crate) fn names(set: ObservableSet) -> Vec<String> {
    set.members().map(|one| one.name().to_owned()).collect()
}

pub(crate) fn set_from_names(names: &[String]) -> Result<ObservableSet, Malformed> {
    let mut found = PerObservable::<Option<()>>::default();
    for name in names {
        put(&mut found, name, ())?;
    }
    Ok(found.which())
}

fn put<T>(found: &mut PerObservable<Option<T>>, name: &str, value: T) -> Result<(), Malformed> {
    let wrong = || Malformed::Observable { name: name.chars().take(64).collect() };
    let place = &mut found[Observable::from_name(name).ok_or_else(wrong)?];
    match place {
        Some(_) => Err(wrong()),
        None => {
            *place = Some(value);
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_and_repeated_observables_are_refused() {
        let named = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            set_from_names(&names)
        };
        let both = named(&["decay", "other_velocity"]).unwrap();
        assert_eq!(names(both), ["other_velocity", "decay"]);
        for wrong in [&["decay", "decay"][..], &["velocity"], &[""]] {
            assert!(matches!(named(wrong), Err(Malformed::Observable { .. })), "{wrong:?}");
        }
    }
}
