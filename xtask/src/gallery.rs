//! Writes docs/gallery.md: what the examples print and draw, with times and digests.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail};

use crate::places::{programs, root};
use crate::process::{cargo, cargo_command, output};

/// The beginning of the page, without the number of processors.
const HEAD: &str = "# Gallery

What the examples give, and how long they take on PROCESSORS processors. Each figure is one of those that `osteon
report` writes for the results of the command above it; `cargo xtask generate gallery` makes this page.
";

/// One example.
struct Exhibit {
    /// Its name in the page's files.
    name: &'static str,
    title: &'static str,
    /// Arguments of the program.
    words: &'static [&'static str],
    /// The figure of its report that is shown.
    figure: &'static str,
    text: &'static str,
}

const EXHIBITS: &[Exhibit] = &[
    Exhibit {
        name: "signals",
        title: "One bone",
        words: &["simulate", "examples/cases/A.toml"],
        figure: "traces",
        text: "The pressure at each receiver, with the extremum from whose times the velocity follows, and the\n\
               threshold above which a packet begins.",
    },
    Exhibit {
        name: "random-bones",
        title: "Random bones",
        words: &["propagate", "examples/optimum.toml"],
        figure: "density",
        text: "The distribution of the velocities of 2747 bones whose elasticity is random, at the optimum of the \
               paper.",
    },
    Exhibit {
        name: "porosity",
        title: "A porosity",
        words: &["identify", "examples/porosity.toml"],
        figure: "density",
        text: "Two moments of measured velocities determine two numbers, a porosity and the dispersion of the\n\
               elasticity. This is what `osteon demo` runs.",
    },
    Exhibit {
        name: "posterior",
        title: "The posterior of a porosity",
        words: &["identify", "examples/porosity.toml", "--set", "search.method=posterior"],
        figure: "posterior-porosity",
        text: "All porosities that agree with the same velocities, with their probabilities.",
    },
    Exhibit {
        name: "groups",
        title: "Several patients",
        words: &["identify", "examples/groups.toml"],
        figure: "groups-bulk-velocity",
        text: "The velocity along each patient's bone from one file of velocities, with intervals.",
    },
    Exhibit {
        name: "simplex",
        title: "The paper's search",
        words: &["identify", "examples/quick.toml"],
        figure: "search-parameters",
        text: "The simplex of Nelder and Mead among seven free parameters, which two moments cannot determine.",
    },
];

/// Runs the examples with the release, and writes the page and its pictures.
pub(crate) fn write(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask generate gallery");
    }
    cargo(&mut cargo_command(&["build", "--release"]))?;
    let target = programs()?;
    let program = target.with_file_name("release").join("osteon");
    let work = target.with_file_name("gallery");
    let processors = thread::available_parallelism()?.to_string();
    let mut page = HEAD.replace("PROCESSORS", &processors);
    for exhibit in EXHIBITS {
        page += &exhibit.section(&program, &work.join(exhibit.name))?;
    }
    let path = root().join("docs/gallery.md");
    fs::write(&path, page).with_context(|| format!("cannot write {}", path.display()))
}

impl Exhibit {
    /// Runs the example in a folder for its results, copies its picture, and returns its section.
    fn section(&self, program: &Path, results: &Path) -> Result<String> {
        if results.exists() {
            fs::remove_dir_all(results)?;
        }
        let start = Instant::now();
        let mut command = Command::new(program);
        command.current_dir(root()).args(self.words).arg("--out");
        output(command.arg(results))?;
        let time = start.elapsed();
        output(Command::new(program).arg("report").arg(results))?;
        let picture = format!("gallery-{}.svg", self.name);
        let figure = results.join("report").join(self.figure).with_extension("svg");
        fs::copy(&figure, root().join("docs").join(&picture))
            .with_context(|| format!("cannot copy {}", figure.display()))?;
        let result = fs::read_to_string(results.join("result.json"))?;
        let Self { title, words, text, .. } = self;
        Ok(format!(
            "\n## {title}\n\n```text\nosteon {}\n```\n\n{text}\n\n![{title}]({picture})\n\n{}\n",
            words.join(" "),
            facts(time, &result)?,
        ))
    }
}

/// Returns the line below a picture.
fn facts(time: Duration, result: &str) -> Result<String> {
    let numerics = value_of(result, "numerics").context("a result has its numerics revision")?;
    let time = format!("{:.1} s", time.as_secs_f64());
    Ok(match value_of(result, "digest") {
        Some(digest) => format!("{time}; digest `{:.16}…`, numerics {numerics}.", digest),
        None => format!("{time}; numerics {numerics}."),
    })
}

/// Returns the first value of a key of a file whose lines have a key each.
fn value_of<'a>(result: &'a str, key: &str) -> Option<&'a str> {
    let start = format!("\"{key}\": ");
    let value = result.lines().find_map(|line| line.trim().strip_prefix(&start))?;
    Some(value.trim_end_matches(',').trim_matches('"'))
}
