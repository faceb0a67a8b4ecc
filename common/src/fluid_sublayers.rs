//! The fluids of a layer: one, or sublayers of different ones.

use crate::fields::{Fields, Key, List, Number, Section};
use crate::limits::FLUID_SUBLAYERS_MAX;
use crate::plausible::{FLUID_DENSITY, FLUID_THICKNESS, SOUND_SPEED};

/// A layer of one fluid, unbounded along x1 and x2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FluidSublayer {
    /// Thickness, m.
    pub thickness: f64,
    /// Mass density, kg/m³.
    pub density: f64,
    /// Speed of sound, m/s.
    pub sound_speed: f64,
}

impl FluidSublayer {
    /// Value of the places after the last sublayer.
    const NONE: Self = Self { thickness: 0.0, density: 0.0, sound_speed: 0.0 };

    fn is_same_fluid(&self, other: &Self) -> bool {
        self.density == other.density && self.sound_speed == other.sound_speed
    }
}

/// Sublayers of fluids in an order that their owner states: at most [`FLUID_SUBLAYERS_MAX`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FluidSublayers {
    count: usize,
    all: [FluidSublayer; FLUID_SUBLAYERS_MAX],
}

impl Default for FluidSublayers {
    fn default() -> Self {
        Self::NONE
    }
}

impl FluidSublayers {
    /// No sublayers.
    pub const NONE: Self = Self { count: 0, all: [FluidSublayer::NONE; FLUID_SUBLAYERS_MAX] };

    /// Returns these sublayers, or `None` if there are too many.
    pub fn new(sublayers: &[FluidSublayer]) -> Option<Self> {
        let mut new = Self { count: sublayers.len(), ..Self::default() };
        new.all.get_mut(..sublayers.len())?.copy_from_slice(sublayers);
        Some(new)
    }

    /// Returns a single one.
    pub(crate) fn of_one(one: FluidSublayer) -> Self {
        let mut new = Self::default();
        new.push(one);
        new
    }

    /// Returns them in their order.
    pub fn as_slice(&self) -> &[FluidSublayer] {
        &self.all[..self.count]
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the thickness of all together, m.
    pub fn thickness(&self) -> f64 {
        self.as_slice().iter().fold(0.0, |sum, one| sum + one.thickness)
    }

    /// Returns the largest speed of sound, m/s; 0 if there are none.
    pub fn fastest(&self) -> f64 {
        self.as_slice().iter().fold(0.0, |fastest, one| one.sound_speed.max(fastest))
    }

    /// Returns the same fluids with neighbours of one fluid as one sublayer, so that the way in which they
    /// are described has no influence on what is computed.
    #[must_use]
    pub fn merged(&self) -> Self {
        let mut merged = Self::default();
        for one in self.as_slice() {
            merged.push(*one);
        }
        merged
    }

    /// Returns the sublayers in the opposite order.
    #[must_use]
    pub fn reversed(mut self) -> Self {
        self.all[..self.count].reverse();
        self
    }

    /// Returns the fluid at a distance, m, from the outer side of the first; on a joint the earlier one.
    pub fn at(&self, distance: f64) -> Option<FluidSublayer> {
        let mut end = 0.0;
        let is_there = |one: &&FluidSublayer| {
            end += one.thickness;
            distance <= end
        };
        self.as_slice().iter().find(is_there).or(self.as_slice().last()).copied()
    }

    /// Returns the part of the fluids between two distances, m, from the outer side of the first.
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> Self {
        let (mut part, mut start) = (Self::default(), 0.0);
        for one in self.as_slice() {
            let end = start + one.thickness;
            let thickness = to.min(end) - from.max(start);
            if thickness > 0.0 {
                part.push(FluidSublayer { thickness, ..*one });
            }
            start = end;
        }
        part
    }

    /// Adds a sublayer at the end, to the last one if that is the same fluid.
    fn push(&mut self, one: FluidSublayer) {
        match self.all[..self.count].last_mut() {
            Some(last) if last.is_same_fluid(&one) => last.thickness += one.thickness,
            _ => {
                self.all[self.count] = one;
                self.count += 1;
            }
        }
    }
}

impl List for FluidSublayers {
    fn len(&self) -> usize {
        self.count
    }

    fn max(&self) -> usize {
        FLUID_SUBLAYERS_MAX
    }

    fn resize(&mut self, len: usize) {
        self.count = len.min(FLUID_SUBLAYERS_MAX);
        self.all[self.count..].fill(FluidSublayer::NONE);
    }

    fn element(&mut self, index: usize) -> &mut dyn Section {
        &mut self.all[index]
    }

    fn example(&self) -> Box<dyn Section> {
        Box::new(FluidSublayer::NONE)
    }
}

impl Section for FluidSublayer {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let Self { thickness, density, sound_speed } = self;
        declare_fluid("thickness of the sublayer", [thickness, density, sound_speed], fields);
    }
}

/// Declares thickness, density and speed of sound of one fluid.
pub(crate) fn declare_fluid(
    thickness_meaning: &'static str,
    [thickness, density, sound_speed]: [&mut f64; 3],
    fields: &mut dyn Fields,
) {
    let key = Key { name: "thickness", meaning: thickness_meaning };
    fields.number(key, thickness, Number::above_zero(&FLUID_THICKNESS));
    let key = Key { name: "density", meaning: "mass density" };
    fields.number(key, density, Number::above_zero(&FLUID_DENSITY));
    let key = Key { name: "sound_speed", meaning: "speed of sound" };
    fields.number(key, sound_speed, Number::above_zero(&SOUND_SPEED));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fluids(all: &[(f64, f64)]) -> FluidSublayers {
        let one =
            |&(thickness, sound_speed)| FluidSublayer { thickness, density: 1000.0, sound_speed };
        FluidSublayers::new(&all.iter().map(one).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn neighbours_of_one_fluid_are_one_sublayer() {
        let given = fluids(&[(1e-3, 1500.0), (2e-3, 1500.0), (1e-3, 1450.0), (1e-3, 1500.0)]);
        assert_eq!(
            given.merged(),
            fluids(&[(1e-3 + 2e-3, 1500.0), (1e-3, 1450.0), (1e-3, 1500.0)])
        );
        assert_eq!(fluids(&[(2.5e-3, 1500.0); 4]).merged(), fluids(&[(10e-3, 1500.0)]));
        assert_eq!(given.reversed().reversed(), given);
    }

    #[test]
    fn a_part_of_the_fluids_has_their_thicknesses() {
        let given = fluids(&[(1.0, 1500.0), (2.0, 1450.0), (1.0, 1600.0)]);
        let check = |from, to, expected: &[(f64, f64)]| {
            assert_eq!(given.between(from, to), fluids(expected), "{from} to {to}");
        };
        check(0.0, 4.0, &[(1.0, 1500.0), (2.0, 1450.0), (1.0, 1600.0)]);
        check(0.5, 1.5, &[(0.5, 1500.0), (0.5, 1450.0)]);
        check(1.0, 3.0, &[(2.0, 1450.0)]);
        check(2.0, 2.0, &[]);
    }

    #[test]
    fn there_are_not_too_many() {
        let one = FluidSublayer { thickness: 1e-3, density: 1000.0, sound_speed: 1500.0 };
        let is_some = |count| FluidSublayers::new(&vec![one; count]).is_some();
        let counts = [0, 1, FLUID_SUBLAYERS_MAX, FLUID_SUBLAYERS_MAX + 1];
        assert_eq!(counts.map(is_some), [true, true, true, false]);
    }
}
