//! The materials that files use by name.

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use std::fs;
use std::path::Path;

use support::{Scratch, run, text};

/// Velocity of each material in the paper's geometry, m/s.
#[test]
fn each_material_has_a_velocity_from_any_directory() {
    let listed = run(&["materials", "--json"]).json();
    let materials = listed.as_array().map(Vec::as_slice).unwrap_or_default();
    assert!(materials.len() >= 10, "{listed}");
    let scratch = Scratch::new();
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/materials.md");
    let page = fs::read_to_string(page).unwrap_or_default();
    for material in materials {
        let name = material["name"].as_str().unwrap_or_default();
        let case = scratch.write("case.toml", &format!("bone = {{ material = \"{name}\" }}"));
        let solved = run(&["simulate", text(&case), "--json"]).json();
        let velocity = solved["velocity"].as_f64();
        let velocity = velocity.unwrap_or_else(|| panic!("{name}: {solved}"));
        assert!((2800.0..4500.0).contains(&velocity), "{name}: {velocity} m/s");
        let row = page.lines().find(|line| line.starts_with(&format!("| `{name}` |")));
        let stated = format!(" {velocity:.0} |");
        assert!(row.is_some_and(|row| row.ends_with(&stated)), "{name}: {row:?}, not{stated}");
    }
}

#[test]
fn a_material_is_shown_with_values_and_reference() {
    let shown = run(&["materials", "human-tibia-rho-1996"]);
    insta::assert_snapshot!("material", shown.succeeded());
    insta::assert_snapshot!("materials", run(&["materials"]).succeeded());
    let unknown = run(&["materials", "human-tibia"]);
    assert_eq!(unknown.code, Some(2));
    assert!(unknown.stderr.contains("no material \"human-tibia\""), "{}", unknown.stderr);
}
