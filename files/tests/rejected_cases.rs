//! Case files that are refused, each with all that a user reads; and files that cannot be read.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

mod support;

use std::path::Path;

use osteon_files::case_file;
use osteon_files::document::Format;

use support::pin;

const CASE: &str = include_str!("files/case.toml");
const MANDEL: &str = include_str!("files/mandel.toml");
const SUBLAYERS: &str = include_str!("files/sublayers.toml");

fn refusal(text: &str, format: Format) -> String {
    match case_file::parse(text, format) {
        Ok(_) => "ACCEPTED".to_owned(),
        Err(error) => error.to_string(),
    }
}

fn check(name: &str, base: &str, edits: &[(&str, &str)]) {
    let refusals = edits.iter().map(|(from, to)| {
        assert_eq!(base.matches(from).count(), 1, "{from} must occur once");
        let to_shown = if to.is_empty() { "(removed)" } else { to };
        (to_shown, refusal(&base.replace(from, to), Format::Toml))
    });
    pin(name, refusals);
}

#[test]
fn engineering_constants() {
    check(
        "rejected_constants",
        CASE,
        &[
            ("density = 1598.8", "density = 0.0"),
            ("density = 1598.8", "density = nan"),
            ("density = 1598.8\n", ""),
            ("density = 1598.8", "density = [1598.8]"),
            ("longitudinal_young_modulus = 17.717e9", "longitudinal_young_modulus = -17.717e9"),
            ("longitudinal_young_modulus = 17.717e9", "longitudinal_young_modulus = 5e9"),
            ("longitudinal_poisson_ratio = 0.3816", "longitudinal_poisson_ratio = inf"),
            ("longitudinal_poisson_ratio = 0.3816", "longitudinal_poisson_ratio = 0.8"),
            ("longitudinal_shear_modulus = 4.795e9", "longitudinal_shear_modulus = 0"),
            ("longitudinal_shear_modulus = 4.795e9", "longitudinal_shear_modulos = 4.795e9"),
            ("transverse_young_modulus = 9.8254e9", "transverse_young_modulus = true"),
            ("transverse_poisson_ratio = 0.4495", "transverse_poisson_ratio = 1.2"),
            ("transverse_poisson_ratio = 0.4495", "transverse_poisson_ratio = -1"),
            ("transverse_poisson_ratio = 0.4495", ""),
            ("transverse_poisson_ratio = 0.4495", "mandel = []"),
            ("[bone]", "[bones]"),
            ("[bone]", "[solver]\nrefinement = 100\n[bone]\nthickness = 4e-3"),
        ],
    );
}

/// Numbers in another unit than the one that is asked for, each with the cure.
#[test]
fn units() {
    check(
        "rejected_constants_units",
        CASE,
        &[
            ("density = 1598.8", "density = 1.5988"),
            ("longitudinal_young_modulus = 17.717e9", "longitudinal_young_modulus = 17.717"),
            ("longitudinal_poisson_ratio = 0.3816", "longitudinal_poisson_ratio = 38.16"),
            ("longitudinal_shear_modulus = 4.795e9", "longitudinal_shear_modulus = 4795"),
            ("transverse_young_modulus = 9.8254e9", "transverse_young_modulus = 9.8254"),
            ("[bone]", "[layers]\nbone = { thickness = 4 }\n[bone]"),
            ("[bone]", "[probe]\ncenter_frequency = 1\n[bone]"),
            ("[bone]", "[probe]\nreceivers = { first_x1 = 11, pitch = 0.8 }\n[bone]"),
        ],
    );
}

/// A matrix is written by programs, of any scale: a fluid, a phantom, a number for a test.
#[test]
fn a_matrix_may_have_any_scale() {
    let soft = MANDEL.replace("e9", "");
    assert_eq!(refusal(&soft.replace("density = 1800", "density = 1.8"), Format::Toml), "ACCEPTED");
}

#[test]
fn mandel() {
    check(
        "rejected_mandel",
        MANDEL,
        &[
            ("    [0, 0, 0, 0, 0, 10.4e9],\n", ""),
            ("[0, 0, 0, 0, 0, 10.4e9]", "[0, 0, 0, 0, 10.4e9]"),
            ("[0, 0, 0, 0, 0, 10.4e9]", "10.4e9"),
            ("[0, 0, 0, 0, 0, 10.4e9]", "[0, 0, 0, 0, 0, \"10.4e9\"]"),
            ("[0, 0, 0, 0, 0, 10.4e9]", "[0, 0, 0, 0, 0, nan]"),
            ("[0, 0, 0, 0, 0, 10.4e9]", "[0, 0, 0, 0, 1e9, 10.4e9]"),
            ("[0, 0, 0, 0, 0, 10.4e9]", "[0, 0, 0, 0, 0, 0]"),
            ("[9.5e9, 9.5e9, 19.9e9, 0, 0, 0]", "[9.5e9, 9.5e9, 1e9, 0, 0, 0]"),
            ("density = 1800\n", ""),
            ("density = 1800", "density = 1800\ntransverse_poisson_ratio = 0.4"),
        ],
    );
}

#[test]
fn sublayers() {
    let first = "[[bone.sublayers]]\nthickness = 1.5e-3";
    let too_many = format!("{}{first}", "[[bone.sublayers]]\nthickness = 1e-3\n".repeat(14));
    check(
        "rejected_sublayers",
        SUBLAYERS,
        &[
            ("thickness = 1.5e-3\n", ""),
            ("thickness = 1.5e-3", "thickness = 0.0"),
            ("thickness = 1.5e-3", "thickness = 1.5e-7"),
            ("thickness = 1.5e-3", "thickness = 1.5"),
            ("thickness = 1.5e-3", "thickness = \"1.5e-3\""),
            ("thickness = 1.5e-3", "thicknes = 1.5e-3"),
            ("density = 1900.0\n", ""),
            ("density = 1900.0", "density = 1.9"),
            ("density = 1700", "density = -1700"),
            ("longitudinal_poisson_ratio = 0.35", "longitudinal_poisson_ratio = 0.8"),
            ("transverse_young_modulus = 11e9\n", ""),
            ("[0, 0, 0, 0, 0, 10.4e9]", "[0, 0, 0, 0, 0, 0]"),
            ("[0, 0, 0, 0, 0, 10.4e9]", "[0, 0, 0, 0, 10.4e9]"),
            ("density = 1700", "density = 1700\nmaterial = \"bone\""),
            ("bone = {", "bone = { thickness = 4e-3,"),
            (first, &format!("[bone]\ndensity = 1800\n{first}")),
            (first, &format!("[bone]\nmandel = []\n{first}")),
            (first, &too_many),
        ],
    );
    let inputs = ["[]", "3", "[3]", "[{ }, { }, { }, { }]"];
    let bone = |list: &str| format!("[bone]\nsublayers = {list}\n");
    let refusals = inputs.map(|list| (list, refusal(&bone(list), Format::Toml)));
    pin("rejected_sublayers_list", refusals);
}

#[test]
fn json_has_the_same_messages_without_lines() {
    let inputs = [
        "{\"bone\": {\"density\": -1, \"mandle\": []}}",
        "{\"bone\": {\"density\": 1, \"density\": 2}}",
        "{\"bone\": {\"density\": NaN}}",
        "{\"bone\": null}",
        "[]",
        "",
    ];
    pin("rejected_json", inputs.map(|text| (text, refusal(text, Format::Json))));
}

#[test]
fn malformed_toml_is_located() {
    let inputs = ["[bone]\ndensity = 1,5\n", "[bone\n", "[bone]\n[bone]\n", "[bone]\na = 'b\n"];
    pin("rejected_toml", inputs.map(|text| (text, refusal(text, Format::Toml))));
}

#[test]
fn files_that_cannot_be_read() {
    let directory = tempfile::tempdir().unwrap();
    let check = |name: &str, content: Option<&[u8]>, expected: &str| {
        let path = directory.path().join(name);
        if let Some(content) = content {
            std::fs::write(&path, content).unwrap();
        }
        let message = case_file::read(&path).unwrap_err().to_string();
        assert_eq!(message.replace(&*directory.path().to_string_lossy(), "DIR"), expected);
    };
    check("a.toml", None, "cannot read DIR/a.toml: No such file or directory (os error 2)");
    check("a.cfg", None, "DIR/a.cfg: the name of a job or case file must end in .toml or .json");
    check(
        "a.txt",
        None,
        "DIR/a.txt is not a job or case file but data; `osteon init DIR/a.txt` writes a job file for it",
    );
    check(
        "b.toml",
        Some(b"[bone]\n# \xff\n"),
        "DIR/b.toml:2:3: not valid TOML: the byte 0xff is not valid UTF-8; save the file as UTF-8\n  |\n\
         2 | # �\n  |   ^",
    );
    check(
        "c.json",
        Some(b"{"),
        "DIR/c.json:1:1: not valid JSON: EOF while parsing an object\n  |\n1 | {\n  | ^",
    );
    check(
        "d.TOML",
        Some(b""),
        "DIR/d.TOML: 1 error\n  bone: is missing; it must have a material, or density and either the five \
         engineering constants or mandel, or a porosity, or sublayers",
    );
    assert!(case_file::read(directory.path()).is_err());
}

#[test]
fn a_file_longer_than_the_bound_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("long.toml");
    let bytes_max = osteon_common::limits::CASE_FILE_BYTES_MAX;
    let file = std::fs::File::create(&path).unwrap();
    file.set_len(bytes_max + 1).unwrap();
    let message = case_file::read(Path::new(&path)).unwrap_err().to_string();
    let expected = "long.toml is longer than 1048576 bytes, more than any case file needs";
    assert!(message.ends_with(expected), "{message}");
}
