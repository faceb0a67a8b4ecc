//! The field of a guided wave along a line across the bone.
//!
//! Unknown are displacements and tractions at the ends of thin slices: the transfer matrix of each slice
//! connects those above with those below, and each face, or the middle plane of a symmetric bone, adds what
//! holds there. At a wave the matrix of all these equations is singular, and a solution with almost any right
//! side is that wave. Unlike a product of transfer matrices, elimination with pivots loses neither what grows
//! nor what decays with depth.

use super::banded::BandedMatrix;
use super::complex_plate::{THICKEST, growth, transfer};
use crate::complex::Complex;
use crate::isa::Kernel;
use crate::media::{Media, MediumLayer};
use crate::vector::Vector;

/// Depths that differ by less than this part of the whole are one.
const SAME: f64 = 1e-12;
/// Irrational numbers, of whose multiples two right sides consist that have nothing in common.
const IRRATIONALS: [f64; 2] = [0.618_033_988_749_894_9, 0.414_213_562_373_095_1];
/// Largest relative difference of the fields from both right sides.
const DIFFERENCE_MAX: f64 = 1e-6;

/// Displacements u1, u2, u3 (m) and tractions σ13, σ23, σ33 (Pa) at one depth.
pub(super) type WaveField = [Complex; 6];

/// The condition at the lower end of a section.
#[derive(Debug, Clone, Copy)]
pub(super) enum LowerEnd<'a> {
    /// The lower face, and the stiffness of the fluid below it against displacements across it, Pa/m.
    Face(Complex),
    /// The middle plane, with the components of the displacement that are not zero there.
    Middle(&'a [usize]),
}

/// Kernel that computes the field of the wave with this wavenumber at some depths; `None` if it is not the
/// only wave there. Its largest displacement is 1.
pub(super) struct CrossSection<'a> {
    pub(super) media: &'a Media,
    /// The components of the displacement.
    pub(super) components: &'a [usize],
    /// Complex frequency, 1/s.
    pub(super) s: Complex,
    /// Wavenumber of fields ∝ exp(st - ikx1), rad/m.
    pub(super) k: Complex,
    /// Stiffness of the fluid above the upper face against displacements across it, Pa/m.
    pub(super) load: Complex,
    pub(super) lower_end: LowerEnd<'a>,
    /// From the upper face to the end of the section, m.
    pub(super) extent: f64,
    /// Depths below the upper face in ascending order, none beyond the extent, m.
    pub(super) depths: &'a [f64],
}

impl Kernel for CrossSection<'_> {
    type Output = Option<Vec<WaveField>>;

    #[inline(always)]
    fn run<V: Vector>(self) -> Self::Output {
        let (slices, nodes) = self.slices();
        let unit = self.media.uppermost.medium.stiffness * self.k.abs();
        let equations = self.equations(&slices, unit);
        let width = 2 * self.components.len();
        let mut sides = IRRATIONALS.map(|irrational| self.right_side(irrational, slices.len()));
        equations.solve(&mut sides);
        let [one, other] = sides.map(|side| self.fields(&side, width, &nodes, unit));
        agreed(one, &other, unit)
    }
}

/// A slice: its medium, and its thickness, m.
type MediumSlice<'a> = (&'a MediumLayer, f64);

impl<'a> CrossSection<'a> {
    /// Returns the slices, downwards, and above which of them each depth is. All depths and joints are
    /// between slices.
    #[inline(always)]
    fn slices(&self) -> (Vec<MediumSlice<'a>>, Vec<usize>) {
        let nearest = SAME * self.extent;
        let mut joint = 0.0;
        let joints = self.media.iter().map(|layer| {
            joint += layer.thickness;
            joint
        });
        let is_inside = |depth: &f64| *depth < self.extent - nearest;
        let mut cuts: Vec<f64> = joints.chain(self.depths.iter().copied()).collect();
        cuts.retain(is_inside);
        cuts.extend([0.0, self.extent]);
        cuts.sort_unstable_by(f64::total_cmp);
        cuts.dedup_by(|next, kept| *next - *kept <= nearest);
        let (mut slices, mut tops) = (Vec::new(), vec![0]);
        for (from, to) in cuts.iter().zip(cuts.iter().skip(1)) {
            let layer = self.layer_at(0.5 * (from + to));
            let count = growth(&layer.medium, self.s, self.k) * (to - from) / THICKEST;
            // A count beyond all bounds is one of numbers out of scale.
            let count = count.clamp(1.0, 1e6).ceil();
            slices.extend((0..count as usize).map(|_| (layer, (to - from) / count)));
            tops.push(slices.len());
        }
        let top = |depth: &f64| {
            let place = cuts.partition_point(|cut| *cut < *depth - nearest);
            tops[place.min(tops.len() - 1)]
        };
        let nodes = self.depths.iter().map(top).collect();
        (slices, nodes)
    }

    /// Returns the layer at a depth, m.
    #[inline(always)]
    fn layer_at(&self, depth: f64) -> &'a MediumLayer {
        let (mut layer, mut end) = (&self.media.uppermost, self.media.uppermost.thickness);
        for lower in &self.media.lower {
            if depth < end {
                break;
            }
            layer = lower;
            end += lower.thickness;
        }
        layer
    }

    /// Returns the matrix of all equations for displacements and tractions at the nodes, the latter in
    /// `unit`, Pa/m: those of the upper face, of each slice, and of the lower end.
    #[inline(always)]
    fn equations(&self, slices: &[MediumSlice<'_>], unit: f64) -> BandedMatrix {
        let (components, count) = (self.components, self.components.len());
        let last = 2 * count * slices.len();
        let mut matrix = BandedMatrix::zeros(last + 2 * count, 3 * count - 1);
        let one = Complex::new(1.0, 0.0);
        let mut known: Option<(MediumSlice<'_>, [[Complex; 6]; 6])> = None;
        for (i, &component) in components.iter().enumerate() {
            let load =
                if component == 2 { self.load.scale(1.0 / unit) } else { Complex::default() };
            set_load(&mut matrix, [i, i, count + i], load);
            let row = last + count + i;
            match self.lower_end {
                LowerEnd::Middle(moving) => {
                    let zero = if moving.contains(&component) { count + i } else { i };
                    matrix.set(row, last + zero, one);
                }
                LowerEnd::Face(load) => {
                    let load =
                        if component == 2 { -load.scale(1.0 / unit) } else { Complex::default() };
                    set_load(&mut matrix, [row, last + i, last + count + i], load);
                }
            }
        }
        for (number, &slice) in slices.iter().enumerate() {
            let same = |(other, _): &(MediumSlice<'_>, _)| {
                std::ptr::eq(other.0, slice.0) && other.1 == slice.1
            };
            let across = match known.filter(same) {
                Some((_, across)) => across,
                None => self.across(slice, unit),
            };
            known = Some((slice, across));
            let above = 2 * count * number;
            for row in 0..2 * count {
                matrix.set(count + above + row, above + row, one);
                for column in 0..2 * count {
                    let entry = across[full(components, row)][full(components, column)];
                    matrix.set(count + above + row, above + 2 * count + column, -entry);
                }
            }
        }
        matrix
    }

    /// Returns the transfer matrix of a slice, from displacements and tractions below it to those above.
    #[inline(always)]
    fn across(&self, (layer, thickness): MediumSlice<'_>, unit: f64) -> [[Complex; 6]; 6] {
        // The matrix is that of fields ∝ exp(st + ikx1).
        let [x, y, w, v] = transfer(&layer.medium, self.s, -self.k, thickness);
        let ratio = layer.medium.stiffness / (thickness * unit);
        let mut all = [[Complex::default(); 6]; 6];
        for i in 0..3 {
            for j in 0..3 {
                all[i][j] = x[i][j];
                all[i][j + 3] = y[i][j].scale(1.0 / ratio);
                all[i + 3][j] = w[i][j].scale(ratio);
                all[i + 3][j + 3] = v[i][j];
            }
        }
        all
    }

    /// Returns a right side that disturbs all slices and leaves the ends as they are.
    #[inline(always)]
    fn right_side(&self, irrational: f64, slices: usize) -> Vec<Complex> {
        let count = self.components.len();
        let disturbance = |row: usize| {
            let part = (row as f64 * irrational) % 1.0;
            let is_end = row < count || row >= count * (2 * slices + 1);
            if is_end { Complex::default() } else { Complex::new(0.5 + part, 1.0 - part) }
        };
        (0..2 * count * (slices + 1)).map(disturbance).collect()
    }

    /// Returns the fields at the nodes of a solution.
    #[inline(always)]
    fn fields(&self, side: &[Complex], width: usize, nodes: &[usize], unit: f64) -> Vec<WaveField> {
        let mut fields = vec![[Complex::default(); 6]; nodes.len()];
        for (field, node) in fields.iter_mut().zip(nodes) {
            for row in 0..width {
                let scale = if row < width / 2 { 1.0 } else { unit };
                field[full(self.components, row)] = side[node * width + row].scale(scale);
            }
        }
        fields
    }
}

/// Sets the equation that a traction answers a displacement by a load, both in one unit.
#[inline(always)]
fn set_load(matrix: &mut BandedMatrix, [row, displacement, traction]: [usize; 3], load: Complex) {
    let scale = 1.0 / load.abs().max(1.0);
    matrix.set(row, displacement, load.scale(scale));
    matrix.set(row, traction, Complex::new(scale, 0.0));
}

/// Returns the place in a [`WaveField`] of the unknown with this number at a node.
#[inline(always)]
fn full(components: &[usize], number: usize) -> usize {
    match components.get(number) {
        Some(component) => *component,
        None => 3 + components[number - components.len()],
    }
}

/// Returns the first fields, divided by their largest displacement, if the others are the same but for a
/// factor.
#[inline(always)]
fn agreed(mut one: Vec<WaveField>, other: &[WaveField], unit: f64) -> Option<Vec<WaveField>> {
    let mut largest = (0.0, [Complex::default(); 2]);
    for (field, other) in one.iter().zip(other) {
        for i in 0..3 {
            if field[i].norm_sqr() > largest.0 {
                largest = (field[i].norm_sqr(), [field[i], other[i]]);
            }
        }
    }
    let [of_one, of_other] = largest.1;
    for (field, other) in one.iter_mut().zip(other) {
        for i in 0..6 {
            field[i] = field[i] / of_one;
            let difference = (field[i] - other[i] / of_other).abs();
            let limit = DIFFERENCE_MAX * if i < 3 { 1.0 } else { unit };
            if difference > limit || difference.is_nan() {
                return None;
            }
        }
    }
    Some(one)
}
