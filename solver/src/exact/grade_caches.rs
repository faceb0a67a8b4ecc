//! The tables of every grade of the exact method.

use std::sync::Arc;

use osteon_common::case::Setup;
use osteon_common::sampling::{self, Grade, OuterFaces};

use crate::exact::table_cache::TableCache;
use crate::exact::table_memory::TableMemory;

/// Factor of the refinement in the passes of the full grade, at refinement 1 and below.
const FULL_REFINEMENT: f64 = 4.0;

/// The tables of every grade.
#[derive(Debug)]
pub(super) struct GradeCaches {
    pub(super) quick: TableCache,
    pub(super) plain: TableCache,
    pub(super) thorough: TableCache,
    pub(super) full: TableCache,
}

impl GradeCaches {
    pub(super) fn new(setup: &Setup, faces: OuterFaces, memory: &Arc<TableMemory>) -> Self {
        let mut refined = setup.clone();
        if sampling::first_grade(setup) != Grade::Thorough {
            refined.solver.refinement *= FULL_REFINEMENT;
        }
        Self {
            quick: TableCache::new(setup, Grade::Quick, faces, memory),
            plain: TableCache::new(setup, Grade::Plain, faces, memory),
            thorough: TableCache::new(setup, Grade::Thorough, faces, memory),
            full: TableCache::new(&refined, Grade::Full, faces, memory),
        }
    }
}
