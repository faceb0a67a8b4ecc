//! Scrambled Sobol' points for the germs.
//!
//! The sequence of I. M. Sobol' (USSR Comput. Math. Math. Phys. 7 (1967)) with the direction
//! numbers of S. Joe and F. Y. Kuo (SIAM J. Sci. Comput. 30 (2008), 2635-2654): 21 dimensions are
//! those of the elasticity, and the next ones those of random quantities of the setup. A scramble
//! multiplies the digits of each coordinate by a random lower triangular matrix with a unit diagonal
//! and adds a random shift (J. Matoušek, J. Complexity 14 (1998), 527-556). Every point is then uniform
//! in the cube, every scramble is as evenly distributed as the sequence itself, and independent
//! scrambles allow the error of their mean to be estimated.

use rand_chacha::ChaCha20Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::ensemble::GERMS;
use crate::setup_quantity::SETUP_GERMS;

/// Binary digits of an index: [`crate::limits::REALIZATIONS_MAX`] is below 2²⁴.
const INDEX_DIGITS: usize = 24;
/// Binary digits of a coordinate.
const DIGITS: usize = 64;
/// Bytes 8 to 12 of the key, so that no stream of independent germs equals that of a scramble.
const KEY_MARK: [u8; 5] = *b"sobol";

/// Primitive polynomials and initial direction numbers of dimensions 2 to 32: the degree, the inner
/// coefficients as a binary number, and m₁, m₂, … The last ones wait for more random quantities.
const DIRECTIONS: [(u32, u32, &[u32]); 31] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
    (6, 19, &[1, 1, 1, 15, 7, 5]),
    (6, 22, &[1, 3, 1, 15, 13, 25]),
    (6, 25, &[1, 1, 5, 5, 19, 61]),
    (7, 1, &[1, 3, 7, 11, 23, 15, 103]),
    (7, 4, &[1, 3, 7, 13, 13, 15, 69]),
    (7, 7, &[1, 1, 3, 13, 7, 35, 63]),
    (7, 8, &[1, 3, 5, 9, 1, 25, 53]),
    (7, 14, &[1, 3, 1, 13, 9, 35, 107]),
    (7, 19, &[1, 3, 1, 5, 27, 61, 31]),
    (7, 21, &[1, 1, 5, 11, 19, 41, 61]),
    (7, 28, &[1, 3, 5, 3, 3, 13, 69]),
    (7, 31, &[1, 1, 7, 13, 1, 19, 1]),
    (7, 32, &[1, 3, 7, 5, 13, 19, 59]),
    (7, 37, &[1, 1, 3, 9, 25, 29, 41]),
    (7, 41, &[1, 3, 5, 13, 23, 1, 55]),
    (7, 42, &[1, 3, 7, 3, 13, 59, 17]),
];
const _: () = assert!(GERMS + SETUP_GERMS <= DIRECTIONS.len() + 1);

/// The germ, numbered by rows of L_G, for which each of the first 21 dimensions of the sequence is
/// used. The earlier a dimension, the more evenly its points are distributed, and 11, 55, 33, 23, 22,
/// 13, 12 influence the velocity most, in this order; the rest follow by rows.
const GERM_OF_DIMENSION: [usize; GERMS] =
    [0, 18, 11, 7, 6, 2, 1, 3, 4, 5, 8, 9, 10, 12, 13, 14, 15, 16, 17, 19, 20];

/// One scramble of the germs of the elasticity.
pub(crate) type Scramble = ScrambledDimensions<GERMS, 0>;

/// One scramble of `COUNT` dimensions of the sequence, from dimension `FIRST` (from 0) on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ScrambledDimensions<const COUNT: usize, const FIRST: usize> {
    /// For each dimension, the contribution of each digit of the index (exclusive or).
    columns: [[u64; INDEX_DIGITS]; COUNT],
    shift: [u64; COUNT],
}

impl<const COUNT: usize, const FIRST: usize> ScrambledDimensions<COUNT, FIRST> {
    /// Creates scramble `number` of the job with this seed.
    ///
    /// ChaCha20, the seed in bytes 0-7 of the key (little-endian), "sobol" in bytes 8-12, the
    /// number as stream. For each dimension 63 words, of which word i-1 gives row i of the matrix
    /// left of the diagonal by its highest i bits, then one word of shift; the first digit is the
    /// highest bit.
    pub(crate) fn new(seed: u64, number: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..13].copy_from_slice(&KEY_MARK);
        let mut rng = ChaCha20Rng::from_seed(key);
        rng.set_stream(number);
        // ChaCha20 counts words of 32 bits.
        rng.set_word_pos(2 * (DIGITS * FIRST) as u128);
        let mut scramble = Self { columns: [[0; INDEX_DIGITS]; COUNT], shift: [0; COUNT] };
        for dimension in 0..COUNT {
            let mut rows = [1 << (DIGITS - 1); DIGITS];
            for (row, matrix_row) in rows.iter_mut().enumerate().skip(1) {
                let left = u64::MAX << (DIGITS - row);
                *matrix_row = (rng.next_u64() & left) | (1 << (DIGITS - 1 - row));
            }
            scramble.columns[dimension] = directions(FIRST + dimension).map(|v| product(&rows, v));
            scramble.shift[dimension] = rng.next_u64();
        }
        scramble
    }

    /// Returns the coordinates of point `index`, below 2²⁴, in the order of the dimensions. Each of
    /// their digits is 0 or 1 with probability ½.
    pub(crate) fn coordinates(&self, index: u64) -> [u64; COUNT] {
        std::array::from_fn(|dimension| self.coordinate(dimension, index))
    }

    fn coordinate(&self, dimension: usize, index: u64) -> u64 {
        let mut coordinate = self.shift[dimension];
        for (digit, column) in self.columns[dimension].iter().enumerate() {
            // All ones if the digit is set.
            coordinate ^= column & ((index >> digit) & 1).wrapping_neg();
        }
        coordinate
    }
}

impl Scramble {
    /// Returns the coordinates of point `index`, below 2²⁴, in the order of the germs.
    pub(crate) fn point(&self, index: u64) -> [u64; GERMS] {
        let mut point = [0; GERMS];
        for (coordinate, germ) in self.coordinates(index).into_iter().zip(GERM_OF_DIMENSION) {
            point[germ] = coordinate;
        }
        point
    }

    /// Returns the coordinate of germ 11 alone, which is the first in both orders.
    pub(crate) fn first(&self, index: u64) -> u64 {
        self.coordinate(0, index)
    }
}

/// Returns the direction numbers of a dimension, with the first digit in the highest bit.
fn directions(dimension: usize) -> [u64; INDEX_DIGITS] {
    let first = |m: u64, column: usize| m << (DIGITS - 1 - column);
    let Some((degree, inner, initial)) =
        dimension.checked_sub(1).map(|dimension| DIRECTIONS[dimension])
    else {
        // Van der Corput's sequence.
        return std::array::from_fn(|column| first(1, column));
    };
    let degree = degree as usize;
    let mut columns = [0; INDEX_DIGITS];
    for column in 0..INDEX_DIGITS {
        columns[column] = if column < degree {
            first(u64::from(initial[column]), column)
        } else {
            let mut value = columns[column - degree] ^ (columns[column - degree] >> degree);
            for back in 1..degree {
                if inner >> (degree - 1 - back) & 1 == 1 {
                    value ^= columns[column - back];
                }
            }
            value
        };
    }
    columns
}

/// Returns the product of a bit matrix, by rows, with a vector of digits.
fn product(rows: &[u64; DIGITS], digits: u64) -> u64 {
    rows.iter().fold(0, |product, row| (product << 1) | u64::from((row & digits).count_ones() & 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with Joe and Kuo's own first points, without scramble; dimensions 1 to 5.
    #[test]
    fn the_sequence_is_sobols() {
        let point = |index: usize| {
            [0, 1, 2, 3, 4].map(|dimension| {
                let columns = directions(dimension);
                let digits = (0..INDEX_DIGITS).filter(|digit| index >> digit & 1 == 1);
                let coordinate = digits.fold(0, |sum, digit| sum ^ columns[digit]);
                coordinate as f64 / 18_446_744_073_709_551_616.0
            })
        };
        // In the order of indices; published lists often go by Gray code: 1, 3, 2, 6, …
        assert_eq!(point(0), [0.0; 5]);
        assert_eq!(point(1), [0.5; 5]);
        assert_eq!(point(3), [0.75, 0.25, 0.25, 0.25, 0.75]);
        assert_eq!(point(2), [0.25, 0.75, 0.75, 0.75, 0.25]);
        assert_eq!(point(6), [0.375, 0.375, 0.625, 0.875, 0.375]);
    }

    #[test]
    fn direction_numbers_are_odd_and_fit_their_digit() {
        for dimension in 0..=DIRECTIONS.len() {
            for (column, value) in directions(dimension).into_iter().enumerate() {
                let m = value >> (DIGITS - 1 - column);
                assert!(m % 2 == 1 && m < 2 << column, "{dimension} {column}: {m}");
                assert_eq!(m << (DIGITS - 1 - column), value);
            }
        }
        let mut germs = GERM_OF_DIMENSION;
        germs.sort_unstable();
        assert_eq!(germs, std::array::from_fn(|germ| germ));
    }

    /// If the index of the first of 2ᵏ points is a multiple of 2ᵏ, each of 2ᵏ equal intervals contains
    /// exactly one of them, in every dimension and every scramble.
    #[test]
    fn every_coordinate_is_stratified() {
        for (seed, number, block) in [(1, 0, 0), (1, 1, 5), (7, 0, 1023)] {
            let scramble = Scramble::new(seed, number);
            let mut seen = [[false; 64]; GERMS];
            for index in 64 * block..64 * (block + 1) {
                for (seen, coordinate) in seen.iter_mut().zip(scramble.point(index)) {
                    seen[(coordinate >> 58) as usize] = true;
                }
            }
            assert_eq!(seen, [[true; 64]; GERMS], "({seed}, {number}, {block})");
        }
    }

    /// The generator continues where that of the elasticity's germs ends, and so do the dimensions.
    #[test]
    fn setup_germs_follow_those_of_the_elasticity() {
        type Both = ScrambledDimensions<{ GERMS + SETUP_GERMS }, 0>;
        for (seed, number) in [(1, 0), (7, 3)] {
            let (both, elasticity) = (Both::new(seed, number), Scramble::new(seed, number));
            let setup = ScrambledDimensions::<SETUP_GERMS, GERMS>::new(seed, number);
            for index in [0, 1, 77, 4096] {
                let all = both.coordinates(index);
                assert_eq!(all[..GERMS], elasticity.coordinates(index));
                assert_eq!(all[GERMS..], setup.coordinates(index));
            }
        }
    }

    /// The first two dimensions are a (0, m, 2)-net in base 2: one point in each box of volume 2⁻ᵐ.
    #[test]
    fn the_first_two_germs_share_a_perfect_net() {
        let scramble = Scramble::new(3, 2);
        let [first, second, ..] = GERM_OF_DIMENSION;
        for split in 0..=8 {
            let mut seen = [false; 256];
            for index in 0..256 {
                let point = scramble.point(index);
                let column = point[first].unbounded_shr(64 - split);
                let row = point[second].unbounded_shr(56 + split);
                seen[(column << (8 - split) | row) as usize] = true;
            }
            assert_eq!(seen, [true; 256], "{split}");
        }
    }

    #[test]
    fn scrambles_differ_by_seed_and_number() {
        let first = Scramble::new(1, 0);
        assert_eq!(first, Scramble::new(1, 0));
        assert_ne!(first.point(0), Scramble::new(1, 1).point(0));
        assert_ne!(first.point(0), Scramble::new(2, 0).point(0));
        assert_ne!(first.columns, Scramble::new(1, 1).columns);
    }
}
