//! The tables of one speed bin, and the bands that passes may use of them.

use std::sync::Arc;

use osteon_common::case::Setup;
use osteon_common::sampling::{Grade, RUN, WaveSampling, velocity_taper};

use crate::arrival::Sampled;
use crate::exact::signal::TimeGrid;
use crate::exact::table_memory::TableMemory;
use crate::exact::tables::{Tables, Waves};
use crate::lanes::{LANES, Lanes};

/// The tapers with which the error estimate compares: start and end, as multiples of the band. They
/// are sharper and narrower, since the error is the part of the pulse's kink that the smooth taper
/// removes.
const OTHER_TAPERS: [(f64, f64); LANES] = [
    (0.2, 1.0),
    (0.3, 0.7),
    (0.5, 0.6),
    (0.7, 0.8),
    (0.85, 0.9),
    (0.8, 1.0),
    (0.9, 1.0),
    (0.95, 1.0),
];
/// The taper of a quick or plain grade is a mixture: these parts of the other tapers, and the smooth one
/// for the rest. It weighs the upper end of the band more, and so makes up for some of what lies beyond.
/// Fitted to the errors of the usual geometry at dispersions of 0.1 to 0.6 and with a plate of 1 mm:
/// the largest 1 % of them become 10 to 30 % smaller.
const TAPER_PARTS: [f64; LANES] = [-0.1, 0.39, -0.47, -0.3, -0.39, 0.33, 0.24, 0.74];

/// Tables of one speed bin, shared by all bones.
#[derive(Debug)]
pub(crate) struct BinTables {
    pub(crate) tables: Tables,
    pub(super) grid: TimeGrid,
    /// The band of the first pass.
    pub(crate) first: Band,
    /// The bands of further passes, each wider than the one before.
    pub(crate) wider: Vec<Band>,
}

/// One band of a bin.
#[derive(Debug)]
pub(crate) struct Band {
    pub(crate) sampled: Sampled,
    /// Number of lines that it needs, from the first on.
    pub(crate) lines: usize,
    /// One weight per line, for the runs that contain the lines.
    pub(super) taper: Vec<Lanes>,
    /// The tapers of the error estimate, side by side, per run and line.
    pub(super) others: Vec<[Lanes; LANES]>,
}

impl BinTables {
    /// Returns the memory of a bin that is kept, without the contents of its lines, bytes.
    pub(crate) fn bytes(setup: &Setup, sampling: &WaveSampling) -> u64 {
        let lines = sampling.runs().len() * RUN;
        (Tables::bytes(setup, sampling) + TimeGrid::bytes(setup, lines)) as u64
    }

    /// Creates the tables of a bin, which are kept in `memory`, or recomputed whenever they are
    /// needed.
    pub(crate) fn new(
        setup: &Setup,
        sampling: WaveSampling,
        memory: Option<Arc<TableMemory>>,
    ) -> Self {
        let whole = velocity_taper(sampling.whole_band());
        // A velocity does not depend on the pulse's amplitude, not even in its last bit.
        let keep = memory.is_some();
        let tables = Tables::new(setup, sampling, Waves::Early, 1.0, whole, memory);
        let grid = TimeGrid::new(setup, &tables, keep);
        let first = Band::new(&tables, sampling.first_band());
        let wider = sampling.bands.windows(2).filter(|pair| pair[0] < pair[1]);
        let wider = wider.map(|pair| Band::new(&tables, pair[1])).collect();
        Self { tables, grid, first, wider }
    }
}

impl Band {
    fn new(tables: &Tables, band: f64) -> Self {
        let cut = velocity_taper(band);
        let lines = tables.lines_within(cut);
        let mut taper = tables.taper(cut);
        taper.truncate(lines.div_ceil(LANES));
        let mut others = vec![[Lanes::ZERO; LANES]; taper.len()];
        for (lane, (start, end)) in OTHER_TAPERS.into_iter().enumerate() {
            for (taper, weights) in others.iter_mut().zip(tables.taper((start * band, end * band)))
            {
                for (line, weight) in taper.iter_mut().zip(weights.0) {
                    line.0[lane] = weight;
                }
            }
        }
        if matches!(tables.sampling.grade, Grade::Quick | Grade::Plain) {
            add_parts(&mut taper, &others);
        }
        let pairs = tables.pairs(0..lines);
        let sampled = Sampled { band, period: tables.sampling.period, pairs };
        Self { sampled, lines, taper, others }
    }
}

/// Adds parts of the other tapers to the smooth one.
fn add_parts(smooth: &mut [Lanes], others: &[[Lanes; LANES]]) {
    for (taper, others) in smooth.iter_mut().zip(others) {
        for (own, weights) in taper.0.iter_mut().zip(others) {
            let parts = weights.0.iter().zip(TAPER_PARTS);
            *own += parts.fold(0.0, |sum, (other, part)| (other - *own).mul_add(part, sum));
        }
    }
}
