//! Faults of the settings of a posterior.

use super::faults;
use crate::v1;

#[test]
fn each_fault_of_a_posterior_is_named_by_its_path() {
    fn of(change: impl FnOnce(&mut v1::PosteriorSettings)) -> Vec<String> {
        let mut settings = v1::PosteriorSettings::default();
        change(&mut settings);
        faults(|m| {
            m.data.as_mut().unwrap().count = Some(9);
            m.posterior = Some(settings);
        })
    }
    let prior = |parameter: i32, distribution: i32, center: Option<f64>, spread: Option<f64>| {
        of(|m| m.priors.push(v1::PosteriorPrior { parameter, distribution, center, spread }))
    };
    assert_eq!(of(|m| m.draws = Some(99)), ["posterior.draws"]);
    assert_eq!(of(|m| m.max_evaluations = Some(2001)), ["posterior.max_evaluations"]);
    let density = "posterior.priors.density";
    let numbers = [format!("{density}.center"), format!("{density}.spread")];
    assert_eq!(prior(1, 2, None, None), numbers);
    assert_eq!(prior(1, 1, Some(1700.0), Some(100.0)), numbers);
    assert_eq!(prior(1, 2, Some(f64::NAN), Some(0.0)), numbers);
    assert_eq!(prior(1, 3, Some(-1.0), Some(1.0)), numbers[..1]);
    assert_eq!(prior(1, 2, Some(3000.1), Some(100.0)), numbers[..1]);
    assert_eq!(prior(1, 0, Some(1700.0), Some(100.0)), [format!("{density}.distribution")]);
    assert_eq!(prior(0, 2, Some(1700.0), Some(100.0)), ["posterior.priors"]);
    let twice = v1::PosteriorPrior { parameter: 1, distribution: 1, ..Default::default() };
    assert_eq!(of(|m| m.priors = vec![twice; 2]), [density]);
    let propagated = faults(|m| {
        (m.kind, m.data) = (v1::JobKind::Propagation.into(), None);
        m.posterior = Some(v1::PosteriorSettings::default());
    });
    assert_eq!(propagated, ["posterior"]);
}

#[test]
fn a_posterior_needs_the_noise_of_the_data() {
    assert_eq!(faults(|m| m.posterior = Some(v1::PosteriorSettings::default())), ["data.count"]);
}
