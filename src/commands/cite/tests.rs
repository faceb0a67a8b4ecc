use std::fs;

use osteon_common::version::VERSION;

use super::*;

/// Returns the text of a file in the root of the repository.
fn of_root(name: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap()
}

/// Returns a field of an entry as plain text.
fn plain(entry: &str, name: &str) -> Option<String> {
    Some(field(entry, name)?.replace(['{', '}'], "").replace("--", "-"))
}

/// Returns the names of the materials that a file uses.
fn names(file: &str, text: &str) -> Vec<&'static str> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(file);
    fs::write(&path, text).unwrap();
    materials_of(&path).unwrap().into_iter().map(|(name, _)| *name).collect()
}

#[test]
fn the_files_for_citation_say_the_same() {
    let cff = of_root("CITATION.cff");
    let (codemeta, zenodo) = (of_root("codemeta.json"), of_root(".zenodo.json"));
    assert!(cff.contains(&format!("\nversion: {VERSION}\n")), "{cff}");
    for text in [&codemeta, &zenodo] {
        assert!(text.contains(&format!("\"version\": \"{VERSION}\"")), "{text}");
    }
    let cited = REFERENCES.split("\n\n").filter(|entry| field(entry, "keywords").is_none());
    let cited: Vec<_> = cited.collect();
    assert_eq!(cited.len(), 2);
    for entry in cited {
        let title = plain(entry, "title").unwrap();
        assert!(cff.contains(&format!("title: \"{title}\"\n")), "{title}");
        if let Some(doi) = plain(entry, "doi") {
            assert!(cff.contains(&format!("doi: {doi}\n")) && codemeta.contains(&doi), "{doi}");
            // It gives the program its DOI, and is not told it.
            assert!(zenodo.contains(&doi) || entry.starts_with("@misc{osteon"), "{doi}");
        }
        let first = plain(entry, "author").unwrap();
        let first = first.split(',').next().unwrap();
        assert!(cff.contains(&format!("{first}\n")), "{first}");
    }
}

#[test]
fn every_material_has_an_entry_that_agrees_with_its_reference() {
    for known in materials::all() {
        let (name, material) = known;
        let cited = Cited { program: program::current(), materials: vec![known] };
        let of_material =
            |entry: &&str| field(entry, "keywords").is_some() && cited.remarks(entry).is_some();
        let entries: Vec<_> = REFERENCES.split("\n\n").filter(of_material).collect();
        let [entry] = entries[..] else { panic!("{name}: {entries:?}") };
        assert_eq!(plain(entry, "doi"), material.doi, "{name}");
        let title = plain(entry, "title").unwrap();
        assert!(material.reference.contains(&title), "{name}: {title}");
        for key in ["journal", "volume", "pages", "year"] {
            let value = plain(entry, key).unwrap_or_default();
            assert!(material.reference.contains(&value), "{name}: {key} = {value}");
        }
        let authors = plain(entry, "author").unwrap_or_default();
        for author in authors.split(" and ").filter(|author| !author.is_empty()) {
            let (family, given) = author.split_once(", ").unwrap();
            assert!(material.reference.contains(&format!("{given} {family}")), "{name}: {author}");
        }
    }
}

#[test]
fn fields_are_on_lines_of_their_own() {
    for entry in REFERENCES.trim_end().split("\n\n") {
        let lines: Vec<_> = entry.lines().collect();
        let [head, fields @ .., "}"] = &lines[..] else { panic!("{entry}") };
        assert!(head.starts_with('@') && head.ends_with(','), "{head}");
        for line in fields {
            let (key, _) = line.trim_start().split_once(" = {").unwrap();
            let value = field(entry, key).unwrap();
            assert_eq!(value.matches('{').count(), value.matches('}').count(), "{line}");
        }
    }
}

#[test]
fn no_two_materials_are_taken_for_each_other() {
    for (name, material) in materials::all() {
        let case = format!("bone = {{ material = \"{name}\", density = 1850 }}");
        assert_eq!(names("case.toml", &case), [*name]);
        let job = format!(
            "[parameters]\nmaterial = \"{name}\"\ndispersion = {{ fixed = 0.1 }}\n\
             density = {{ fixed = 1850 }}\nlongitudinal_young_modulus = {{ fixed = 19e9 }}\n"
        );
        assert_eq!(names("job.toml", &job), [*name]);
        assert!(material.constants().elasticity().is_ok(), "{name}");
    }
}

#[test]
fn sublayers_and_written_jobs_are_searched_too() {
    let case = "[[bone.sublayers]]\nthickness = 1e-3\nmaterial = \"human-tibia-rho-1996\"\n\
                [[bone.sublayers]]\nthickness = 2e-3\nmaterial = \"human-femur-dong-2004\"\n";
    let both = ["human-femur-dong-2004", "human-tibia-rho-1996"];
    assert_eq!(names("case.toml", case), both);
    let job =
        "[parameters]\nmaterial = \"bovine-phalanx-lang-1969\"\ndispersion = { fixed = 0.1 }\n";
    let read = job_file::parse(
        job,
        osteon_files::document::Format::Toml,
        Path::new(""),
        JobKind::Propagation,
    );
    let written = job_file::to_toml(&read.unwrap());
    assert!(!written.contains("lang"), "{written}");
    assert_eq!(names("job.toml", &written), ["bovine-phalanx-lang-1969"]);
}

#[test]
fn results_are_read_from_their_directory_or_by_their_file() {
    let directory = tempfile::tempdir().unwrap();
    let result = directory.path().join(RESULT);
    let job = "[parameters]\nmaterial = \"human-tibia-rho-1996\"\ndispersion = { fixed = 0.1 }\n";
    fs::write(directory.path().join(JOB), job).unwrap();
    // A run that has not ended.
    let cited = Cited::by(directory.path()).unwrap();
    assert_eq!(cited.program, program::current());
    let text = of_root("fuzz/corpus/results/propagation.json");
    let earlier = text.replace(&format!("\"version\": \"{VERSION}\""), "\"version\": \"0.0.9\"");
    fs::write(&result, earlier).unwrap();
    for path in [directory.path(), &result] {
        let cited = Cited::by(path).unwrap();
        assert_eq!(cited.program.version, "0.0.9");
        assert_eq!(cited.materials.len(), 1);
    }
    fs::write(&result, "{}").unwrap();
    assert!(matches!(Cited::by(&result), Err(CommandFailure::BadInput(_))));
}

#[test]
fn the_version_is_that_which_computed_the_result() {
    let commit = Some("0123abc\n".to_owned());
    let program = Program { version: "0.0.7".to_owned(), numerics: 3, commit };
    let text = Cited { program, materials: Vec::new() }.bibliography();
    assert!(text.contains("  version = {0.0.7},\n"), "{text}");
    assert!(text.contains("{Version 0.0.7, numerics revision 3, commit 0123abc\\n}\n"), "{text}");
    assert_eq!(text.matches("\n@").count() + 1, 2, "{text}");
    assert!(PLACES.iter().all(|place| !text.contains(place)), "{text}");
}
