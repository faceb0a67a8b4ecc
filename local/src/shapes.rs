//! How the guided waves of a case's bone move it at each depth.

use std::fmt::Write as _;

use osteon_common::case::Case;
use osteon_solver::{Complex, FluidModes, Isa, Mode, ModeShape, ShapeError, ShapePoint, Solver};
use rayon::ThreadPoolBuildError;
use rayon::prelude::*;
use thiserror::Error;

use crate::modes::{BandModes, BoneSurroundings};

/// Maximum number of depths of one wave.
pub const DEPTHS_MAX: u32 = 1001;
/// Maximum number of depths of all waves: 300 MB of text.
const POINTS_MAX: usize = 1_000_000;

/// The waves of a bone with their fields across it.
#[derive(Debug, Clone, PartialEq)]
pub struct BandShapes {
    /// Each wave with its frequency, Hz, and its field; `None` where that of another wave is the same but for
    /// rounding.
    waves: Vec<(f64, Mode, Option<ModeShape>)>,
}

/// Why the fields of guided waves are not known.
#[derive(Debug, Error)]
pub enum BandShapesError {
    /// A field is not known.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// There would be too many rows.
    #[error(
        "shapes: {waves} waves at {depths} depths are too many rows; at most {POINTS_MAX} are written: give \
         fewer frequencies or depths"
    )]
    TooMany {
        /// Number of waves of all frequencies.
        waves: usize,
        /// Number of depths.
        depths: usize,
    },
    /// No threads can be started.
    #[error(transparent)]
    Threads(#[from] ThreadPoolBuildError),
}

impl BandShapes {
    /// Computes the fields at `depths` depths of these waves of the case's bone. They are the same for every
    /// number of threads.
    ///
    /// # Errors
    /// If there are too many, or less than 2 depths, or if no threads can be started.
    pub fn compute(
        case: &Case,
        modes: &BandModes,
        depths: u32,
        isa: Isa,
        threads: usize,
    ) -> Result<Self, BandShapesError> {
        let depths = depths as usize;
        let of_frequency = |(frequency, found): &(f64, FluidModes)| {
            let of_wave = |mode: &Mode| (*frequency, mode.clone());
            found.modes.iter().map(of_wave).collect::<Vec<_>>()
        };
        let all: Vec<(f64, Mode)> = modes.frequencies.iter().flat_map(of_frequency).collect();
        let waves = all.len();
        if waves * depths > POINTS_MAX {
            return Err(BandShapesError::TooMany { waves, depths });
        }
        let solver = Solver::with_isa(&case.setup, isa);
        let shape = |(frequency, mode): (f64, Mode)| {
            let found = match modes.surroundings {
                BoneSurroundings::Vacuum => solver.shape(&case.bone, &mode, depths),
                BoneSurroundings::Fluids => solver.shape_in_fluids(&case.bone, &mode, depths),
            };
            match found {
                Ok(shape) => Ok((frequency, mode, Some(shape))),
                Err(ShapeError::Undecided { .. }) => Ok((frequency, mode, None)),
                Err(error) => Err(error),
            }
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let found: Vec<Result<_, ShapeError>> =
            pool.install(|| all.into_par_iter().map(shape).collect());
        Ok(Self { waves: found.into_iter().collect::<Result<_, _>>()? })
    }

    /// Returns one row for each wave, frequency and depth, with a heading; a single one without depth of a
    /// wave whose field is not known.
    pub fn to_csv(&self) -> String {
        let mut text = "frequency,wave,family,rank,wavenumber,depth".to_owned();
        for name in ["u1", "u2", "u3", "sigma13", "sigma23", "sigma33"] {
            // Writing to a string cannot fail.
            let _ = write!(text, ",{name}_real,{name}_imaginary");
        }
        text.push('\n');
        for (frequency, mode, shape) in &self.waves {
            let Mode { family, rank, name, wavenumber, .. } = mode;
            let name = name.as_deref().unwrap_or("");
            let wave = format!("{frequency:?},{name},{family},{rank},{wavenumber:?}");
            match shape {
                Some(shape) => {
                    for point in &shape.points {
                        let _ = writeln!(text, "{wave},{}", row(point));
                    }
                }
                None => {
                    let _ = writeln!(text, "{wave}{}", ",".repeat(13));
                }
            }
        }
        text
    }
}

/// Returns the fields of one depth.
fn row(point: &ShapePoint) -> String {
    let mut text = format!("{:?}", point.depth);
    for Complex { re, im } in point.displacement.into_iter().chain(point.traction) {
        // Writing to a string cannot fail.
        let _ = write!(text, ",{re:?},{im:?}");
    }
    text
}
