//! How a guided wave moves the bone at each depth.

use osteon_common::bone::BoneRef;
use thiserror::Error;

use super::cross_section::{CrossSection, LowerEnd, WaveField};
use super::family::{Family, Symmetry};
use super::fluid_bone::FluidBone;
use super::fluid_modes::half_spaces;
use super::modes::{Mode, ModesError};
use crate::complex::Complex;
use crate::media::Media;
use crate::solver::Solver;

/// The field of a guided wave across the bone, of exp(i(ωt - kx1)).
///
/// The largest modulus of a displacement at all its points is 1. The phase is such that the largest of the
/// upper face's displacements is real and positive.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeShape {
    /// From the upper face to the lower one in equal steps.
    pub points: Vec<ShapePoint>,
}

/// The field of a guided wave at one depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapePoint {
    /// Depth -x3 below the upper face, m.
    pub depth: f64,
    /// u1, u2 and u3, as parts of the largest.
    pub displacement: [Complex; 3],
    /// σ13, σ23 and σ33, Pa for each metre of the largest displacement.
    pub traction: [Complex; 3],
}

/// Why the field of a guided wave is not known.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum ShapeError {
    /// There are no depths from one face to the other.
    #[error("depths: a wave has a field at 2 depths or more, not at {count}")]
    Depths {
        /// Number of depths.
        count: usize,
    },
    /// The wave is that of another bone.
    #[error("mode: this bone has no waves of the family {family}")]
    Family {
        /// The wave's family.
        family: &'static str,
    },
    /// The wave cannot be told from another one.
    #[error(
        "mode: the bone has no wave, or several of one family, at the wavenumber {wavenumber} rad/m; their \
         fields cannot be told apart"
    )]
    Undecided {
        /// The wave's wavenumber, rad/m.
        wavenumber: f64,
    },
    /// The surroundings have no guided waves.
    #[error(transparent)]
    Modes(#[from] ModesError),
}

impl Solver {
    /// Computes the field at `depths` depths of a wave that [`Solver::modes`] has found in this bone.
    /// Tractions at the faces are zero, and nothing jumps where sublayers meet.
    ///
    /// # Errors
    /// If there are less than 2 depths, or if the bone does not have this wave, or another one of its family
    /// beside it, so that both fields are one but for rounding.
    pub fn shape<'a>(
        &self,
        bone: impl Into<BoneRef<'a>>,
        mode: &Mode,
        depths: usize,
    ) -> Result<ModeShape, ShapeError> {
        let asked = AskedShape::new(self, bone.into(), mode, depths)?;
        let AskedShape { media, family, halves, extent, .. } = &asked;
        let whole = CrossSection {
            media,
            components: &family.components,
            s: Complex::new(0.0, mode.phase_velocity * mode.wavenumber),
            k: Complex::new(mode.wavenumber, 0.0),
            load: Complex::default(),
            lower_end: LowerEnd::Face(Complex::default()),
            extent: *extent,
            depths: &asked.depths,
        };
        if !halves {
            return asked.shape(self.isa().run(whole), Complex::new(1.0, 0.0));
        }
        // Waves of other families may have the same wavenumber, but differ in the middle plane.
        let upper = &asked.depths[..depths.div_ceil(2)];
        let half = CrossSection {
            lower_end: LowerEnd::Middle(&family.middle),
            extent: 0.5 * extent,
            depths: upper,
            ..whole
        };
        let fields = self.isa().run(half).map(|upper| mirrored(upper, depths, &family.middle));
        asked.shape(fields, Complex::new(1.0, 0.0))
    }

    /// Computes the field at `depths` depths of a wave that [`Solver::modes_in_fluids`] has found around this
    /// bone. At the faces σ33 is the opposite of the fluid's pressure.
    ///
    /// # Errors
    /// As [`Solver::shape`], and if coupling or marrow is a stack of several fluids.
    pub fn shape_in_fluids<'a>(
        &self,
        bone: impl Into<BoneRef<'a>>,
        mode: &Mode,
        depths: usize,
    ) -> Result<ModeShape, ShapeError> {
        let asked = AskedShape::new(self, bone.into(), mode, depths)?;
        let layers = &self.setup().layers;
        let fluids = half_spaces(layers)?;
        let AskedShape { media, family, extent, .. } = &asked;
        let omega = mode.phase_velocity * mode.wavenumber;
        let k = Complex::new(mode.wavenumber, -mode.attenuation);
        let bone = FluidBone {
            isa: self.isa(),
            media,
            layers,
            fluids,
            components: &family.components,
            radiation: fluids.map(|fluid| mode.wavenumber < omega / fluid.sound_speed),
            omega,
            share: 1.0,
        };
        let (lossless, [load, load_below]) = bone.loads(k);
        let section = CrossSection {
            media,
            components: &family.components,
            s: lossless.bone,
            k,
            load,
            lower_end: LowerEnd::Face(load_below),
            extent: *extent,
            depths: &asked.depths,
        };
        let modulus = Complex::new(1.0, 0.0) / lossless.bone_compliance;
        asked.shape(self.isa().run(section), modulus)
    }
}

/// A wave and the depths at which its field is asked for.
struct AskedShape {
    media: Media,
    family: Family,
    /// Whether half of the bone has the whole field.
    halves: bool,
    /// Thickness of the bone, m.
    extent: f64,
    /// Depths, m.
    depths: Vec<f64>,
    /// Wavenumber, rad/m.
    wavenumber: f64,
}

impl AskedShape {
    fn new(
        solver: &Solver,
        bone: BoneRef<'_>,
        mode: &Mode,
        count: usize,
    ) -> Result<Self, ShapeError> {
        if count < 2 {
            return Err(ShapeError::Depths { count });
        }
        let thickness = solver.setup().layers.bone_thickness;
        let media = Media::new(solver.isa(), bone, thickness);
        let symmetry = Symmetry::new(&bone.sublayers(thickness));
        let of_mode = symmetry.families().into_iter().find(|family| family.name() == mode.family);
        let extent = media.iter().fold(0.0, |sum, layer| sum + layer.thickness);
        let at = |step: usize| extent * (step as f64 / (count - 1) as f64);
        Ok(Self {
            media,
            family: of_mode.ok_or(ShapeError::Family { family: mode.family })?,
            halves: symmetry.halves(),
            extent,
            depths: (0..count).map(at).collect(),
            wavenumber: mode.wavenumber,
        })
    }

    /// Returns the shape with these fields, whose tractions are to be multiplied by `modulus`.
    fn shape(
        &self,
        fields: Option<Vec<WaveField>>,
        modulus: Complex,
    ) -> Result<ModeShape, ShapeError> {
        let undecided = ShapeError::Undecided { wavenumber: self.wavenumber };
        let fields = fields.ok_or(undecided)?;
        let factor = phase(&fields).ok_or(undecided)?;
        let points = self.depths.iter().zip(&fields).map(|(&depth, field)| {
            // Not -0, where nothing moves.
            let [u1, u2, u3, t1, t2, t3] = field.map(|value| value * factor + Complex::default());
            ShapePoint {
                depth,
                displacement: [u1, u2, u3],
                traction: [t1, t2, t3].map(|traction| traction * modulus + Complex::default()),
            }
        });
        Ok(ModeShape { points: points.collect() })
    }
}

/// Returns the factor of modulus 1 that makes the largest displacement of the upper face real and positive;
/// `None` if nothing moves there.
fn phase(fields: &[WaveField]) -> Option<Complex> {
    let mut of_face = Complex::default();
    for value in fields.first()?.iter().take(3) {
        if value.norm_sqr() > of_face.norm_sqr() {
            of_face = *value;
        }
    }
    let factor = Complex::new(of_face.re, -of_face.im).scale(1.0 / of_face.abs());
    factor.is_finite().then_some(factor)
}

/// Returns the fields at `count` depths of a bone that is the same from both faces, given those of the upper
/// half and the components of the displacement that are not zero in the middle.
fn mirrored(upper: Vec<WaveField>, count: usize, middle: &[usize]) -> Vec<WaveField> {
    let mirror_image = |field: &WaveField| {
        let mut image = *field;
        for i in 0..3 {
            // What is even has an odd traction, and the opposite.
            let odd = if middle.contains(&i) { 3 + i } else { i };
            image[odd] = -image[odd];
        }
        image
    };
    let lower: Vec<WaveField> = upper[..count / 2].iter().rev().map(mirror_image).collect();
    upper.into_iter().chain(lower).collect()
}
