//! Quantities that are the same for all data and not known exactly.
//!
//! A thickness that was read from another image, or a speed of sound from a book, is wrong by the same
//! amount in every measured velocity: more data do not make this error smaller. It belongs into the
//! intervals beside the noise of the data, and what each quantity adds is told apart.

pub mod usual;

use crate::accepted::Interval;
use crate::case::Setup;
use crate::fields::{Condition, Fields, Key, Number, Section};
use crate::random_quantities::RandomDistribution;

pub use crate::shift::{Shift, SystematicQuantity};

/// How well the job says that one quantity of the setup is known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SystematicLaw {
    /// How far the true value may be from the job's; 0: it is known exactly; `None`: the job does not say.
    pub spread: Option<f64>,
    /// Kind of the law: normal about the job's value with the spread as standard deviation; log-normal with
    /// the job's value as median and the spread as that of the natural logarithm; or uniform about the
    /// job's value with the spread as half its width.
    pub distribution: RandomDistribution,
    /// The value about which the law is, if it is written down; it must be the job's.
    pub center: Option<f64>,
}

/// How well the job says that the quantities of the setup are known. Their errors are independent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Systematic {
    /// Whether a quantity without a law of its own has the usual one.
    pub usual: bool,
    /// What the job says of each quantity of [`SystematicQuantity::ALL`], in that order.
    pub laws: [SystematicLaw; SystematicQuantity::ALL.len()],
}

/// A quantity that is not known exactly, with the values by which its effect is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertain {
    /// The quantity.
    pub quantity: SystematicQuantity,
    /// One standard deviation below the job's value; `None` where the job has none.
    pub below: Option<Shift>,
    /// One standard deviation above.
    pub above: Shift,
}

impl SystematicQuantity {
    /// Returns the value in a job's setup; `None` if it has none.
    pub fn value_in(self, setup: &Setup) -> Option<f64> {
        let Setup { layers, probe, structure, .. } = setup;
        let of_one =
            |fluid: &crate::layers::Fluid| fluid.sublayers.is_empty().then_some(fluid.sound_speed);
        match self {
            Self::BoneThickness => Some(layers.bone_thickness),
            Self::BoneQualityFactor => layers.bone_attenuation.quality_factor,
            Self::CouplingSoundSpeed => of_one(&layers.coupling),
            Self::MarrowSoundSpeed => of_one(&layers.marrow),
            Self::SourceHeight => Some(probe.source.x3),
            Self::ReceiverHeight => Some(probe.receivers.x3),
            Self::FirstReceiver => Some(probe.receivers.first_x1),
            Self::Pitch => Some(probe.receivers.pitch),
            Self::CenterFrequency => Some(probe.center_frequency),
            Self::Tilt => Some(probe.tilt),
            Self::PorosityGradient => structure.gradient(),
            Self::VelocityOffset => Some(0.0),
        }
    }

    /// Returns the setup with this value. An offset of the velocities is none of the setup.
    #[must_use]
    pub fn with(self, value: f64, mut setup: Setup) -> Setup {
        let Setup { layers, probe, structure, .. } = &mut setup;
        match self {
            Self::BoneThickness => layers.bone_thickness = value,
            Self::BoneQualityFactor => layers.bone_attenuation.quality_factor = Some(value),
            Self::CouplingSoundSpeed => layers.coupling.sound_speed = value,
            Self::MarrowSoundSpeed => layers.marrow.sound_speed = value,
            Self::SourceHeight => probe.source.x3 = value,
            Self::ReceiverHeight => probe.receivers.x3 = value,
            Self::FirstReceiver => probe.receivers.first_x1 = value,
            Self::Pitch => probe.receivers.pitch = value,
            Self::CenterFrequency => probe.center_frequency = value,
            Self::Tilt => probe.tilt = value,
            Self::PorosityGradient => structure.set_gradient(value),
            Self::VelocityOffset => {}
        }
        setup
    }
}

impl Shift {
    /// Returns the logarithm of the shifted pitch relative to that of a setup; 0 of a shift of another quantity.
    ///
    /// Devices divide the pitch that they know by the times that the true one makes, so that the logarithm of the
    /// velocity that they state changes by this less than that of the true one.
    pub fn pitch_logarithm(self, setup: &Setup) -> f64 {
        match self.quantity {
            SystematicQuantity::Pitch => libm::log(self.value / setup.probe.receivers.pitch),
            _ => 0.0,
        }
    }
}

impl SystematicLaw {
    /// Returns the values one standard deviation below and above the job's; `None` of a quantity that is
    /// known exactly.
    pub fn about(&self, value: f64) -> Option<[f64; 2]> {
        let spread = self.spread.filter(|spread| *spread > 0.0)?;
        Some(match self.distribution {
            RandomDistribution::Normal => [value - spread, value + spread],
            RandomDistribution::LogNormal => [-spread, spread].map(|by| value * libm::exp(by)),
            RandomDistribution::Uniform => {
                let deviation = spread / 3.0_f64.sqrt();
                [value - deviation, value + deviation]
            }
        })
    }

    fn declare(&mut self, fields: &mut dyn Fields, unit: &'static str) {
        let meaning = "how far the true value may be from the job's: the standard deviation of a normal law, \
                       that of the natural logarithm under a log-normal one, half the width of a uniform one; \
                       0: it is known exactly";
        let key = Key { name: "spread", meaning };
        let number = Number::within(Interval::at_least(0.0, unit));
        fields.optional_number(key, &mut self.spread, number);
        let condition = Condition {
            holds: self.spread.is_some(),
            decided_by: "spread",
            description: "with `spread`",
            refusal: "belongs to spread, which is not given; leave it out, or give both".to_owned(),
        };
        fields.only_if(&condition, &mut |fields| {
            let meaning = "law about the job's value, or with it as median";
            fields.choice(Key { name: "distribution", meaning }, &mut self.distribution);
            let meaning = "the job's value, of an offset 0; another one is refused";
            let number = Number::within(Interval::finite(unit));
            fields.optional_number(Key { name: "center", meaning }, &mut self.center, number);
        });
    }
}

impl Systematic {
    /// Its section of a job file.
    pub const KEY: Key = Key {
        name: "systematic",
        meaning: "what is the same for all data and not known exactly: each widens the intervals by what it \
                  moves, however many the data are",
    };

    /// Returns what the job says of a quantity.
    pub fn law(&self, quantity: SystematicQuantity) -> SystematicLaw {
        self.laws[quantity as usize]
    }

    /// Returns whether every quantity is known exactly, as far as the job says.
    pub fn is_empty(&self) -> bool {
        !self.usual && self.laws.iter().all(|law| !law.spread.is_some_and(|spread| spread > 0.0))
    }

    /// Returns the quantities of this setup that are not known exactly. The usual laws are not for
    /// those that are searched.
    pub fn uncertain(
        &self,
        setup: &Setup,
        is_searched: impl Fn(SystematicQuantity) -> bool,
    ) -> Vec<Uncertain> {
        let of = |quantity: SystematicQuantity| {
            let value = quantity.value_in(setup);
            let ends = match (self.law(quantity), value) {
                (law @ SystematicLaw { spread: Some(_), .. }, Some(value)) => law.about(value)?,
                (SystematicLaw { spread: None, .. }, value)
                    if self.usual && !is_searched(quantity) =>
                {
                    return Uncertain::usual(quantity, value, setup);
                }
                _ => return None,
            };
            Some(Uncertain::about(quantity, ends))
        };
        SystematicQuantity::ALL.into_iter().filter_map(of).collect()
    }
}

impl Uncertain {
    /// Returns the usual uncertainty of a quantity that has this value in a setup; `None` where the setup has no
    /// such quantity.
    fn usual(quantity: SystematicQuantity, value: Option<f64>, setup: &Setup) -> Option<Self> {
        if quantity == SystematicQuantity::BoneQualityFactor && value.is_none() {
            let above = Shift { quantity, value: usual::QUALITY_FACTOR };
            return Some(Self { quantity, below: None, above });
        }
        let (distribution, spread) = usual::law(quantity, setup)?;
        let law = SystematicLaw { spread: Some(spread), distribution, center: None };
        Some(Self::about(quantity, law.about(value?)?))
    }

    fn about(quantity: SystematicQuantity, [below, above]: [f64; 2]) -> Self {
        let shift = |value| Shift { quantity, value };
        Self { quantity, below: Some(shift(below)), above: shift(above) }
    }

    /// Returns the shifts of the setup by which the effect is measured; none of an offset of the velocities.
    pub fn shifts(&self) -> impl Iterator<Item = Shift> + use<> {
        let is_of_setup = self.quantity != SystematicQuantity::VelocityOffset;
        let shifts = self.below.into_iter().chain([self.above]);
        shifts.filter(move |_| is_of_setup)
    }
}

impl Section for Systematic {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let meaning = "true: each quantity without a spread of its own has a usual one (how-to-systematic.md); \
                       those that are searched have none";
        fields.boolean(Key { name: "usual", meaning }, &mut self.usual);
        for (quantity, law) in SystematicQuantity::ALL.into_iter().zip(&mut self.laws) {
            let key = Key { name: quantity.name(), meaning: quantity.meaning() };
            fields.table(key, &mut |fields| law.declare(fields, quantity.unit()));
        }
    }
}

#[cfg(test)]
mod tests;
