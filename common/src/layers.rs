//! The three layers: coupling fluid, cortical bone, marrow.

use crate::attenuation::Attenuation;
use crate::fields::{Condition, Fields, Key, Number, Section};
use crate::fluid_sublayers::{FluidSublayer, FluidSublayers, declare_fluid};
use crate::plausible::BONE_THICKNESS;

/// A fluid layer, unbounded along x1 and x2: one fluid, or sublayers of different ones.
/// [`Layers::coupling_fluids`] and [`Layers::marrow_fluids`] return the fluids of either.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fluid {
    /// Sublayers from the skin's side to the marrow's; if there are any, the next three have their
    /// defaults and no meaning.
    pub sublayers: FluidSublayers,
    /// Thickness, m (h1 of the coupling fluid, h2 of the marrow).
    pub thickness: f64,
    /// Mass density, kg/m³.
    pub density: f64,
    /// Speed of sound, m/s.
    pub sound_speed: f64,
    /// Attenuation of sound.
    pub attenuation: Attenuation,
}

/// The stack of layers along x3, from top to bottom.
///
/// The coupling fluid fills 0 < x3 < h1, the bone -h < x3 < 0, the marrow -(h + h2) < x3 < -h.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layers {
    /// Fluid 1: coupling gel, skin and muscle; source and receivers lie in it.
    pub coupling: Fluid,
    /// Thickness h of the cortical bone, m.
    pub bone_thickness: f64,
    /// Attenuation of all waves in the bone.
    pub bone_attenuation: Attenuation,
    /// The marrow: the fluid below the bone (fluid 2 in docs/physics.md).
    pub marrow: Fluid,
}

impl Default for Layers {
    /// The geometry of the paper: 10 mm of fluid, 4 mm of bone, 10 mm of fluid, both fluids
    /// water-like.
    fn default() -> Self {
        let water = Fluid {
            sublayers: FluidSublayers::NONE,
            thickness: 10e-3,
            density: 1000.0,
            sound_speed: 1500.0,
            attenuation: Attenuation::default(),
        };
        Self {
            coupling: water,
            bone_thickness: 4e-3,
            bone_attenuation: Attenuation::default(),
            marrow: water,
        }
    }
}

impl Layers {
    /// Returns the fluids above the bone, upwards from its face; no two neighbours are the same.
    pub fn coupling_fluids(&self) -> FluidSublayers {
        self.coupling.fluids().reversed()
    }

    /// Returns the fluids below the bone, downwards from its face; no two neighbours are the same.
    pub fn marrow_fluids(&self) -> FluidSublayers {
        self.marrow.fluids()
    }

    /// Returns the path, in a file, of the attenuation of the first layer that has one.
    pub fn attenuated(&self) -> Option<&'static str> {
        let layers = [
            ("layers.coupling.attenuation", &self.coupling.attenuation),
            ("layers.bone.attenuation", &self.bone_attenuation),
            ("layers.marrow.attenuation", &self.marrow.attenuation),
        ];
        let on = layers.into_iter().find(|(_, found)| found.quality_factor.is_some());
        on.map(|(path, _)| path)
    }
}

impl Section for Layers {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let coupling = "the fluid above the bone, in which source and receivers lie";
        fields.table(Key { name: "coupling", meaning: coupling }, &mut |fields| {
            self.coupling.declare(fields);
        });
        fields.table(Key { name: "bone", meaning: "the cortical bone" }, &mut |fields| {
            let key = Key { name: "thickness", meaning: "thickness of the bone" };
            fields.number(key, &mut self.bone_thickness, Number::above_zero(&BONE_THICKNESS));
            let key = Key { name: "attenuation", meaning: "attenuation of waves in the bone" };
            fields.table(key, &mut |fields| self.bone_attenuation.declare(fields));
        });
        fields.table(Key { name: "marrow", meaning: "the fluid below the bone" }, &mut |fields| {
            self.marrow.declare(fields);
        });
    }
}

impl Fluid {
    /// Returns the speed of sound, m/s, of the fastest fluid in the layer.
    pub fn fastest(&self) -> f64 {
        self.fluids().fastest()
    }

    /// Returns the thickness of the whole layer, m.
    pub fn whole_thickness(&self) -> f64 {
        self.fluids().thickness()
    }

    /// Returns the fluids of the layer, downwards; no two neighbours are the same.
    fn fluids(&self) -> FluidSublayers {
        if !self.sublayers.is_empty() {
            return self.sublayers.merged();
        }
        let Self { thickness, density, sound_speed, .. } = *self;
        FluidSublayers::of_one(FluidSublayer { thickness, density, sound_speed })
    }
}

impl Section for Fluid {
    fn declare(&mut self, fields: &mut dyn Fields) {
        let meaning = "sublayers of different fluids, from the skin's side to the marrow's, in place of one fluid";
        fields.list(Key { name: "sublayers", meaning }, &mut self.sublayers);
        let condition = Condition {
            holds: self.sublayers.is_empty(),
            decided_by: "sublayers",
            description: "without `sublayers`",
            refusal:
                "is given together with sublayers, each of which has its own; leave one of them out"
                    .to_owned(),
        };
        fields.only_if(&condition, &mut |fields| {
            let numbers = [&mut self.thickness, &mut self.density, &mut self.sound_speed];
            declare_fluid("thickness of the layer", numbers, fields);
        });
        let key = Key { name: "attenuation", meaning: "attenuation of sound in the fluid" };
        fields.table(key, &mut |fields| self.attenuation.declare(fields));
    }
}
