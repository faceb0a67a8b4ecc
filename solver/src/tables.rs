//! Tables that all realizations of one setup share: they depend on layers, probe, solver settings
//! and the rung of the speed ladder only.

use std::f64::consts::PI;

use osteon_common::case::Setup;
use osteon_common::sampling::{Sampling, distances};

use crate::complex::Complex;
use crate::lanes::{ComplexLanes, LANES, Lanes};
use crate::pulse::Pulse;

/// Pairs beyond which blocks are computed when they are needed and not kept: 20 MB of tables.
const KEPT_PAIRS_MAX: f64 = 3e5;
/// Frequencies whose taper is below this are left out.
const TAPER_MIN: f64 = 1e-9;

/// Tables of one sampling.
#[derive(Debug)]
pub(crate) struct Tables {
    setup: Setup,
    pub(crate) sampling: Sampling,
    pub(crate) frequencies: Vec<Frequency>,
    /// cos(k x) of wavenumber block b at receiver r, at `[r * blocks + b]`.
    cosines: Vec<Lanes>,
    receivers: usize,
    /// Most blocks of a frequency.
    blocks: usize,
}

/// One complex frequency.
#[derive(Debug)]
pub(crate) struct Frequency {
    /// α + i ω, 1/s.
    pub(crate) s: Complex,
    /// ρ1 s², kg/m³/s².
    pub(crate) inertia: Complex,
    /// F(s) times the taper.
    pub(crate) pulse: Complex,
    /// Number of the frequency.
    n: usize,
    /// Number of blocks of wavenumbers.
    pub(crate) blocks: usize,
    /// The blocks, unless there are too many to be kept.
    kept: Vec<Block>,
}

/// Eight neighbouring wavenumbers of one frequency.
#[derive(Debug)]
pub(crate) struct Block {
    /// k, rad/m; lanes beyond the last wavenumber repeat it with weight 0.
    pub(crate) k: Lanes,
    /// g = √(k² + s²/c1²), rad/m.
    pub(crate) g: ComplexLanes,
    /// Z = ρ2 s² tanh(g2 h2)/g2, Pa/m: what loads the lower face.
    pub(crate) load: ComplexLanes,
    /// Everything that multiplies the reflection coefficient, with the measure of the sum over k.
    pub(crate) weight: ComplexLanes,
    /// exp(-2 g h1) where the outer face of the coupling is heard, else 0.
    pub(crate) echo: ComplexLanes,
}

impl Tables {
    /// Tables for a pulse of the given amplitude.
    pub(crate) fn new(setup: &Setup, sampling: Sampling, amplitude: f64) -> Self {
        let probe = &setup.probe;
        let pulse = Pulse::new(amplitude, probe.center_frequency);
        let count =
            (0..sampling.frequencies()).take_while(|&n| sampling.taper(n) > TAPER_MIN).count();
        let spectrum = pulse.spectrum(sampling.damping, sampling.period, count);
        let keep = sampling.pairs() <= KEPT_PAIRS_MAX;
        let frequencies: Vec<_> = spectrum
            .iter()
            .enumerate()
            .map(|(n, pulse)| {
                let mut frequency =
                    Frequency::new(setup, &sampling, n, pulse.scale(sampling.taper(n)));
                if keep {
                    frequency.kept = (0..frequency.blocks)
                        .map(|b| frequency.block(setup, &sampling, b))
                        .collect();
                }
                frequency
            })
            .collect();
        let blocks = frequencies.iter().map(|f| f.blocks).max().unwrap_or(0);
        let positions: Vec<f64> = distances(setup).collect();
        let cosines = positions
            .iter()
            .flat_map(|&x| (0..blocks).map(move |b| (b, x)))
            .map(|(b, x)| {
                Lanes(std::array::from_fn(|lane| {
                    let k = (b * LANES + lane) as f64 * sampling.wavenumber_step;
                    libm::cos(k * x)
                }))
            })
            .collect();
        Self { setup: *setup, sampling, frequencies, cosines, receivers: positions.len(), blocks }
    }

    /// Block `b` of a frequency, taken from the tables or made in `scratch`.
    #[inline(always)]
    pub(crate) fn block<'a>(
        &'a self,
        frequency: &'a Frequency,
        b: usize,
        scratch: &'a mut Option<Block>,
    ) -> &'a Block {
        match frequency.kept.get(b) {
            Some(block) => block,
            None => scratch.insert(frequency.block(&self.setup, &self.sampling, b)),
        }
    }

    /// cos(k x) at receiver `r`, one entry per block of wavenumbers.
    #[inline(always)]
    pub(crate) fn cosines(&self, r: usize) -> &[Lanes] {
        &self.cosines[r * self.blocks..(r + 1) * self.blocks]
    }

    pub(crate) fn receivers(&self) -> usize {
        self.receivers
    }
}

impl Frequency {
    fn new(setup: &Setup, sampling: &Sampling, n: usize, pulse: Complex) -> Self {
        let s = Complex::new(sampling.damping, sampling.angular_frequency(n));
        let inertia = (s * s).scale(setup.layers.coupling.density);
        let blocks = sampling.wavenumbers(n).div_ceil(LANES);
        Self { s, inertia, pulse, n, blocks, kept: Vec::new() }
    }

    fn block(&self, setup: &Setup, sampling: &Sampling, b: usize) -> Block {
        let count = sampling.wavenumbers(self.n);
        let mut block = Block {
            k: Lanes::ZERO,
            g: ComplexLanes::ZERO,
            load: ComplexLanes::ZERO,
            weight: ComplexLanes::ZERO,
            echo: ComplexLanes::ZERO,
        };
        for lane in 0..LANES {
            let m = b * LANES + lane;
            let k = m.min(count - 1) as f64 * sampling.wavenumber_step;
            let point = spectral_point(setup, sampling, self.s, k);
            // The trapezoidal rule from k = 0 on, over (1/π) ∫ … cos(kx) dk.
            let measure = match m {
                0 => 0.5 * sampling.wavenumber_step / PI,
                m if m < count => sampling.wavenumber_step / PI,
                _ => 0.0,
            };
            block.k.0[lane] = k;
            set(&mut block.g, lane, point.g);
            set(&mut block.load, lane, point.load);
            set(&mut block.weight, lane, (point.factor * self.pulse).scale(measure));
            set(&mut block.echo, lane, point.echo);
        }
        block
    }
}

/// What the fluids contribute at one (k, s).
struct SpectralPoint {
    g: Complex,
    load: Complex,
    /// Factor of the reflection coefficient in p̂ per unit of F.
    factor: Complex,
    echo: Complex,
}

/// The pressure in fluid 1 less the direct wave and its image in the outer face is, per unit of F,
///
/// ```text
/// ρ1/(2g) e2 (1 - ea) (1 - eb) R / (1 + R E2)
/// e2 = exp(-g (x3 + x3S)), ea = exp(-2g (h1 - x3)), eb = exp(-2g (h1 - x3S)), E2 = exp(-2g h1)
/// ```
///
/// and ρ1/(2g) e2 R while no reflection of the outer face is heard.
fn spectral_point(setup: &Setup, sampling: &Sampling, s: Complex, k: f64) -> SpectralPoint {
    let coupling = &setup.layers.coupling;
    let (source, receivers) = (setup.probe.source.x3, setup.probe.receivers.x3);
    let one = Complex::new(1.0, 0.0);
    let g = vertical_wavenumber(k, s, coupling.sound_speed);
    let damp = |length: f64| (-g.scale(length)).exp();
    let mut factor = damp(source + receivers).scale(0.5 * coupling.density) / g;
    let mut echo = Complex::default();
    if sampling.upper_echoes {
        factor = factor
            * (one - damp(2.0 * (coupling.thickness - receivers)))
            * (one - damp(2.0 * (coupling.thickness - source)));
        echo = damp(2.0 * coupling.thickness);
    }
    let load = marrow_load(setup, s, k, sampling.lower_echoes);
    SpectralPoint { g, load, factor, echo }
}

/// Z with τ3 = Z u3 at the bone's lower face, Pa/m: ρ2 s² tanh(g2 h2)/g2, or ρ2 s²/g2 while no
/// reflection of the marrow's outer face is heard.
pub(crate) fn marrow_load(setup: &Setup, s: Complex, k: f64, echoes: bool) -> Complex {
    let marrow = &setup.layers.marrow;
    let g = vertical_wavenumber(k, s, marrow.sound_speed);
    let load = (s * s).scale(marrow.density) / g;
    if !echoes {
        return load;
    }
    let one = Complex::new(1.0, 0.0);
    let decay = (-g.scale(2.0 * marrow.thickness)).exp();
    load * ((one - decay) / (one + decay))
}

/// √(k² + s²/c²), real part > 0.
fn vertical_wavenumber(k: f64, s: Complex, c: f64) -> Complex {
    let over_c = s.scale(1.0 / c);
    (over_c * over_c + Complex::new(k * k, 0.0)).sqrt()
}

fn set(lanes: &mut ComplexLanes, lane: usize, value: Complex) {
    lanes.re.0[lane] = value.re;
    lanes.im.0[lane] = value.im;
}
