//! Sublayers of coupling and marrow in files: what is read, and what is refused with all that a user reads.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

mod support;

use osteon_common::attenuation::Attenuation;
use osteon_common::fluid_sublayers::{FluidSublayer, FluidSublayers};
use osteon_common::layers::{Fluid, Layers};
use osteon_files::case_file;
use osteon_files::document::Format;

use support::pin;

const FLUIDS: &str = include_str!("files/fluids.toml");
const BONE: &str = "[bone]\nmaterial = \"human-femur-ashman-1984\"\n";

fn refusal(text: &str) -> String {
    match case_file::parse(text, Format::Toml) {
        Ok(_) => "ACCEPTED".to_owned(),
        Err(error) => error.to_string(),
    }
}

/// Sublayers of fluids in both notations of TOML, and as the whole case is written.
#[test]
fn fluids_have_the_sublayers_that_a_file_lists() {
    let sublayers = |all: &[[f64; 3]]| {
        let one = |&[thickness, density, sound_speed]: &[f64; 3]| FluidSublayer {
            thickness,
            density,
            sound_speed,
        };
        FluidSublayers::new(&all.iter().map(one).collect::<Vec<_>>()).unwrap()
    };
    let above = sublayers(&[
        [4e-3, 1020.0, 1530.0],
        [1.5e-3, 1110.0, 1620.0],
        [1e-3, 930.0, 1440.0],
        [1.2e-3, 1060.0, 1570.0],
    ]);
    let below = sublayers(&[[3e-3, 980.0, 1450.0], [8e-3, 1050.0, 1540.0]]);
    let given = case_file::parse(FLUIDS, Format::Toml).unwrap();
    let water = Layers::default().coupling;
    let attenuation = Attenuation { quality_factor: Some(200.0), ..Attenuation::default() };
    let coupling = Fluid { sublayers: above, attenuation, ..water };
    let marrow = Fluid { sublayers: below, ..water };
    assert_eq!(given.setup.layers, Layers { coupling, marrow, ..Layers::default() });
    assert_eq!(case_file::parse(&case_file::to_toml(&given), Format::Toml).unwrap(), given);
}

#[test]
fn sublayers_of_fluids() {
    let edits = [
        ("thickness = 1.5e-3\n", ""),
        ("thickness = 1.5e-3", "thickness = 0.0"),
        ("thickness = 1.5e-3", "thicknes = 1.5e-3"),
        ("density = 1110.0", "density = \"1110\""),
        ("sound_speed = 1620.0", "sound_speed = 1.62"),
        ("sound_speed = 1620.0", "attenuation = { quality_factor = 20 }"),
        ("[layers.marrow]\n", "[layers.marrow]\nthickness = 10e-3\n"),
        ("[layers.marrow]\n", "[layers.marrow]\ndensity = 1000.0\nsound_speed = 1500.0\n"),
        ("[layers.marrow]\n", "[layers.marrow]\nsublayer = 3\n"),
        ("source = { x3 = 5e-3 }", "source = { x3 = 7.8e-3 }"),
        ("source = { x3 = 5e-3 }", "tilt = 0.15"),
        ("[probe]\n", "[solver]\nmethod = \"hybrid\"\n\n[probe]\n"),
    ];
    let refusals = edits.map(|(from, to)| {
        assert_eq!(FLUIDS.matches(from).count(), 1, "{from} must occur once");
        (if to.is_empty() { "(removed)" } else { to }, refusal(&FLUIDS.replace(from, to)))
    });
    pin("rejected_fluid_sublayers", refusals);
    let inputs = ["[]", "3", "[3]", "[{ }, { }, { }, { }, { }]"];
    let marrow = |list: &str| format!("layers.marrow.sublayers = {list}\n{BONE}");
    let refusals = inputs.map(|list| (list, refusal(&marrow(list))));
    pin("rejected_fluid_sublayers_list", refusals);
}
