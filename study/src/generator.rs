//! Reproducible random numbers for the quantities that a study varies in addition to the germs.

/// Keeps the generators of neighbouring indices apart.
const INDEX_STEP: u64 = 0x2545_f491_4f6c_dd1d;

/// A splitmix64 generator.
#[derive(Debug, Clone)]
pub(crate) struct Generator {
    state: u64,
}

impl Generator {
    /// Creates the generator of a seed.
    pub(crate) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// Creates the generator of one index of a study with this seed.
    pub(crate) fn for_index(seed: u64, index: u64) -> Self {
        Self::new(seed ^ index.wrapping_mul(INDEX_STEP))
    }

    /// Returns the next number, from 0 to 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns the next number between two numbers.
    pub(crate) fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.uniform()
    }

    /// Returns the next number between two positive ones, with a uniform logarithm.
    pub(crate) fn decades(&mut self, from: f64, to: f64) -> f64 {
        from * libm::pow(to / from, self.uniform())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_fill_their_ranges() {
        let mut generator = Generator::new(1);
        let numbers: Vec<f64> = (0..1000).map(|_| generator.decades(1e-3, 10.0)).collect();
        assert!(numbers.iter().all(|number| (1e-3..=10.0).contains(number)));
        // The median of a log-uniform law is the geometric mean of its ends.
        let below = numbers.iter().filter(|&&number| number < 0.1).count();
        assert!((440..560).contains(&below), "{below}");
        let mean: f64 = (0..1000).map(|_| generator.between(-1.0, 1.0)).sum::<f64>() / 1000.0;
        assert!(mean.abs() < 0.06, "{mean}");
        assert_ne!(Generator::new(1).uniform(), Generator::new(2).uniform());
    }
}
