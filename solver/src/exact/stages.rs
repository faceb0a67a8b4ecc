//! The individual stages of one realization, for benchmarks.
//!
//! They use the code of [`Solver::arrival`](crate::Solver::arrival), divided so that the time
//! between them can be measured, for the first pass at a bone, after which most bones need nothing
//! more. There, admittances and sums alternate, frequency by frequency; here all admittances come
//! first. Each stage may be repeated.

use std::sync::Arc;

use osteon_common::bone::BoneRef;
use osteon_common::case::Setup;
use osteon_common::sampling::{self, Grade, OuterFaces, SPEED_BINS};

use crate::arrival::Arrival;
use crate::exact::bin_tables::Band;
use crate::exact::grade_caches::GradeCaches;
use crate::exact::pass::{self, ExactWorkspace};
use crate::exact::prepared_setup::PreparedSetup;
use crate::exact::response::respond;
use crate::exact::table_cache::TablesRef;
use crate::exact::table_memory::TableMemory;
use crate::failure::Failure;
use crate::isa::Isa;
use crate::lanes::ComplexLanes;
use crate::media::Media;

/// The exact method for one setup.
#[derive(Debug)]
pub struct Stages {
    prepared: PreparedSetup,
    caches: GradeCaches,
}

/// Scratch memory of one thread.
#[derive(Debug, Default)]
pub struct StageWorkspace {
    exact: ExactWorkspace,
    /// Responses of each line.
    responses: Vec<Vec<ComplexLanes>>,
}

/// A bone whose tensor has been converted into the common part of its plate's admittances.
#[derive(Debug)]
pub struct PlateStage<'a> {
    prepared: &'a PreparedSetup,
    bin: TablesRef<'a>,
    accurate: bool,
    media: Media,
    speed: f64,
    memory: &'a mut StageWorkspace,
}

/// A plate whose responses at every frequency and wavenumber are known.
#[derive(Debug)]
pub struct ResponseStage<'a, 'b>(&'a mut PlateStage<'b>);

/// A plate whose spectra at every receiver are known.
#[derive(Debug)]
pub struct SpectraStage<'a, 'b>(&'a mut PlateStage<'b>);

/// A plate whose extrema at every receiver are known.
#[derive(Debug)]
pub struct ExtremaStage<'a, 'b>(&'a mut PlateStage<'b>);

impl Stages {
    /// Creates the stages for cases of `setup`, which has passed validation, on one instruction
    /// set.
    pub fn new(setup: &Setup, isa: Isa) -> Self {
        let memory = Arc::new(TableMemory::default());
        let caches = GradeCaches::new(setup, OuterFaces::None, &memory);
        Self { prepared: PreparedSetup::new(setup, isa), caches }
    }

    /// Tensor: computes the common part of the admittances of one bone.
    ///
    /// # Errors
    /// If no wave through the bone can arrive first, or if it is out of scale.
    pub fn tensor<'a>(
        &'a self,
        bone: impl Into<BoneRef<'a>>,
        memory: &'a mut StageWorkspace,
    ) -> Result<PlateStage<'a>, Failure> {
        let Self { prepared, caches } = self;
        let accurate = sampling::first_grade(&prepared.setup) == Grade::Thorough;
        let (media, speed) = prepared.media(bone.into())?;
        if accurate {
            memory.exact.accurate.fill(prepared.isa, &media);
        } else {
            memory.exact.fast.fill(prepared.isa, &media);
        }
        let cache = if accurate { &caches.thorough } else { &caches.quick };
        let index = sampling::speed_bin(&prepared.setup, speed).unwrap_or(SPEED_BINS);
        let bin = cache.tables(index, speed)?;
        Ok(PlateStage { prepared, bin, accurate, media, speed, memory })
    }
}

impl<'b> PlateStage<'b> {
    fn band(&self) -> &Band {
        &self.bin.first
    }

    /// Returns the number of (frequency, wavenumber) pairs.
    pub fn pairs(&self) -> usize {
        self.band().sampled.pairs as usize
    }

    /// Admittance: computes the plate's response at every pair.
    pub fn admittance<'a>(&'a mut self) -> ResponseStage<'a, 'b> {
        let (isa, tables, media) = (self.prepared.isa, &self.bin.tables, &self.media);
        let lines = &tables.lines[..self.band().lines];
        let StageWorkspace { exact: ExactWorkspace { fast, accurate, .. }, responses } =
            &mut *self.memory;
        responses.resize_with(lines.len(), Vec::new);
        for (line, responses) in lines.iter().zip(responses) {
            if self.accurate {
                respond(isa, tables, media, accurate, line, responses);
            } else {
                respond(isa, tables, media, fast, line, responses);
            }
        }
        ResponseStage(self)
    }
}

impl<'b> ResponseStage<'_, 'b> {
    /// Wavenumber sum: computes the spectra at every receiver.
    pub fn sum(&mut self) -> SpectraStage<'_, 'b> {
        let PlateStage { prepared, bin, memory, .. } = &mut *self.0;
        memory.exact.spectra.clear(&bin.tables);
        for (i, responses) in memory.responses.iter().enumerate() {
            memory.exact.spectra.sum(prepared.isa, &bin.tables, i, responses);
        }
        SpectraStage(self.0)
    }
}

impl<'b> SpectraStage<'_, 'b> {
    /// Time synthesis: computes the extrema of the pressure at every receiver.
    ///
    /// # Errors
    /// If a number is not finite.
    pub fn synthesis(&mut self) -> Result<ExtremaStage<'_, 'b>, Failure> {
        let PlateStage { prepared, bin, speed, memory, .. } = &mut *self.0;
        pass::observe(prepared, *speed, bin, &bin.first, &mut memory.exact)?;
        Ok(ExtremaStage(self.0))
    }
}

impl ExtremaStage<'_, '_> {
    /// Picking: returns the first arrival and the estimate of its error.
    ///
    /// # Errors
    /// If there is no acceptable pick.
    pub fn picking(&self) -> Result<Arrival, Failure> {
        let PlateStage { prepared, bin, memory, .. } = &*self.0;
        let band = self.0.band();
        let found = pass::pick_with_error(prepared, bin, band, &memory.exact)?;
        Ok(found.arrival(1, band.sampled.pairs, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use osteon_common::parameters::Point;
    use osteon_common::realization::Ensemble;

    use super::*;
    use crate::{Solver, Workspace};

    #[test]
    fn the_stages_together_are_the_solver() {
        let point = Point::of_bone([1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]);
        let ensemble = Ensemble::new(&point, 1).unwrap();
        for refinement in [1.0, 2.0] {
            let mut setup = Setup::default();
            setup.solver.refinement = refinement;
            let solver = Solver::new(&setup);
            let stages = Stages::new(&setup, Isa::fastest());
            let (mut workspace, mut memory) = (Workspace::default(), StageWorkspace::default());
            let mut same = 0;
            for i in 0..20 {
                let bone = ensemble.bone(i).unwrap();
                let expected = solver.arrival(&bone, &mut workspace).unwrap();
                let mut plate = stages.tensor(&bone, &mut memory).unwrap();
                let mut response = plate.admittance();
                let mut spectra = response.sum();
                let arrival = spectra.synthesis().unwrap().picking().unwrap();
                same += usize::from(arrival == expected);
                // If the solver makes further passes, it finds nearly the same.
                assert!((arrival.velocity / expected.velocity - 1.0).abs() < 3e-4, "index {i}");
            }
            assert!(same >= 15, "only {same} of 20 arrivals are those of a first band");
        }
    }
}
