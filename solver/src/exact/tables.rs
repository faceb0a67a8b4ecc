//! Tables that all realizations of one setup share: they depend only on layers, probe, solver
//! settings and the speed bin.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use osteon_common::case::Setup;
use osteon_common::sampling::{FrequencyRun, RUN, WaveSampling};

use crate::complex::Complex;
use crate::exact::attenuation::LosslessFrequencies;
use crate::exact::fluid_waves::{FluidWaves, vertical_wavenumber};
use crate::exact::height_factors::{HeightFactors, height_factors};
use crate::exact::heights::Heights;
use crate::exact::spectral_point::spectral_point;
use crate::exact::table_memory::TableMemory;
use crate::lanes::{ComplexLanes, LANES, Lanes};
use crate::pulse::Pulse;

/// Tables of one sampling.
#[derive(Debug)]
pub(crate) struct Tables {
    setup: Setup,
    heights: Heights,
    pub(crate) sampling: WaveSampling,
    /// Positions of the lines on the frequency axis, eight lines per run.
    pub(crate) runs: Vec<FrequencyRun>,
    pub(crate) lines: Vec<Line>,
    /// Wavenumbers, rad/m, in blocks.
    wavenumbers: Vec<Lanes>,
    /// cos(k x) of wavenumber block b at receiver r, at `[r * blocks + b]`.
    cosines: Vec<Lanes>,
    receivers: usize,
    /// Share of a block's weights that are the mirror wave: a half, or 0 if it is left out.
    pub(crate) mirror: f64,
    /// Maximum number of blocks of a line.
    blocks: usize,
    /// Memory in which lines are kept; without it they are recomputed whenever they are needed.
    memory: Option<Arc<TableMemory>>,
}

/// The waves that spectra consist of, other than the direct wave and its images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Waves {
    All,
    /// Those that may arrive before the direct wave: without the mirror wave, which a face without
    /// stiffness in place of the bone would reflect. It is the largest wave near the direct one, and
    /// what band and sums cut off of it would disturb the first arrival.
    Early,
}

/// One complex frequency.
#[derive(Debug)]
pub(crate) struct Line {
    /// Number of the frequency.
    pub(crate) n: usize,
    /// α + i ω, 1/s.
    pub(crate) s: Complex,
    /// The frequencies that include the attenuation of the layers.
    pub(crate) lossless: LosslessFrequencies,
    /// ρ1 s² of the bone's lossless frequency, kg/m³/s².
    pub(crate) inertia: Complex,
    /// F(s) times the line's weight in the sum over frequencies; not yet tapered.
    pub(crate) pulse: Complex,
    /// Number of blocks of wavenumbers; none if the line is not needed.
    pub(crate) blocks: usize,
    /// Filled when the line is first needed; remains empty if it would take too much memory.
    kept: OnceLock<KeptLine>,
}

/// Contents of a line that is kept.
#[derive(Debug, Default)]
pub(crate) struct KeptLine {
    blocks: Vec<Block>,
    /// exp(-2 g h1) of the blocks if echoes of the coupling's outer face matter, otherwise empty.
    echoes: Vec<ComplexLanes>,
    /// The height factors of every block and fluid if the probe is tilted, otherwise empty.
    height_factors: Vec<HeightFactors>,
}

/// Eight neighbouring wavenumbers of one frequency.
#[derive(Debug)]
pub(crate) struct Block {
    /// g = √(k² + s²/c1²), rad/m.
    pub(crate) g: ComplexLanes,
    /// Z = ρ2 s² tanh(g2 h2)/g2, Pa/m, divided by m(s) of the bone: the load on the lower face.
    pub(crate) load: ComplexLanes,
    /// All factors of (R + 1)/(1 + R E2), twice, including the measure of the sum over k.
    pub(crate) weight: ComplexLanes,
}

impl Tables {
    /// Returns the memory of tables without their lines' contents, bytes.
    pub(crate) fn bytes(setup: &Setup, sampling: &WaveSampling) -> f64 {
        let highest = sampling.runs().iter().flat_map(|run| run.frequencies()).max().unwrap_or(0);
        let cosines = sampling.wavenumbers(highest) * setup.probe.receivers.count as usize;
        (cosines * size_of::<f64>()) as f64
    }

    /// Creates the tables for a pulse of the given amplitude, and some waves.
    ///
    /// `taper` cuts the whole band; lines are kept in `memory`, or recomputed whenever they are
    /// needed.
    pub(crate) fn new(
        setup: &Setup,
        sampling: WaveSampling,
        waves: Waves,
        amplitude: f64,
        taper: (f64, f64),
        memory: Option<Arc<TableMemory>>,
    ) -> Self {
        let (probe, heights) = (&setup.probe, Heights::from_setup(setup));
        let runs = sampling.runs();
        let numbers: Vec<usize> = runs.iter().flat_map(|run| run.frequencies()).collect();
        let spectrum =
            Pulse::new(amplitude, probe).spectrum(sampling.damping, sampling.period, &numbers);
        let lines: Vec<_> = numbers
            .iter()
            .zip(spectrum)
            .map(|(&n, pulse)| Line::new(setup, &heights, &sampling, n, pulse, taper))
            .collect();
        let blocks = lines.iter().map(|line| line.blocks).max().unwrap_or(0);
        let positions: Vec<f64> = setup.probe.places().map(|place| place.x).collect();
        let wavenumbers: Vec<Lanes> = (0..blocks)
            .map(|b| {
                let first = b * LANES;
                Lanes(std::array::from_fn(|lane| (first + lane) as f64 * sampling.wavenumber_step))
            })
            .collect();
        let cosines = positions
            .iter()
            .flat_map(|&x| wavenumbers.iter().map(move |k| Lanes(k.0.map(|k| libm::cos(k * x)))))
            .collect();
        Self {
            setup: setup.clone(),
            heights,
            sampling,
            runs,
            lines,
            wavenumbers,
            cosines,
            receivers: positions.len(),
            mirror: if waves == Waves::All { 0.5 } else { 0.0 },
            blocks,
            memory,
        }
    }

    /// Returns the contents of a line, empty if they are not kept.
    pub(crate) fn kept_line<'a>(&self, line: &'a Line) -> &'a KeptLine {
        line.kept.get_or_init(|| match &self.memory {
            Some(memory) if memory.reserve(line.bytes(&self.sampling, &self.heights)) => {
                line.contents(&self.setup, &self.heights, &self.sampling)
            }
            _ => KeptLine::default(),
        })
    }

    /// Returns block `b` of a line, from its contents or computed into `scratch`.
    #[inline(always)]
    pub(crate) fn block<'a>(
        &self,
        line: &Line,
        kept: &'a KeptLine,
        b: usize,
        scratch: &'a mut Option<(Block, ComplexLanes)>,
    ) -> (&'a Block, &'a ComplexLanes) {
        if let Some(block) = kept.blocks.get(b) {
            return (block, kept.echoes.get(b).unwrap_or(&ComplexLanes::ZERO));
        }
        let (block, echo) =
            scratch.insert(line.block(&self.setup, &self.heights, &self.sampling, b));
        (block, echo)
    }

    /// Returns the numbers at which the receivers in one fluid after the other end, upwards.
    #[inline(always)]
    pub(crate) fn receivers_in_fluids(&self) -> &[usize] {
        &self.heights.ends
    }

    /// Returns the factors of block `b` of a line that lead from one receiver of a tilted probe to the
    /// next higher one in the same fluid, from its contents or computed into `scratch`. Fluids with receivers
    /// are numbered upwards.
    #[inline(always)]
    pub(crate) fn height_factors<'a>(
        &self,
        line: &Line,
        kept: &'a KeptLine,
        b: usize,
        fluid: usize,
        scratch: &'a mut Option<HeightFactors>,
    ) -> &'a HeightFactors {
        match kept.height_factors.get(b * self.heights.ends.len() + fluid) {
            Some(factors) => factors,
            None => scratch.insert(line.height_factors(&self.heights, &self.sampling, b, fluid)),
        }
    }

    /// Returns whether the receivers are at different heights.
    pub(crate) fn is_tilted(&self) -> bool {
        self.heights.are_different()
    }

    /// Returns the receivers with these numbers, counted from the lowest to the highest.
    #[inline(always)]
    pub(crate) fn upwards(&self, numbers: Range<usize>) -> impl Iterator<Item = usize> {
        let (receivers, falling) = (self.receivers, self.heights.falling);
        numbers.map(move |i| if falling { receivers - 1 - i } else { i })
    }

    /// Returns the wavenumbers of block `b`, rad/m, which are the same at every frequency.
    #[inline(always)]
    pub(crate) fn wavenumbers(&self, b: usize) -> &Lanes {
        &self.wavenumbers[b]
    }

    /// Returns cos(k x) at receiver `r`, one entry per block of wavenumbers.
    #[inline(always)]
    pub(crate) fn cosines(&self, r: usize) -> &[Lanes] {
        &self.cosines[r * self.blocks..(r + 1) * self.blocks]
    }

    pub(crate) fn receivers(&self) -> usize {
        self.receivers
    }

    /// Returns the number of lines, from the first on, that contribute to a signal cut by a taper.
    pub(crate) fn lines_within(&self, taper: (f64, f64)) -> usize {
        let within = |line: &Line| self.sampling.is_within(line.n, taper);
        self.lines.iter().rposition(within).map_or(0, |last| last + 1)
    }

    /// Returns the number of (frequency, wavenumber) pairs of some lines.
    pub(crate) fn pairs(&self, lines: Range<usize>) -> u64 {
        self.lines[lines].iter().map(|line| (line.blocks * LANES) as u64).sum()
    }

    /// Returns the weights of the lines, eight at a time, for a taper with this start and end, Hz.
    pub(crate) fn taper(&self, taper: (f64, f64)) -> Vec<Lanes> {
        let weights = |run: &FrequencyRun| {
            let mut lanes = Lanes::ZERO;
            for (lane, n) in lanes.0.iter_mut().zip(run.frequencies()) {
                *lane = self.sampling.taper(n, taper);
            }
            lanes
        };
        self.runs.iter().map(weights).collect()
    }
}

impl Line {
    fn new(
        setup: &Setup,
        heights: &Heights,
        sampling: &WaveSampling,
        n: usize,
        pulse: Complex,
        taper: (f64, f64),
    ) -> Self {
        let s = Complex::new(sampling.damping, sampling.angular_frequency(n));
        let lossless = LosslessFrequencies::at(&setup.layers, s);
        let inertia = (lossless.bone * lossless.bone).scale(heights.face_density());
        let within = sampling.is_within(n, taper);
        let blocks = if within { sampling.wavenumbers(n) / LANES } else { 0 };
        // Of the two signs of every frequency but zero, only one is summed: hence the sum's factor
        // 2.
        let share = if n == 0 { 0.5 } else { sampling.share(n) };
        Self { n, s, lossless, inertia, pulse: pulse.scale(share), blocks, kept: OnceLock::new() }
    }

    /// Returns the memory of the line's contents, bytes.
    fn bytes(&self, sampling: &WaveSampling, heights: &Heights) -> u64 {
        let echo = if sampling.upper_echoes { size_of::<ComplexLanes>() } else { 0 };
        let fluids = if heights.are_different() { heights.ends.len() } else { 0 };
        let factors = fluids * size_of::<HeightFactors>();
        (self.blocks * (size_of::<Block>() + echo + factors)) as u64
    }

    /// Computes all blocks.
    fn contents(&self, setup: &Setup, heights: &Heights, sampling: &WaveSampling) -> KeptLine {
        let mut kept = KeptLine::default();
        kept.blocks.reserve_exact(self.blocks);
        for b in 0..self.blocks {
            let (block, echo) = self.block(setup, heights, sampling, b);
            kept.blocks.push(block);
            if heights.are_different() {
                let of = |fluid| self.height_factors(heights, sampling, b, fluid);
                kept.height_factors.extend((0..heights.ends.len()).map(of));
            }
            if sampling.upper_echoes {
                kept.echoes.push(echo);
            }
        }
        kept
    }

    /// Computes one block, and exp(-2 g h1) if echoes of the coupling's outer face matter,
    /// otherwise 0.
    fn block(
        &self,
        setup: &Setup,
        heights: &Heights,
        sampling: &WaveSampling,
        b: usize,
    ) -> (Block, ComplexLanes) {
        let zero = ComplexLanes::ZERO;
        let (mut block, mut echo) = (Block { g: zero, load: zero, weight: zero }, zero);
        for lane in 0..LANES {
            let m = b * LANES + lane;
            let k = m as f64 * sampling.wavenumber_step;
            let frequencies = (self.s, &self.lossless);
            let point = spectral_point(setup, heights, sampling, frequencies, k);
            // The trapezoidal rule from k = 0 on, for (1/π) ∫ … cos(kx) dk.
            let end = if m == 0 { 0.5 } else { 1.0 };
            let measure = end * sampling.wavenumber_step / PI;
            let weight = measure * sampling.wavenumber_weight(self.n, k);
            set(&mut block.g, lane, point.g);
            set(&mut block.load, lane, point.load);
            set(&mut block.weight, lane, (point.factor * self.pulse).scale(weight));
            set(&mut echo, lane, point.echo);
        }
        (block, echo)
    }

    /// Computes the factors of one block that lead from one receiver in a fluid to the next higher one.
    fn height_factors(
        &self,
        heights: &Heights,
        sampling: &WaveSampling,
        b: usize,
        fluid: usize,
    ) -> HeightFactors {
        let zero = ComplexLanes::ZERO;
        let mut factors =
            HeightFactors { start: zero, from_below: zero, from_above: zero, image: zero };
        for lane in 0..LANES {
            let k = (b * LANES + lane) as f64 * sampling.wavenumber_step;
            let s = self.lossless.coupling;
            let (g, image) = match heights.fluids.as_slice() {
                [one] => {
                    let g = vertical_wavenumber(k, s, one.sound_speed);
                    let depth = sampling.upper_echoes.then_some(one.thickness - heights.lowest);
                    let image = |depth: f64| (-g.scale(2.0 * depth)).exp();
                    (g, depth.map_or(Complex::default(), image))
                }
                _ => {
                    let waves = FluidWaves::new(&heights.fluids, k, s, sampling.upper_echoes);
                    let (lowest, first) = (heights.lowest, heights.height(heights.first_in(fluid)));
                    let wave = waves.at(first);
                    let start = wave.outwards(first) / waves.at(lowest).outwards(lowest);
                    set(&mut factors.start, lane, start);
                    (wave.g, -wave.inwards_ratio(first))
                }
            };
            let [below, above] = height_factors(g, heights.step);
            set(&mut factors.from_below, lane, below);
            set(&mut factors.from_above, lane, above);
            set(&mut factors.image, lane, image);
        }
        factors
    }
}

fn set(lanes: &mut ComplexLanes, lane: usize, value: Complex) {
    lanes.re.0[lane] = value.re;
    lanes.im.0[lane] = value.im;
}

/// Compile-time check: a run of frequencies fills the lanes.
const _: () = assert!(RUN == LANES);
