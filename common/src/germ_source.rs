//! Source of the germs of a job's realizations.

use std::sync::{Arc, OnceLock};

use crate::ensemble::{GERMS, Germs, uniform};
use crate::setup_quantity::SETUP_GERMS;
use crate::sobol::{Scramble, ScrambledDimensions};

/// Everything that determines the germs at every index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GermSource {
    /// Seed of the job.
    pub seed: u64,
    /// Scheme by which germs are generated from the seed.
    pub scheme: GermScheme,
}

/// Scheme by which germs are generated from seed and index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GermScheme {
    /// Independent germs, one ChaCha stream per realization ([`Germs::draw`]).
    Streams,
    /// Scrambled Sobol' points: scramble `index / points`, its point `index % points`.
    Sobol {
        /// Number of points of each scramble, 1 to 10⁷.
        points: u64,
    },
}

/// Generator of germs; data that several indices share are computed once.
#[derive(Debug, Clone)]
pub(crate) struct GermMaker {
    source: GermSource,
    of_elasticity: Scrambles<GERMS, 0>,
    of_setup: Scrambles<SETUP_GERMS, GERMS>,
}

/// Scrambles of one seed, each cached at the position given by its number modulo their count.
#[derive(Debug, Clone)]
struct Scrambles<const COUNT: usize, const FIRST: usize>(
    Arc<[OnceLock<Box<Numbered<COUNT, FIRST>>>; SCRAMBLES_KEPT]>,
);

/// A scramble and its number.
#[derive(Debug)]
struct Numbered<const COUNT: usize, const FIRST: usize> {
    number: u64,
    scramble: ScrambledDimensions<COUNT, FIRST>,
}

/// Number of consecutive scrambles that are cached for a batch of realizations, 4 kB each. A
/// scramble whose position is already occupied by another one is recomputed whenever it is needed.
const SCRAMBLES_KEPT: usize = 64;

impl GermSource {
    /// Creates the source of independent germs of this seed.
    pub fn streams(seed: u64) -> Self {
        Self { seed, scheme: GermScheme::Streams }
    }
}

/// Returns the first `count` points of scramble `number` of the Sobol' points of a seed, uniform in
/// the open unit cube.
pub fn sobol_points(seed: u64, number: u64, count: u64) -> Vec<[f64; GERMS]> {
    let scramble = Scramble::new(seed, number);
    (0..count).map(|index| scramble.point(index).map(uniform)).collect()
}

impl PartialEq for GermMaker {
    /// The cache is a function of the source, so it need not be compared.
    fn eq(&self, other: &Self) -> bool {
        self.source == other.source
    }
}

impl GermMaker {
    pub(crate) fn new(source: GermSource) -> Self {
        Self { source, of_elasticity: Scrambles::new(), of_setup: Scrambles::new() }
    }

    /// Returns the germs of one realization's elasticity.
    pub(crate) fn germs(&self, index: u64) -> Germs {
        let GermSource { seed, scheme } = self.source;
        match scheme {
            GermScheme::Streams => Germs::draw(seed, index),
            GermScheme::Sobol { points } => {
                let points = points.max(1);
                self.of_elasticity.with(seed, index / points, |scramble| {
                    Germs::from_bits(scramble.point(index % points))
                })
            }
        }
    }

    /// Returns the germs of one realization's setup.
    pub(crate) fn setup_germs(&self, index: u64) -> [f64; SETUP_GERMS] {
        let GermSource { seed, scheme } = self.source;
        match scheme {
            GermScheme::Streams => Germs::of_setup(seed, index),
            GermScheme::Sobol { points } => {
                let points = points.max(1);
                self.of_setup.with(seed, index / points, |scramble| {
                    scramble.coordinates(index % points).map(uniform)
                })
            }
        }
    }

    /// Returns germ 11 of one realization.
    pub(crate) fn first_germ(&self, index: u64) -> f64 {
        let GermSource { seed, scheme } = self.source;
        match scheme {
            GermScheme::Streams => Germs::first(seed, index),
            GermScheme::Sobol { points } => {
                let points = points.max(1);
                self.of_elasticity
                    .with(seed, index / points, |scramble| uniform(scramble.first(index % points)))
            }
        }
    }

    /// Returns germ 11 of realizations 0, 1, … `count` - 1.
    pub(crate) fn first_germs(&self, count: u64) -> Box<dyn Iterator<Item = f64> + '_> {
        let seed = self.source.seed;
        match self.source.scheme {
            GermScheme::Streams => Box::new((0..count).map(move |index| Germs::first(seed, index))),
            GermScheme::Sobol { points } => {
                let points = points.max(1);
                let of_scramble = move |number| {
                    let scramble = Scramble::new(seed, number);
                    let points = points.min(count - number * points);
                    (0..points).map(move |index| uniform(scramble.first(index)))
                };
                Box::new((0..count.div_ceil(points)).flat_map(of_scramble))
            }
        }
    }
}

impl<const COUNT: usize, const FIRST: usize> Scrambles<COUNT, FIRST> {
    fn new() -> Self {
        Self(Arc::new([const { OnceLock::new() }; SCRAMBLES_KEPT]))
    }

    fn with<T>(
        &self,
        seed: u64,
        number: u64,
        then: impl FnOnce(&ScrambledDimensions<COUNT, FIRST>) -> T,
    ) -> T {
        let make =
            || Box::new(Numbered { number, scramble: ScrambledDimensions::new(seed, number) });
        let kept = self.0[(number % SCRAMBLES_KEPT as u64) as usize].get_or_init(make);
        if kept.number == number { then(&kept.scramble) } else { then(&make().scramble) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn independent_germs_are_those_of_their_stream() {
        let maker = GermMaker::new(GermSource::streams(5));
        assert_eq!(maker.germs(17), Germs::draw(5, 17));
        assert_eq!(maker.setup_germs(17), Germs::of_setup(5, 17));
    }

    /// Requests more scrambles than are cached, forwards and backwards.
    #[test]
    fn a_scramble_follows_the_one_before() {
        let scheme = GermScheme::Sobol { points: 4 };
        let maker = GermMaker::new(GermSource { seed: 9, scheme });
        let check = |index: u64| {
            let expected = Germs::from_bits(Scramble::new(9, index / 4).point(index % 4));
            assert_eq!(maker.germs(index), expected, "{index}");
            let of_setup = ScrambledDimensions::<SETUP_GERMS, GERMS>::new(9, index / 4)
                .coordinates(index % 4)
                .map(uniform);
            assert_eq!(maker.setup_germs(index), of_setup, "{index}");
        };
        let count = 4 * SCRAMBLES_KEPT as u64 + 10;
        (0..count).for_each(check);
        (0..count).rev().for_each(check);
    }

    #[test]
    fn the_first_germs_are_those_of_the_realizations() {
        for scheme in [GermScheme::Streams, GermScheme::Sobol { points: 4 }] {
            let maker = GermMaker::new(GermSource { seed: 9, scheme });
            for count in [0, 3, 4, 9] {
                let firsts: Vec<f64> = maker.first_germs(count).collect();
                let expected = (0..count).map(|index| maker.germs(index).values()[0]);
                assert!(expected.eq(firsts), "{scheme:?}, {count}");
            }
        }
    }
}
