//! Exact layers in the (frequency, wavenumber) domain.
//!
//! A bone is computed in one or several passes (`passes.rs`). Each uses the sampling of one grade in
//! one band. Within a grade, the band is widened while the estimated error is large. The grades, in
//! their order:
//!
//! 1. Quick: suffices for most bones.
//! 2. Plain, a finer sampling: if the error of the quick grade stays large, or if the first arrival is
//!    small compared with later waves.
//! 3. Thorough: if the pick is unreliable (late, weak, off the line of the others, or missing), if the
//!    sampling's part of the error is large, or if the whole error is large after all bands.
//! 4. Full, finer still and with nothing left out: if the sampling's part of the error is large even
//!    then.
//!
//! The results of two passes are blended with a weight from 0 (the first is reliable) to 1 (the second
//! replaces it). The tables are made for a geometric grid of speeds, whose intervals are called speed
//! bins; near the edge of a bin the results of both neighbours are blended, too. So the velocity
//! remains a continuous function of the bone. All of this depends on the bone alone.

pub(crate) mod attenuation;
mod bin_tables;
mod blending;
pub(crate) mod direct;
pub(crate) mod element_average;
mod estimated;
mod factors;
mod fluid_spectra;
mod fluid_waves;
mod grade_caches;
pub(crate) mod growth;
pub(crate) mod guided;
mod height_factors;
mod heights;
mod layer;
pub(crate) mod pass;
mod passes;
pub(crate) mod plate;
mod plate_stack;
mod prepared_setup;
#[cfg(feature = "measure")]
pub(crate) mod quantities;
pub(crate) mod response;
pub(crate) mod series;
pub(crate) mod signal;
mod spectral_point;
#[cfg(feature = "measure")]
pub mod stages;
pub(crate) mod table_cache;
pub(crate) mod table_memory;
pub(crate) mod tables;
pub(crate) mod tilted;
pub(crate) mod traces;
mod weights;

use std::sync::Arc;

use osteon_common::bone::BoneRef;
use osteon_common::case::Setup;
use osteon_common::probe::Place;
use osteon_common::sampling::{self, OuterFaces};

use crate::arrival::Arrival;
use crate::exact::estimated::Estimated;
use crate::exact::grade_caches::GradeCaches;
use crate::exact::pass::ExactWorkspace;
use crate::exact::passes::BonePasses;
use crate::exact::prepared_setup::PreparedSetup;
use crate::exact::table_cache::too_large;
use crate::exact::table_memory::TableMemory;
use crate::failure::Failure;
use crate::isa::Isa;
use crate::picking;

/// Times from a pick to the earliest possible echo, in periods, between which the weight of the
/// result without outer faces rises.
const BEFORE_ECHO: (f64, f64) = (0.0, 0.1);
/// Ratio of a pick to the largest wave in its window below which an echo may hide it as noise.
const FAINT: f64 = 10.0 * picking::FLOOR;

/// Ratio of the stated error of a bone of sublayers to the one that a plate's rules estimate. Of 889 random
/// stacks of 2 to 8 sublayers, 14 had errors beyond the latter, 6 or fewer of them by more than this.
const SUBLAYERS_FACTOR: f64 = 2.0;

/// The exact method for one setup, with the tables that all its realizations share. Clones share
/// them.
#[derive(Debug, Clone)]
pub(crate) struct Exact {
    prepared: PreparedSetup,
    without_faces: Arc<GradeCaches>,
    with_faces: Arc<GradeCaches>,
}

impl Exact {
    /// Creates the method with `memory` for its tables.
    pub(crate) fn new(setup: &Setup, isa: Isa, memory: &Arc<TableMemory>) -> Self {
        Self {
            prepared: PreparedSetup::new(setup, isa),
            without_faces: Arc::new(GradeCaches::new(setup, OuterFaces::None, memory)),
            with_faces: Arc::new(GradeCaches::new(setup, OuterFaces::Audible, memory)),
        }
    }

    /// Returns the method for another setup with the same tables ([`has_tables_of`]), which it shares.
    pub(crate) fn with_setup(&self, setup: &Setup) -> Self {
        Self { prepared: self.prepared.with_setup(setup), ..self.clone() }
    }

    pub(crate) fn arrival(
        &self,
        bone: BoneRef<'_>,
        workspace: &mut ExactWorkspace,
    ) -> Result<Arrival, Failure> {
        let (media, speed) = self.prepared.media(bone)?;
        let bin =
            sampling::speed_bin(&self.prepared.setup, speed).ok_or_else(|| too_large(speed))?;
        let caches = &self.without_faces;
        let mut passes = BonePasses::new(&self.prepared, caches, &media, speed, bin, workspace);
        let mut found = passes.run_in_bins();
        if self.needs_faces(&found, speed) {
            passes.caches = &self.with_faces;
            found = self.with_echoes(found, passes.run_in_bins(), speed);
        }
        let BonePasses { count, pairs, .. } = passes;
        let factor = if media.lower.is_empty() { 1.0 } else { SUBLAYERS_FACTOR };
        found.map(|found| found.arrival(count, pairs, factor))
    }

    /// Returns whether reflections of the outer faces may change the pick that was found without
    /// them.
    fn needs_faces(&self, found: &Result<Estimated, Failure>, speed: f64) -> bool {
        let is_certain = |found: &Estimated| {
            self.time_to_echo(found, speed) > picking::PACKET_PERIODS
                && found.pick.prominence > FAINT
        };
        sampling::echoes_are_audible(&self.prepared.setup, speed)
            && !found.as_ref().is_ok_and(is_certain)
    }

    /// Chooses between the results without and with outer faces. The faces may change which extremum
    /// is picked, but not its time before the earliest echo, which is more accurate without the
    /// waves that they keep in the fluids.
    fn with_echoes(
        &self,
        without: Result<Estimated, Failure>,
        with: Result<Estimated, Failure>,
        speed: f64,
    ) -> Result<Estimated, Failure> {
        let time = without.as_ref().map_or(0.0, |found| self.time_to_echo(found, speed));
        let weight = 1.0 - weights::rise(time, BEFORE_ECHO);
        blending::merge(&self.prepared, without, with, weight)
    }

    /// Returns the least time from a pick to the earliest possible echo, in periods.
    fn time_to_echo(&self, found: &Estimated, speed: f64) -> f64 {
        let echo = |&place: &Place| sampling::earliest_echo(&self.prepared.setup, place, speed);
        let echoes = self.prepared.places.iter().map(echo);
        let times = echoes.zip(&found.pick.times).map(|(echo, t)| echo - t);
        times.fold(f64::INFINITY, f64::min) * self.prepared.setup.probe.center_frequency
    }
}

/// Returns whether two setups have the same tables. Tables describe coupling, marrow, probe and
/// sampling, not what is picked; the bone's thickness matters only by the band that a thin plate needs.
pub(crate) fn has_tables_of(setup: &Setup, other: &Setup) -> bool {
    let mut alike = setup.clone();
    alike.layers.bone_thickness = other.layers.bone_thickness;
    alike.picking = other.picking;
    alike.structure = other.structure.clone();
    alike == *other && sampling::thinness(setup).to_bits() == sampling::thinness(other).to_bits()
}
