//! The first arrival of one bone, and how it was sampled.

/// A picked first arrival.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// Velocity of the first arriving signal, m/s; of a bidirectional probe the harmonic mean of both
    /// directions.
    pub velocity: f64,
    /// Velocities from the first source and from the second, m/s, of a bidirectional probe.
    pub directions: Option<[f64; 2]>,
    /// Time of the picked extremum at each receiver, s, from the first source.
    pub times: Vec<f64>,
    /// Modulus of its pressure there, Pa. The pulse's amplitude is arbitrary, so only ratios mean something.
    pub amplitudes: Vec<f64>,
    /// Estimate of the velocity's relative error by discretisation, ≥ 0.
    pub estimated_error: f64,
    /// Sampling of the exact method; `None` for the hybrid method, whose discretisation is in the
    /// setup.
    pub passes: Option<PassSummary>,
}

/// Sampling of the exact method for one bone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassSummary {
    /// Number of passes.
    pub count: u32,
    /// Total number of (frequency, wavenumber) pairs computed.
    pub pairs_computed: u64,
    /// Sampling of the last pass that contributed.
    pub last: Sampled,
}

/// Sampling of one pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampled {
    /// Highest frequency, Hz.
    pub band: f64,
    /// Time after which the signal repeats, s.
    pub period: f64,
    /// Number of (frequency, wavenumber) pairs.
    pub pairs: u64,
}

impl Arrival {
    /// Combines the arrivals of both directions. Their errors may have the same sign, so that they do not
    /// cancel.
    pub(crate) fn combine(self, other: &Self) -> Self {
        let [one, two] = [self.velocity, other.velocity];
        let passes = self.passes.zip(other.passes).map(|(one, two)| PassSummary {
            count: one.count + two.count,
            pairs_computed: one.pairs_computed + two.pairs_computed,
            last: one.last,
        });
        // The slownesses weigh the errors.
        let error = (self.estimated_error * two + other.estimated_error * one) / (one + two);
        Self {
            velocity: 2.0 / (1.0 / one + 1.0 / two),
            directions: Some([one, two]),
            estimated_error: error,
            passes,
            ..self
        }
    }
}
