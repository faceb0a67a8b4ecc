//! Quantities of the setup that differ from realization to realization.
//!
//! Within a population the cortex is not of one thickness, nor is a probe held without tilt, and both
//! move the velocity of the first arriving signal. A job may give each of these quantities a law,
//! whose mean is the setup's value. Each has a germ of its own, so the others are drawn alike whether it
//! is random or not.

use crate::accepted::Interval;
use crate::case::Setup;
use crate::fields::{self, Condition, Fields, Key, Number, Section};
use crate::setup_quantity::{SETUP_GERMS, SetupQuantity};
use crate::special::standard_normal_quantile;

fields::choices!(RandomDistribution);

/// Largest distance of a drawn value from the median, in standard deviations of the normal law behind
/// it: the few values beyond, one of 1.7 million, are drawn at this distance. So a law has a smallest
/// and a largest value, which are checked before a job begins.
const DEVIATIONS_MAX: f64 = 5.0;

/// Kind of a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RandomDistribution {
    /// Normal.
    #[default]
    Normal,
    /// Log-normal.
    LogNormal,
    /// Uniform.
    Uniform,
}

/// Scatter of a quantity about its value in the setup, which is the mean.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scatter {
    /// Standard deviation, in the quantity's unit, above 0; `None`: the quantity is not random.
    pub standard_deviation: Option<f64>,
    /// Kind of the law.
    pub distribution: RandomDistribution,
}

/// Scatter of each quantity that may be random. They are independent of each other, of the elasticity,
/// and from realization to realization.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RandomQuantities {
    /// Scatter of the bone's thickness, m.
    pub bone_thickness: Scatter,
    /// Scatter of the bone's quality factor.
    pub bone_quality_factor: Scatter,
    /// Scatter of the coupling layer's speed of sound, m/s.
    pub coupling_sound_speed: Scatter,
    /// Scatter of the probe's tilt, rad.
    pub probe_tilt: Scatter,
    /// Scatter of the porosity.
    pub porosity: Scatter,
    /// Scatter of the porosity at the skin's side.
    pub surface_porosity: Scatter,
    /// Scatter of the porosity at the marrow's side.
    pub marrow_porosity: Scatter,
}

impl RandomDistribution {
    /// All kinds, in the order in which messages and documentation list them.
    pub const ALL: [Self; 3] = [Self::Normal, Self::LogNormal, Self::Uniform];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::LogNormal => "log_normal",
            Self::Uniform => "uniform",
        }
    }
}

impl Scatter {
    /// Returns the value for a germ in (0, 1), given the mean.
    fn value(&self, mean: f64, germ: f64) -> f64 {
        let Some(deviation) = self.standard_deviation else { return mean };
        let normal = || standard_normal_quantile(germ).clamp(-DEVIATIONS_MAX, DEVIATIONS_MAX);
        match self.distribution {
            RandomDistribution::Normal => deviation.mul_add(normal(), mean),
            RandomDistribution::LogNormal => {
                let square = libm::log1p((deviation / mean) * (deviation / mean));
                mean * libm::exp(square.sqrt().mul_add(normal(), -0.5 * square))
            }
            RandomDistribution::Uniform => {
                (deviation * 3.0_f64.sqrt()).mul_add(2.0 * germ - 1.0, mean)
            }
        }
    }

    /// Returns the values one standard deviation of the normal law behind it below and above the
    /// median, given the mean.
    pub fn about(&self, mean: f64) -> [f64; 2] {
        const GERM: f64 = 0.158_655_253_931_457_05;
        [GERM, 1.0 - GERM].map(|germ| self.value(mean, germ))
    }

    /// Returns the smallest and the largest value, given the mean.
    pub fn extent(&self, mean: f64) -> [f64; 2] {
        [0.0, 1.0].map(|germ| self.value(mean, germ))
    }
}

impl RandomQuantities {
    /// Returns the scatter of one quantity.
    pub fn scatter(&self, quantity: SetupQuantity) -> Scatter {
        match quantity {
            SetupQuantity::BoneThickness => self.bone_thickness,
            SetupQuantity::BoneQualityFactor => self.bone_quality_factor,
            SetupQuantity::CouplingSoundSpeed => self.coupling_sound_speed,
            SetupQuantity::ProbeTilt => self.probe_tilt,
            SetupQuantity::Porosity => self.porosity,
            SetupQuantity::SurfacePorosity => self.surface_porosity,
            SetupQuantity::MarrowPorosity => self.marrow_porosity,
        }
    }

    /// Returns the quantities that are random.
    pub fn random(&self) -> impl Iterator<Item = SetupQuantity> + '_ {
        let is_random =
            |quantity: &SetupQuantity| self.scatter(*quantity).standard_deviation.is_some();
        SetupQuantity::ALL.into_iter().filter(is_random)
    }

    /// Returns whether any quantity is random.
    pub fn is_any(&self) -> bool {
        self.random().next().is_some()
    }

    /// Returns the setup of one realization: `setup` with the values for these germs.
    pub(crate) fn draw(&self, setup: &Setup, germs: &[f64; SETUP_GERMS]) -> Setup {
        let drawn = |setup: Setup, quantity: SetupQuantity| match quantity.value_in(&setup) {
            Some(mean) => {
                let value = self.scatter(quantity).value(mean, germs[quantity as usize]);
                quantity.with(value, setup)
            }
            // The checks require a mean.
            None => setup,
        };
        self.random().fold(setup.clone(), drawn)
    }
}

impl Section for RandomQuantities {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let meaning = "scatter of the bone's thickness about `layers.bone.thickness`";
        table(fields, "bone_thickness", meaning, &mut self.bone_thickness, "m");
        let meaning = "scatter of the bone's quality factor about `layers.bone.attenuation.quality_factor`, \
             which must be given";
        table(fields, "bone_quality_factor", meaning, &mut self.bone_quality_factor, "");
        let meaning = "scatter of the coupling layer's speed of sound about \
                       `layers.coupling.sound_speed`";
        table(fields, "coupling_sound_speed", meaning, &mut self.coupling_sound_speed, "m/s");
        let meaning = "scatter of the probe's tilt about `probe.tilt`";
        table(fields, "probe_tilt", meaning, &mut self.probe_tilt, "rad");
        let meaning = "scatter of the porosity about `bone.porosity`, which must be given";
        table(fields, "porosity", meaning, &mut self.porosity, "");
        let meaning = "scatter of the porosity at the skin's side about `bone.porosity.surface`";
        table(fields, "surface_porosity", meaning, &mut self.surface_porosity, "");
        let meaning = "scatter of the porosity at the marrow's side about `bone.porosity.marrow`";
        table(fields, "marrow_porosity", meaning, &mut self.marrow_porosity, "");
    }
}

fn table(
    fields: &mut dyn Fields,
    name: &'static str,
    meaning: &'static str,
    scatter: &mut Scatter,
    unit: &'static str,
) {
    fields.table(Key { name, meaning }, &mut |fields| scatter.declare(fields, unit));
}

impl Scatter {
    fn declare(&mut self, fields: &mut dyn Fields, unit: &'static str) {
        let meaning =
            "standard deviation; without it, the quantity is the same in all realizations";
        fields.optional_number(
            Key { name: "standard_deviation", meaning },
            &mut self.standard_deviation,
            Number::within(Interval::above(0.0, unit)),
        );
        let condition = Condition {
            holds: self.standard_deviation.is_some(),
            decided_by: "standard_deviation",
            description: "with `standard_deviation`",
            refusal:
                "belongs to standard_deviation, which is not given; leave it out, or give both"
                    .to_owned(),
        };
        fields.only_if(&condition, &mut |fields| {
            let meaning = "law with the setup's value as mean; a log-normal one requires a mean \
                           above 0. Normal laws end at five standard deviations";
            fields.choice(Key { name: "distribution", meaning }, &mut self.distribution);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::germ_source::{GermMaker, GermScheme, GermSource};
    use crate::statistics;

    fn scatter(distribution: RandomDistribution, deviation: f64) -> Scatter {
        Scatter { standard_deviation: Some(deviation), distribution }
    }

    /// The values of 2¹⁴ scrambled points.
    fn values(quantity: SetupQuantity, random: &RandomQuantities, setup: &Setup) -> Vec<f64> {
        let scheme = GermScheme::Sobol { points: 1 << 14 };
        let maker = GermMaker::new(GermSource { seed: 3, scheme });
        let value =
            |index| quantity.value_in(&random.draw(setup, &maker.setup_germs(index))).unwrap();
        (0..1 << 14).map(value).collect()
    }

    #[test]
    fn values_have_the_mean_and_the_standard_deviation_that_are_given() {
        for distribution in RandomDistribution::ALL {
            let random = RandomQuantities {
                bone_thickness: scatter(distribution, 0.5e-3),
                ..RandomQuantities::default()
            };
            let setup = Setup::default();
            let found = statistics::moments(&values(SetupQuantity::BoneThickness, &random, &setup));
            let found = found.unwrap();
            assert!((found.mean - 4e-3).abs() < 1e-7, "{distribution:?}: {found:?}");
            let deviation = found.coefficient_of_variation * found.mean;
            assert!((deviation - 0.5e-3).abs() < 1e-6, "{distribution:?}: {found:?}");
        }
    }

    #[test]
    fn values_stay_within_their_extent() {
        let check = |distribution, expected: [f64; 2]| {
            let scatter = scatter(distribution, 2.0);
            let extent = scatter.extent(20.0);
            for (found, expected) in extent.into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12, "{distribution:?}: {extent:?}");
            }
            for germ in [1e-17, 0.3, 1.0 - 1e-16] {
                let value = scatter.value(20.0, germ);
                assert!((extent[0]..=extent[1]).contains(&value), "{distribution:?}: {value}");
            }
        };
        let (normal, wide) = (RandomDistribution::Normal, 2.0 * 3.0_f64.sqrt());
        check(normal, [10.0, 30.0]);
        check(RandomDistribution::Uniform, [20.0 - wide, 20.0 + wide]);
        // 20 / √1.01 · exp(∓5 √ln 1.01).
        check(RandomDistribution::LogNormal, [12.085427434358541, 32.77001215815225]);
    }

    #[test]
    fn a_quantity_is_drawn_alike_whatever_else_is_random() {
        let some = scatter(RandomDistribution::Normal, 0.1e-3);
        let alone = RandomQuantities { bone_thickness: some, ..RandomQuantities::default() };
        let tilt = scatter(RandomDistribution::Normal, 0.01);
        let both = RandomQuantities { probe_tilt: tilt, ..alone };
        let setup = Setup::default();
        let of = |random| values(SetupQuantity::BoneThickness, random, &setup);
        assert_eq!(of(&alone), of(&both));
        let tilts = values(SetupQuantity::ProbeTilt, &both, &setup);
        let product = |(tilt, thickness): (&f64, &f64)| tilt * (thickness - 4e-3);
        let covariance: f64 = tilts.iter().zip(&of(&both)).map(product).sum::<f64>();
        assert!((covariance / tilts.len() as f64 / 0.1e-5).abs() < 0.01, "{covariance}");
    }

    #[test]
    fn without_random_quantities_the_setup_is_the_jobs() {
        let random = RandomQuantities::default();
        assert!(!random.is_any());
        assert_eq!(random.draw(&Setup::default(), &[0.3; SETUP_GERMS]), Setup::default());
    }
}
