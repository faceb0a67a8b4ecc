//! `[layers]`, `[probe]`, `[picking]` and `[solver]`: the sections that case and job files share.

use crate::case::Setup;
use crate::check::{self, ELEMENT_ORDER, RECEIVERS};
use crate::layers::{Fluid, Layers};
use crate::probe::{Probe, Receivers, Source};
use crate::reader::{Choice, Reader, Table};
use crate::settings::{Extremum, Method, Picking, SolverSettings};

/// Reads the setup in `root`; missing or wrong values are replaced by defaults.
pub(crate) fn read(reader: &mut Reader, root: &Table<'_>) -> Setup {
    Setup {
        layers: layers(reader, root),
        probe: probe(reader, root),
        picking: picking(reader, root),
        solver: solver(reader, root),
    }
}

fn layers(reader: &mut Reader, root: &Table<'_>) -> Layers {
    let default = Layers::default();
    let table = reader.table(root, "layers", &["coupling", "bone", "marrow"]);
    let coupling = fluid(reader, &table, "coupling", default.coupling);
    let bone = reader.table(&table, "bone", &["thickness"]);
    let bone_thickness = reader.number(&bone, "thickness").unwrap_or(default.bone_thickness);
    let marrow = fluid(reader, &table, "marrow", default.marrow);
    Layers { coupling, bone_thickness, marrow }
}

fn fluid(reader: &mut Reader, layers: &Table<'_>, key: &str, default: Fluid) -> Fluid {
    let table = reader.table(layers, key, &["thickness", "density", "sound_speed"]);
    Fluid {
        thickness: reader.number(&table, "thickness").unwrap_or(default.thickness),
        density: reader.number(&table, "density").unwrap_or(default.density),
        sound_speed: reader.number(&table, "sound_speed").unwrap_or(default.sound_speed),
    }
}

fn probe(reader: &mut Reader, root: &Table<'_>) -> Probe {
    let default = Probe::default();
    let keys = ["center_frequency", "amplitude", "source", "receivers"];
    let table = reader.table(root, "probe", &keys);
    Probe {
        center_frequency: reader
            .number(&table, "center_frequency")
            .unwrap_or(default.center_frequency),
        amplitude: reader.number(&table, "amplitude").unwrap_or(default.amplitude),
        source: source(reader, &table, default.source),
        receivers: receivers(reader, &table, default.receivers),
    }
}

fn source(reader: &mut Reader, probe: &Table<'_>, default: Source) -> Source {
    let table = reader.table(probe, "source", &["x1", "x3"]);
    Source {
        x1: reader.number(&table, "x1").unwrap_or(default.x1),
        x3: reader.number(&table, "x3").unwrap_or(default.x3),
    }
}

fn receivers(reader: &mut Reader, probe: &Table<'_>, default: Receivers) -> Receivers {
    let table = reader.table(probe, "receivers", &["first_x1", "pitch", "count", "x3"]);
    let count = reader.whole(&table, "count", RECEIVERS);
    Receivers {
        first_x1: reader.number(&table, "first_x1").unwrap_or(default.first_x1),
        pitch: reader.number(&table, "pitch").unwrap_or(default.pitch),
        count: count.and_then(|count| u32::try_from(count).ok()).unwrap_or(default.count),
        x3: reader.number(&table, "x3").unwrap_or(default.x3),
    }
}

fn picking(reader: &mut Reader, root: &Table<'_>) -> Picking {
    let default = Picking::default();
    let table = reader.table(root, "picking", &["extremum", "threshold"]);
    let extremum = Choice { all: &Extremum::ALL, name: Extremum::name, reserved: &[] };
    Picking {
        extremum: reader.choice(&table, "extremum", &extremum).unwrap_or(default.extremum),
        threshold: reader.number(&table, "threshold").unwrap_or(default.threshold),
    }
}

fn solver(reader: &mut Reader, root: &Table<'_>) -> SolverSettings {
    let default = SolverSettings::default();
    let keys = ["method", "refinement", "element_size", "element_order", "time_step"];
    let table = reader.table(root, "solver", &keys);
    let methods = Choice { all: &Method::ALL, name: Method::name, reserved: &[] };
    let chosen = reader.choice(&table, "method", &methods);
    let method = chosen.unwrap_or(default.method);
    let refinement = reader.number(&table, "refinement").unwrap_or(default.refinement);
    if method != Method::Hybrid {
        // If the method cannot be read, it cannot be decided which keys belong to it.
        if chosen.is_some() || !table.has("method") {
            for key in check::HYBRID_KEYS.into_iter().filter(|key| table.has(key)) {
                reader.violations.add(table.path(key), check::of_hybrid_only(method));
            }
        }
        return SolverSettings { method, refinement, ..default };
    }
    let order = reader.whole(&table, "element_order", ELEMENT_ORDER);
    SolverSettings {
        method,
        refinement,
        element_size: reader.number(&table, "element_size").unwrap_or(default.element_size),
        element_order: order
            .and_then(|order| u32::try_from(order).ok())
            .unwrap_or(default.element_order),
        time_step: reader.number(&table, "time_step"),
    }
}
