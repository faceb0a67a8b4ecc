//! Shifts: values of single quantities of the setup other than the job's.

/// A quantity that is the same for all data and may be uncertain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum SystematicQuantity {
    /// Thickness of the bone, m.
    BoneThickness,
    /// Quality factor of the bone.
    BoneQualityFactor,
    /// Speed of sound of the coupling layer, m/s.
    CouplingSoundSpeed,
    /// Speed of sound of the marrow, m/s.
    MarrowSoundSpeed,
    /// Height of the source above the bone, m.
    SourceHeight,
    /// Height of the receivers above the bone, m.
    ReceiverHeight,
    /// Place of the first receiver along the bone, m.
    FirstReceiver,
    /// Distance of neighbouring receivers, m.
    Pitch,
    /// Center frequency of the pulse, Hz.
    CenterFrequency,
    /// Tilt of the probe, rad.
    Tilt,
    /// Difference of the porosity at the marrow's side from that at the skin's.
    PorosityGradient,
    /// Offset of all measured velocities, m/s: calibration of the device, another rule of picking.
    VelocityOffset,
}

/// Another value of one quantity of the setup than the job's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    /// The quantity.
    pub quantity: SystematicQuantity,
    /// Its value, in its unit.
    pub value: f64,
}

impl SystematicQuantity {
    /// All quantities, in the order of a user's file.
    pub const ALL: [Self; 12] = [
        Self::BoneThickness,
        Self::BoneQualityFactor,
        Self::CouplingSoundSpeed,
        Self::MarrowSoundSpeed,
        Self::SourceHeight,
        Self::ReceiverHeight,
        Self::FirstReceiver,
        Self::Pitch,
        Self::CenterFrequency,
        Self::Tilt,
        Self::PorosityGradient,
        Self::VelocityOffset,
    ];

    /// Returns the name used in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::BoneThickness => "bone_thickness",
            Self::BoneQualityFactor => "bone_quality_factor",
            Self::CouplingSoundSpeed => "coupling_sound_speed",
            Self::MarrowSoundSpeed => "marrow_sound_speed",
            Self::SourceHeight => "source_height",
            Self::ReceiverHeight => "receiver_height",
            Self::FirstReceiver => "first_receiver",
            Self::Pitch => "pitch",
            Self::CenterFrequency => "center_frequency",
            Self::Tilt => "tilt",
            Self::PorosityGradient => "porosity_gradient",
            Self::VelocityOffset => "velocity_offset",
        }
    }

    /// Returns the path of the job's key that holds its value.
    pub fn key(self) -> &'static str {
        match self {
            Self::BoneThickness => "layers.bone.thickness",
            Self::BoneQualityFactor => "layers.bone.attenuation.quality_factor",
            Self::CouplingSoundSpeed => "layers.coupling.sound_speed",
            Self::MarrowSoundSpeed => "layers.marrow.sound_speed",
            Self::SourceHeight => "probe.source.x3",
            Self::ReceiverHeight => "probe.receivers.x3",
            Self::FirstReceiver => "probe.receivers.first_x1",
            Self::Pitch => "probe.receivers.pitch",
            Self::CenterFrequency => "probe.center_frequency",
            Self::Tilt => "probe.tilt",
            Self::PorosityGradient => "bone.porosity",
            Self::VelocityOffset => "the center of an offset",
        }
    }

    /// Returns the unit; empty for a pure number.
    pub fn unit(self) -> &'static str {
        match self {
            Self::BoneThickness
            | Self::SourceHeight
            | Self::ReceiverHeight
            | Self::FirstReceiver
            | Self::Pitch => "m",
            Self::CouplingSoundSpeed | Self::MarrowSoundSpeed | Self::VelocityOffset => "m/s",
            Self::CenterFrequency => "Hz",
            Self::Tilt => "rad",
            Self::BoneQualityFactor | Self::PorosityGradient => "",
        }
    }

    /// Returns what it is, for the documentation of its key.
    pub(crate) fn meaning(self) -> &'static str {
        match self {
            Self::BoneThickness => "thickness of the bone",
            Self::BoneQualityFactor => "quality factor of the bone, which must be given",
            Self::CouplingSoundSpeed => "speed of sound of the coupling layer",
            Self::MarrowSoundSpeed => "speed of sound of the marrow",
            Self::SourceHeight => "height of the source above the bone",
            Self::ReceiverHeight => "height of the receivers above the bone",
            Self::FirstReceiver => "place of the first receiver along the bone",
            Self::Pitch => {
                "distance of neighbouring receivers; measured velocities are taken to follow from the \
                 job's"
            }
            Self::CenterFrequency => "center frequency of the pulse",
            Self::Tilt => "tilt of the probe",
            Self::PorosityGradient => {
                "porosity at the marrow's side less that at the skin's, about the same mean; it needs a \
                 `bone.porosity`"
            }
            Self::VelocityOffset => {
                "offset of all measured velocities, about 0: calibration of the device, or another rule of \
                 picking than the model's"
            }
        }
    }
}
