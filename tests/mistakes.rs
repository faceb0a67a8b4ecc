//! Plausible mistakes of a first day, each with the words of the message that name the cure. Every one
//! of them ends with exit code 2, and writes nothing to stdout.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

#[cfg(test)]
#[expect(dead_code, reason = "each test file uses a part of it")]
mod support;

use support::{Finished, Scratch, job, osteon};

/// Words that a message must contain.
type Words = &'static [&'static str];

/// The section of the data in [`job`].
const MOMENTS: &str = "mean = 3906.0\ncoefficient_of_variation = 0.0271\n";
/// The moduli in [`job`], as they are written there.
const E_L: &str = "start = 19488700000.0\nbounds = [12000000000.0, 25000000000.0]";

const CASE: &str = "\
[bone]
density = 1598.8
longitudinal_young_modulus = 17.717e9
longitudinal_poisson_ratio = 0.3816
longitudinal_shear_modulus = 4.795e9
transverse_young_modulus = 9.8254e9
transverse_poisson_ratio = 0.4495
";

/// Command lines, in a directory with job.toml, case.toml, clean.csv and book.xlsx.
const COMMANDS: &[(&str, Words)] = &[
    ("identify case.toml", &["case.toml is not a job file but a case file", "`osteon simulate`"]),
    ("propagate case.toml", &["case.toml is not a job file but a case file", "`osteon simulate`"]),
    ("check case.toml", &["case.toml is not a job file but a case file", "`osteon simulate`"]),
    ("draw case.toml --index 1", &["case.toml is not a job file but a case file"]),
    ("umbridge case.toml --port 0", &["case.toml is not a job file but a case file"]),
    (
        "simulate job.toml",
        &[
            "job.toml is not a case file, which describes one bone, but a job file",
            "`osteon identify`",
            "`osteon draw`",
        ],
    ),
    (
        "identify clean.csv",
        &["clean.csv is not a job or case file but data", "`osteon init clean.csv`"],
    ),
    ("simulate clean.csv", &["clean.csv is not a job or case file but data"]),
    ("identify book.xlsx", &["book.xlsx is a spreadsheet", "save the velocities as CSV"]),
    ("identify job", &["must end in .toml or .json"]),
    ("identify absent.toml", &["cannot read absent.toml", "No such file"]),
    ("identify", &["<JOB>", "Usage: osteon identify"]),
    ("identify job.toml case.toml", &["unexpected argument 'case.toml'"]),
    ("identfy job.toml", &["unrecognized subcommand 'identfy'", "'identify'"]),
    ("identify job.toml --worker 2", &["'--worker'", "'--workers'"]),
    ("identify job.toml --workers 0", &["0 is not in 1..=256"]),
    ("identify job.toml --output x", &["unexpected argument '--output'", "'--out'"]),
    ("identify job.toml --sed 3", &["'--seed'"]),
    ("identify job.toml --seed -1", &["unexpected argument '-1'"]),
    (
        "identify job.toml --seed 9223372036854775808",
        &["--seed 9223372036854775808: monte_carlo.seed"],
    ),
    ("identify job.toml --set search.max_evaluations", &["it must be KEY=VALUE"]),
    ("identify job.toml --set search.max_evaluations=", &["is not a value of TOML"]),
    ("identify job.toml --set max_evaluations=5", &["belongs to the section [search]"]),
    (
        "identify job.toml --set search.max_iter=5",
        &["--set search.max_iter=5", "`max_evaluations`"],
    ),
    ("identify job.toml --set search.method=nelder-mead", &["\"simplex\"", "Nelder and Mead"]),
    ("identify job.toml --set monte_carlo.realizations=1e3", &["write 1000"]),
    ("simulate case.toml --set layers.bone.thickness=4", &["did you mean 4 mm (4e-3)?"]),
    ("draw job.toml --index 10", &["it must be 0 to 9"]),
    ("draw job.toml", &["--index"]),
    ("identify job.toml --coordinator localhost:7007", &["http://HOST:PORT or unix:PATH"]),
    ("identify job.toml --report", &["--out"]),
    ("fetch 1 --coordinator unix:a", &["--out"]),
    ("jobs", &["use --coordinator URL or set OSTEON_COORDINATOR"]),
    ("report", &["<DIR>"]),
];

/// Changes of a job file that is otherwise right: what is replaced (nothing: it is appended), by what.
const JOBS: &[(&str, &str, Words)] = &[
    // TOML.
    ("variation = 0.0271", "variation = 0,0271", &["decimal point, not a comma: 0.0271", "^"]),
    ("variation = 0.0271", "variation = .0271", &["before the decimal point: 0.0271"]),
    ("variation = 0.0271", "variation = 2.71 %", &["without %"]),
    ("mean = 3906.0", "mean = 3906 m/s", &["write the number without m/s"]),
    ("mean = 3906.0", "mean = 3 906", &["without gaps"]),
    ("mean = 3906.0", "mean = 3906.", &["3906.0"]),
    ("mean = 3906.0", "mean: 3906.0", &["write mean = 3906.0"]),
    ("mean = 3906.0", "mean =", &["there must be a value after `=`"]),
    ("mean = 3906.0", "// the mean\nmean = 3906.0", &["comments begin with #"]),
    ("mean = 3906.0", "mean = 3906.0\nmean = 3907.0", &["duplicate key", "may occur once"]),
    ("", "[search]\nmethod = \"newton\"\n", &["duplicate key", "put the two together"]),
    (
        MOMENTS,
        "velocities = \"C:\\Users\\ann\\v.csv\"\n",
        &["a backslash begins an escape", "write /"],
    ),
    (MOMENTS, "velocities = “v.csv”\n", &["straight quotation marks"]),
    (MOMENTS, "velocities = v.csv\n", &["text is in quotation marks: \"v.csv\""]),
    ("", "[solver]\nmethod = exact\n", &["text is in quotation marks: \"exact\""]),
    ("", "[probe]\nbidirectional = True\n", &["write true"]),
    ("[search]", "[search", &["unclosed table", "^"]),
    // Units.
    ("mean = 3906.0", "mean = 3.9", &["did you mean 3.9 km/s (3.9e3)?"]),
    ("variation = 0.0271", "variation = 2.71", &["did you mean 2.71 % (0.0271)?"]),
    (E_L, "start = 20\nbounds = [12, 25]", &["values are in Pa", "did you mean 20 GPa (20e9)?"]),
    ("", "[layers]\nbone = { thickness = 4 }\n", &["did you mean 4 mm (4e-3)?"]),
    ("", "[layers]\ncoupling = { sound_speed = 1.5 }\n", &["did you mean 1.5 km/s"]),
    ("", "[probe]\ncenter_frequency = 1\n", &["did you mean 1 MHz (1e6)?"]),
    ("", "[probe]\ntilt = 5\n", &["(rad)", "did you mean 5° (0.0873)?"]),
    ("fixed = 1598.8", "fixed = 1.6", &["did you mean 1.6 g/cm³ (1.6e3)?"]),
    // Ranges.
    (
        "[12000000000.0, 25000000000.0]",
        "[25e9, 12e9]",
        &["below the upper 1.2e10", "write [1.2e10, 2.5e10]"],
    ),
    ("[12000000000.0, 25000000000.0]", "[12,5e9, 25e9]", &["decimal point"]),
    ("[0.02, 0.3]", "[0,02, 0,3]", &["decimal point, not a comma", "^"]),
    ("start = 19488700000.0", "start = 30e9", &["3e10", "(the bounds)"]),
    ("start = 19488700000.0\n", "", &["start: is missing"]),
    ("[0.02, 0.3]", "[0.02, 15]", &["0.79772"]),
    ("fixed = 0.3816", "fixed = 0.9", &["a Poisson ratio too large"]),
    ("fixed = 0.3816", "value = 0.3816", &["did you mean `fixed`?"]),
    ("fixed = 0.3816", "fixed = \"0.3816\"", &["write 0.3816 without quotation marks"]),
    ("fixed = 0.3816", "fixed = \"0,3816\"", &["write 0.3816, with a decimal point"]),
    ("realizations = 10", "realizations = 0", &["from 1 to 10000000"]),
    ("realizations = 10", "realizations = 10.0", &["write 10"]),
    // Keys and choices.
    ("max_evaluations = 1", "max_iter = 1", &["did you mean `max_evaluations`?", "^^^^^^^^"]),
    ("max_evaluations = 1", "max_evaluation = 1", &["did you mean `max_evaluations`?"]),
    ("max_evaluations = 1", "seed = 1", &["belongs to the section [monte_carlo]"]),
    (
        "max_evaluations = 1",
        "method = \"nelder-mead\"",
        &["did you mean \"simplex\", the method of Nelder"],
    ),
    ("max_evaluations = 1", "method = \"Newton\"", &["did you mean \"newton\"?"]),
    ("realizations = 10", "samples = 10", &["did you mean `realizations`?"]),
    ("realizations = 10", "sampling = \"qmc\"", &["did you mean \"sobol\"?"]),
    ("", "[objective]\nkind = \"mle\"\n", &["did you mean \"likelihood\"?"]),
    ("", "[picking]\nextremum = \"1\"\n", &["did you mean \"first\"?"]),
    ("", "[probe]\nfrequency = 1e6\n", &["did you mean `center_frequency`?"]),
    ("", "[probe.receivers]\nnumber = 14\n", &["did you mean `count`?"]),
    ("", "[bone]\ndensity = 1600.0\n", &["bone.density: unknown key", "the section [parameters]"]),
    ("[parameters.dispersion]", "[parameters.delta]", &["did you mean `dispersion`?"]),
    ("[data]\nmean = 3906.0\ncoefficient_of_variation = 0.0271\n", "", &["data", "velocities"]),
    ("coefficient_of_variation = 0.0271\n", "", &["coefficient_of_variation"]),
    ("mean = 3906.0", "mean = 12000", &["allow mean velocities of about"]),
];

/// Files of velocities, with what is beside `velocities` in `[data]`.
const VELOCITIES: &[(&str, &str, Words)] = &[
    ("patient;velocity\nA;3900,5\nA;3910,5\n", "", &["separator"]),
    ("Velocity (m/s)\n3900\n3910\n", "", &["column"]),
    ("velocity\n3.9\n3.95\n3.8\n", "", &["did you mean 3.9 km/s (3.9e3)?"]),
    ("velocity\n3900\nNA\n3910\n", "", &["line 3", "missing"]),
    ("velocity\nm/s\n3900\nabout 3910\n", "", &["line 4", "about 3910"]),
    ("velocity\n3900\n3950\n39000\n", "", &["line 4", "39000"]),
    ("velocity\n3900\n", "", &["velocities"]),
    ("velocity\n3900\n3900\n3900\n", "", &["velocities"]),
    (
        "velocity,bone\n3900,a\n3901,a\n",
        "groups = \"bone\"\n",
        &["give either velocities, or groups"],
    ),
    ("velocity,bone\n3900,a\n3901,a\n", "group = \"Bone\"\n", &["bone"]),
    ("", "", &["v.csv"]),
];

/// Changes of a case file: what is replaced (nothing: it is appended), by what.
const CASES: &[(&str, &str, Words)] = &[
    ("17.717e9", "17.717", &["did you mean 17.717 GPa (17.717e9)?"]),
    ("density = 1598.8", "rho = 1598.8", &["did you mean `density`?"]),
    ("0.4495", "44.95", &["%"]),
    ("transverse_poisson_ratio = 0.4495\n", "", &["transverse_poisson_ratio: is missing"]),
    ("", "mandel = [[1.0]]\n", &["not both"]),
    ("", "[monte_carlo]\nseed = 1\n", &["monte_carlo: unknown key"]),
    ("", "[probe]\nsource = { x1 = 0.0, x3 = 20e-3 }\n", &["probe.source.x3"]),
    ("", "[material]\nname = \"cortical\"\n", &["material: unknown key"]),
    ("density", "material = \"femur\"\ndensity", &["material"]),
];

fn run_in(scratch: &Scratch, arguments: &[&str]) -> Finished {
    Finished::of(osteon().args(arguments).current_dir(scratch.path(".")).output().unwrap())
}

/// Returns what is not as expected.
fn wrong(context: &str, finished: &Finished, words: Words) -> Option<String> {
    let missing: Vec<_> = words.iter().filter(|word| !finished.stderr.contains(**word)).collect();
    let refused = (finished.code, finished.stdout.as_str()) == (Some(2), "");
    if refused && missing.is_empty() {
        return None;
    }
    Some(format!(
        "==== {context}\nmissing: {missing:?} in {:?}: {}",
        finished.code, finished.stderr
    ))
}

/// Fails with everything that is not as expected.
fn check(found: impl Iterator<Item = Option<String>>) {
    let wrong: Vec<String> = found.flatten().collect();
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// `file` with the one occurrence of `from` replaced by `to`, or with `to` at its end.
fn edited(file: &str, from: &str, to: &str) -> String {
    if from.is_empty() {
        return format!("{file}{to}");
    }
    assert_eq!(file.matches(from).count(), 1, "{from}");
    file.replace(from, to)
}

#[test]
fn of_command_lines() {
    let scratch = Scratch::new();
    scratch.write("job.toml", &job(10, 1));
    scratch.write("case.toml", CASE);
    scratch.write("clean.csv", "velocity\n3900\n3910\n");
    scratch.write("book.xlsx", "PK");
    check(COMMANDS.iter().map(|(line, words)| {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        wrong(line, &run_in(&scratch, &arguments), words)
    }));
}

#[test]
fn of_job_files() {
    let scratch = Scratch::new();
    check(JOBS.iter().map(|(from, to, words)| {
        scratch.write("job.toml", &edited(&job(10, 1), from, to));
        wrong(to, &run_in(&scratch, &["identify", "job.toml"]), words)
    }));
}

#[test]
fn of_files_of_velocities() {
    let scratch = Scratch::new();
    check(VELOCITIES.iter().map(|(csv, keys, words)| {
        let data = format!("velocities = \"v.csv\"\n{keys}");
        scratch.write("job.toml", &edited(&job(10, 1), MOMENTS, &data));
        scratch.write("v.csv", csv);
        wrong(csv, &run_in(&scratch, &["identify", "job.toml"]), words)
    }));
}

#[test]
fn of_case_files() {
    let scratch = Scratch::new();
    check(CASES.iter().map(|(from, to, words)| {
        scratch.write("case.toml", &edited(CASE, from, to));
        wrong(to, &run_in(&scratch, &["simulate", "case.toml"]), words)
    }));
}

#[test]
fn the_list_is_long() {
    let count = COMMANDS.len() + JOBS.len() + VELOCITIES.len() + CASES.len();
    assert!(count >= 67, "{count}");
}
