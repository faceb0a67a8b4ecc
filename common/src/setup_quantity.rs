//! Quantities of the setup that may be random, and those that may be searched.

use crate::case::Setup;
use crate::parameters::{Parameter, Point};
use crate::systematic::Shift;

/// Number of germs of a realization's setup ([`crate::random_quantities`]). They follow those of the
/// elasticity, which are the same with and without them.
pub const SETUP_GERMS: usize = SetupQuantity::ALL.len();

/// A quantity of the setup that may be random, or searched ([`Parameter::of_setup`]).
/// The order of the variants is that of the germs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetupQuantity {
    /// Thickness of the bone, m.
    BoneThickness,
    /// Quality factor of the bone.
    BoneQualityFactor,
    /// Speed of sound of the coupling layer, m/s.
    CouplingSoundSpeed,
    /// Tilt of the probe, rad.
    ProbeTilt,
    /// Porosity of the bone, the same through its thickness.
    Porosity,
    /// Porosity at the skin's side of the bone.
    SurfacePorosity,
    /// Porosity at the marrow's side of the bone.
    MarrowPorosity,
}

impl SetupQuantity {
    /// All quantities, in the order of their germs and of a user's file.
    pub const ALL: [Self; 7] = [
        Self::BoneThickness,
        Self::BoneQualityFactor,
        Self::CouplingSoundSpeed,
        Self::ProbeTilt,
        Self::Porosity,
        Self::SurfacePorosity,
        Self::MarrowPorosity,
    ];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::BoneThickness => "bone_thickness",
            Self::BoneQualityFactor => "bone_quality_factor",
            Self::CouplingSoundSpeed => "coupling_sound_speed",
            Self::ProbeTilt => "probe_tilt",
            Self::Porosity => "porosity",
            Self::SurfacePorosity => "surface_porosity",
            Self::MarrowPorosity => "marrow_porosity",
        }
    }

    /// Returns the path of the setup's key that holds the mean.
    pub fn mean_key(self) -> &'static str {
        match self {
            Self::BoneThickness => "layers.bone.thickness",
            Self::BoneQualityFactor => "layers.bone.attenuation.quality_factor",
            Self::CouplingSoundSpeed => "layers.coupling.sound_speed",
            Self::ProbeTilt => "probe.tilt",
            Self::Porosity => "bone.porosity",
            Self::SurfacePorosity => "bone.porosity.surface",
            Self::MarrowPorosity => "bone.porosity.marrow",
        }
    }

    /// Returns the unit; empty for a pure number.
    pub fn unit(self) -> &'static str {
        match self {
            Self::BoneThickness => "m",
            Self::BoneQualityFactor
            | Self::Porosity
            | Self::SurfacePorosity
            | Self::MarrowPorosity => "",
            Self::CouplingSoundSpeed => "m/s",
            Self::ProbeTilt => "rad",
        }
    }

    /// Returns the value in a setup; `None` if the setup has none.
    pub fn value_in(self, setup: &Setup) -> Option<f64> {
        match self {
            Self::BoneThickness => Some(setup.layers.bone_thickness),
            Self::BoneQualityFactor => setup.layers.bone_attenuation.quality_factor,
            Self::CouplingSoundSpeed => {
                let coupling = &setup.layers.coupling;
                coupling.sublayers.is_empty().then_some(coupling.sound_speed)
            }
            Self::ProbeTilt => Some(setup.probe.tilt),
            Self::Porosity => setup.structure.porosity,
            Self::SurfacePorosity => setup.structure.profile.surface,
            Self::MarrowPorosity => setup.structure.profile.marrow,
        }
    }

    /// Returns what a message says of the key of the mean if `setup` has none.
    pub(crate) fn lacking(self, setup: &Setup) -> &'static str {
        match self {
            Self::CouplingSoundSpeed => {
                "is replaced by the sublayers of the coupling; leave out either these or this table"
            }
            Self::Porosity | Self::SurfacePorosity | Self::MarrowPorosity
                if setup.structure.is_layered() =>
            {
                "is replaced by bone.sublayers; leave out either these or this table"
            }
            _ => "is not given; give both",
        }
    }

    /// Returns the setup with this value.
    #[must_use]
    pub fn with(self, value: f64, mut setup: Setup) -> Setup {
        match self {
            Self::BoneThickness => setup.layers.bone_thickness = value,
            Self::BoneQualityFactor => setup.layers.bone_attenuation.quality_factor = Some(value),
            Self::CouplingSoundSpeed => setup.layers.coupling.sound_speed = value,
            Self::ProbeTilt => setup.probe.tilt = value,
            Self::Porosity => setup.structure.porosity = Some(value),
            Self::SurfacePorosity => setup.structure.profile.surface = Some(value),
            Self::MarrowPorosity => setup.structure.profile.marrow = Some(value),
        }
        setup
    }
}

impl Parameter {
    /// Returns the quantity of the setup that this is, for the parameters that not every job has.
    pub fn of_setup(self) -> Option<SetupQuantity> {
        match self {
            Self::BoneThickness => Some(SetupQuantity::BoneThickness),
            Self::BoneQualityFactor => Some(SetupQuantity::BoneQualityFactor),
            Self::CouplingSoundSpeed => Some(SetupQuantity::CouplingSoundSpeed),
            Self::Porosity => Some(SetupQuantity::Porosity),
            Self::SurfacePorosity => Some(SetupQuantity::SurfacePorosity),
            Self::MarrowPorosity => Some(SetupQuantity::MarrowPorosity),
            _ => None,
        }
    }
}

impl Point {
    /// Returns the setup at this point, given that of the job.
    #[must_use]
    pub fn setup(&self, setup: &Setup) -> Setup {
        let with = |setup: Setup, (parameter, value): (Parameter, f64)| match parameter.of_setup() {
            Some(quantity) => quantity.with(value, setup),
            None => setup,
        };
        let searched = self.given().fold(setup.clone(), with);
        match self.shift() {
            Some(Shift { quantity, value }) => quantity.with(value, searched),
            None => searched,
        }
    }
}
