//! Counts the guided waves of a bone of sublayers whose frequency is below a given one; of one between fluids,
//! those that are slower than sound in both.
//!
//! Counting goes from the lowest face upwards: eliminating a face from the stiffness of a sublayer on what
//! lies below adds its negative eigenvalues to the count, and leaves the stiffness of the sublayer's upper
//! face. A stack is in general not its own image in a point, so its stiffness is Hermitian and not real. It
//! is taken as the real matrix of twice the size, which has each eigenvalue twice.

use osteon_common::fluid_sublayers::FluidSublayer;

use super::count::{Real, first_lane, joint_matrix, negative_pivots, symmetric_entry};
use super::family::Family;
use crate::complex::Complex;
use crate::exact::plate::{AccuratePlate, Fill, Slice};
use crate::isa::{Isa, Kernel};
use crate::media::{Media, MediumLayer};
use crate::medium::Medium;
use crate::vector::Vector;

/// Real numbers of the displacement of a face: three real, three imaginary parts.
const FACE: usize = 6;
/// Those of the lower and the upper face of a sublayer.
const BOTH_FACES: usize = 2 * FACE;

/// Sublayers with free faces, or the upper half of a stack that is the same from both faces.
#[derive(Debug)]
pub(super) struct FreeStack {
    isa: Isa,
    /// Media and plates, upwards.
    plates: Vec<(Medium, AccuratePlate)>,
    is_half: bool,
    /// The fluids above and below, if there are any.
    fluids: Option<[FluidSublayer; 2]>,
}

impl FreeStack {
    /// Creates the stack of these media between fluids, which reach far.
    pub(super) fn between(isa: Isa, media: &Media, fluids: [FluidSublayer; 2]) -> Self {
        Self { fluids: Some(fluids), ..Self::new(isa, media, false) }
    }

    /// Creates the stack of these media; with `is_half` its upper half, which ends in the middle of a medium.
    pub(super) fn new(isa: Isa, media: &Media, is_half: bool) -> Self {
        let count = 1 + media.lower.len();
        let middle = is_half.then_some(count / 2);
        let plate = |(index, layer): (usize, &MediumLayer)| {
            let mut plate = AccuratePlate::default();
            let share = if middle == Some(index) { 0.5 } else { 1.0 };
            let (medium, thickness) = (&layer.medium, share * layer.thickness);
            isa.run(Fill { medium, thickness, doublings_min: 0, plate: &mut plate });
            (layer.medium.clone(), plate)
        };
        let kept = middle.map_or(count, |middle| middle + 1);
        let mut plates: Vec<_> = media.iter().enumerate().take(kept).map(plate).collect();
        plates.reverse();
        Self { isa, plates, is_half, fluids: None }
    }

    /// Returns the number of waves of a family whose frequency at `k` (rad/m) is below `omega` (rad/s);
    /// `None` if a number is not finite.
    pub(super) fn count(&mut self, family: &Family, k: f64, omega: f64) -> Option<u64> {
        let Self { isa, plates, is_half, fluids } = self;
        let loads = fluids.map(|fluids| fluids.map(|fluid| load(&fluid, k, omega)));
        let mut all = 0_u64;
        let mut below = [[0.0; FACE]; FACE];
        if let Some([_, lower]) = loads {
            add_load(&mut below, lower);
        }
        // In the middle plane some displacements of a family are zero.
        let mut free = if *is_half { &family.middle } else { &family.components };
        let upper: [usize; FACE] = std::array::from_fn(|i| FACE + i);
        for (medium, plate) in plates {
            let components = &family.components;
            let (clamped, mut stiffness) =
                isa.run(Stiffness { medium, plate, components, k, omega })?;
            for i in 0..FACE {
                for j in 0..FACE {
                    stiffness[i][j] += below[i][j];
                }
            }
            let face = negative_pivots(&mut stiffness, &both_parts(free), &upper)?;
            all = all.checked_add(clamped)?.checked_add(face / 2)?;
            for i in 0..FACE {
                for j in 0..FACE {
                    below[i][j] = stiffness[FACE + i][FACE + j];
                }
            }
            free = components;
        }
        if let Some([upper, _]) = loads {
            add_load(&mut below, upper);
        }
        all.checked_add(negative_pivots(&mut below, &both_parts(free), &[])? / 2)
    }
}

/// Returns the stiffness of a fluid half-space against displacements across its face, Pa/m, for waves that are
/// slower than sound in it: that of a mass, and infinite at the speed of sound. It has no waves of its own where
/// its face is at rest.
fn load(fluid: &FluidSublayer, k: f64, omega: f64) -> f64 {
    let over_c = omega / fluid.sound_speed;
    -fluid.density * omega * omega / (k * k - over_c * over_c).sqrt()
}

/// Adds a stiffness against displacements along x3 to that of a face.
fn add_load(face: &mut Real<FACE>, load: f64) {
    face[2][2] += load;
    face[5][5] += load;
}

/// Returns the rows of real and imaginary parts of these components.
fn both_parts(components: &[usize]) -> Vec<usize> {
    components.iter().flat_map(|&component| [component, component + 3]).collect()
}

/// Kernel that computes the stiffness of both faces of a plate, the lower first, and the number of its
/// waves between clamped faces below a frequency.
struct Stiffness<'a> {
    medium: &'a Medium,
    plate: &'a mut AccuratePlate,
    /// The components of the displacement that count.
    components: &'a [usize],
    /// Wavenumber, rad/m.
    k: f64,
    /// Frequency, rad/s.
    omega: f64,
}

impl Kernel for Stiffness<'_> {
    type Output = Option<(u64, Real<BOTH_FACES>)>;

    #[inline(always)]
    fn run<V: Vector>(self) -> Self::Output {
        let Self { medium, plate, components, k, omega } = self;
        plate.prepare::<V>(medium, Complex::new(0.0, omega), (k, k));
        let Slice { mut layer, doublings, stiffness: scale } = plate.thinnest(V::splat(k))?;
        // A slice is so thin that it has no wave between clamped faces.
        let mut clamped = 0_u64;
        for _ in 0..doublings {
            let joint = negative_pivots(&mut joint_matrix(&layer.joint()), components, &[])?;
            clamped = clamped.checked_mul(2)?.checked_add(joint)?;
            layer = layer.double();
        }
        let mut stiffness = [[0.0; BOTH_FACES]; BOTH_FACES];
        for i in 0..3 {
            for j in 0..3 {
                let upper = first_lane(layer.top[3 * i + j]).scale(scale);
                let mixed = -first_lane(layer.down[symmetric_entry(i, j)]).scale(scale);
                let opposite = Complex::new(mixed.re, -mixed.im);
                set(&mut stiffness, (FACE + i, FACE + j), upper);
                // K_bb = K_ttᵀ.
                set(&mut stiffness, (j, i), upper);
                set(&mut stiffness, (FACE + i, j), mixed);
                set(&mut stiffness, (i, FACE + j), opposite);
            }
        }
        Some((clamped, stiffness))
    }
}

/// Sets an entry of a complex matrix, given by its real part's place.
#[inline(always)]
fn set(matrix: &mut Real<BOTH_FACES>, (i, j): (usize, usize), value: Complex) {
    matrix[i][j] = value.re;
    matrix[i + 3][j + 3] = value.re;
    matrix[i][j + 3] = -value.im;
    matrix[i + 3][j] = value.im;
}
