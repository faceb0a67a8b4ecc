//! Tables as instruments, spreadsheets and programs write them, generated with known truth: each is read
//! right or refused, and never wrong.

#![expect(clippy::unwrap_used, reason = "a helper of tests fails the test")]

use std::fmt::Write as _;

use encoding_rs::{Encoding, GBK, SHIFT_JIS, WINDOWS_1251, WINDOWS_1252};
use osteon_common::job::JobKind;
use osteon_files::document::Format;
use osteon_files::{init, job_file};

/// Number of tables, and the seed of the first.
const TABLES: u64 = 200;
const FIRST_SEED: u64 = 20_261_126;

/// Names of columns of velocities, a language each, with the encoding of old programs there.
const LANGUAGES: [Language; 12] = [
    Language { name: "velocity", mean: ["Mean", "SD", "N"], encoding: None },
    Language { name: "Speed of sound", mean: ["Average", "Std Dev", "Count"], encoding: None },
    Language { name: "SOS", mean: ["AVERAGE:", "STDEV:", "N:"], encoding: None },
    Language { name: "FAS", mean: ["avg", "std", "n"], encoding: None },
    Language { name: "SV", mean: ["Mean value", "Standard deviation", "n"], encoding: None },
    Language {
        name: "Schallgeschwindigkeit längs",
        mean: ["Mittelwert", "Standardabweichung", "Anzahl"],
        encoding: Some(WINDOWS_1252),
    },
    Language {
        name: "célérité",
        mean: ["Moyenne", "Écart-type", "Nombre"],
        encoding: Some(WINDOWS_1252),
    },
    Language {
        name: "velocidad del sonido",
        mean: ["Promedio", "Desviación", "n"],
        encoding: Some(WINDOWS_1252),
    },
    Language {
        name: "velocità", mean: ["Media", "Deviazione", "n"], encoding: Some(WINDOWS_1252)
    },
    Language {
        name: "скорость", mean: ["среднее", "σ", "n"], encoding: Some(WINDOWS_1251)
    },
    Language { name: "声速", mean: ["平均值", "标准差", "n"], encoding: Some(GBK) },
    Language { name: "音速", mean: ["平均", "標準偏差", "n"], encoding: Some(SHIFT_JIS) },
];

#[derive(Clone, Copy)]
struct Language {
    name: &'static str,
    mean: [&'static str; 3],
    encoding: Option<&'static Encoding>,
}

/// What stands above a table, by vendors.
const PREAMBLES: [&[&str]; 10] = [
    &[],
    &["Device: X1", "Date: 2026-01-02", "Operator: A", ""],
    &["% Device,A100", "% Samples per second,5", "% Start altitude,-30.7", "%"],
    &["[probe header]", "", "version=Version 1.2", "pulse average=1499.92", "", "[data]"],
    &["# exported by tool 3.1", "# 2026-03-02"],
    &["Cruise: Lab 3", "probe: X"],
    &["Previous File Location :\t1204116", "Model Name :\tIX 3000", "Gain :\t1000;0;0"],
    &["Burst length{s}4000", "Sampling{s}2500", "Averages{s}2000"],
    &["Report of measurements", "", "Patient study 12", "Sound velocity: by first arrival", ""],
    &["; Device X1", "// settings 4, 5, 6", "*** begin ***"],
];

/// Numbers that follow from a seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        usize::try_from(self.next() % count as u64).unwrap()
    }

    fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }

    fn of<T: Clone>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())].clone()
    }

    /// A velocity of bone, m/s.
    fn velocity(&mut self) -> f64 {
        let sum: f64 = (0..6).map(|_| self.below(1000) as f64 / 1000.0).sum();
        3900.0 + (sum - 3.0) * 130.0
    }
}

/// How numbers are written.
#[derive(Clone, Copy)]
struct Writing {
    decimal: char,
    decimals: usize,
    /// Mark of thousands.
    thousands: Option<char>,
    /// What is written behind each.
    behind: &'static str,
    is_kilometres: bool,
}

impl Writing {
    /// Writes a velocity; returns it as it was rounded, too.
    fn written(self, velocity: f64) -> (String, f64) {
        let decimals = if self.is_kilometres { self.decimals + 3 } else { self.decimals };
        let scaled = if self.is_kilometres { velocity / 1000.0 } else { velocity };
        let plain = format!("{scaled:.decimals$}");
        let rounded: f64 = plain.parse().unwrap();
        let (whole, fraction) = plain.split_once('.').unwrap_or((&plain, ""));
        let whole = match self.thousands {
            Some(mark) if whole.len() > 3 => {
                format!("{}{mark}{}", &whole[..whole.len() - 3], &whole[whole.len() - 3..])
            }
            _ => whole.to_owned(),
        };
        let text = match fraction {
            "" => whole,
            _ => format!("{whole}{}{fraction}", self.decimal),
        };
        let rounded = if self.is_kilometres { rounded * 1000.0 } else { rounded };
        (format!("{text}{}", self.behind), rounded)
    }
}

/// A generated file, and what is in it.
struct Table {
    bytes: Vec<u8>,
    velocities: Vec<f64>,
    /// Why it may be refused; empty if it must be read.
    is_ambiguous: &'static str,
    text: String,
}

fn quoted(text: &str, separator: &str) -> String {
    match text.contains(separator) || text.contains('"') {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

fn table(seed: u64) -> Table {
    let random = &mut Random(seed);
    let language = random.of(&LANGUAGES);
    let separator = random.of(&[",", ",", ";", ";", "\t", "\t", "|", " ", "   "]);
    let is_blank = separator.trim().is_empty() && separator != "\t";
    let decimal =
        if separator == ";" { random.of(&['.', ',']) } else { random.of(&['.', '.', '.', ',']) };
    let is_kilometres = random.one_in(4);
    let thousands = match (is_kilometres || is_blank, random.below(5)) {
        (true, _) => None,
        (_, 0) => Some(if decimal == '.' { ',' } else { '.' }),
        (_, 1) => Some(random.of(&['\'', '\u{a0}', '\u{202f}'])),
        _ => None,
    };
    let behind = if is_blank { "" } else { random.of(&["", "", "", "", " ± 12", " m/s"]) };
    let behind = if is_kilometres && behind == " m/s" { " km/s" } else { behind };
    let behind = if is_kilometres && behind == " ± 12" { "" } else { behind };
    let writing =
        Writing { decimal, decimals: 1 + random.below(2), thousands, behind, is_kilometres };
    let unit = match (is_kilometres, random.below(4)) {
        (false, 0) => "m/s",
        (false, 1) => "m s-1",
        (true, 0) => "km/s",
        (true, 1) => "mm/µs",
        _ => "",
    };
    let has_unit_row = !unit.is_empty() && random.one_in(4) && !is_blank;
    let in_header = !unit.is_empty() && !has_unit_row;
    let join = if is_blank { "_" } else { " " };
    let name = language.name.replace(' ', join);
    let unit_in_name = unit.replace(' ', "").replace("ms-1", "m/s");
    let name =
        if in_header { format!("{name}{}({unit_in_name})", join.replace('_', "")) } else { name };
    // The other columns stand before and behind.
    let before = random.of(&[&["id"][..], &["nr", "patient"], &["Date", "Time"], &["specimen"]]);
    let behind_names = random.of(&[&[][..], &["T_(°C)"], &["tof_us", "thickness_mm"], &["note"]]);
    let behind_names = if language.encoding.is_some() && behind_names == ["T_(°C)"] {
        &[][..]
    } else {
        behind_names
    };
    let has_trailing = !is_blank && random.one_in(6);
    let mut text = String::new();
    for line in random.of(&PREAMBLES) {
        writeln!(text, "{}", line.replace("{s}", separator)).unwrap();
    }
    let mut write_row = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|cell| quoted(cell, separator)).collect();
        let end = if has_trailing { separator } else { "" };
        writeln!(text, "{}{end}", cells.join(separator)).unwrap();
    };
    let row = |first: Vec<String>, velocity: String, last: Vec<String>| {
        [first, vec![velocity], last].concat()
    };
    let names = |list: &[&str]| list.iter().map(|&one| one.to_owned()).collect::<Vec<_>>();
    write_row(&row(names(before), name, names(behind_names)));
    if has_unit_row {
        let none = |list: &[&str]| vec!["-".to_owned(); list.len()];
        write_row(&row(none(before), format!("[{unit}]"), none(behind_names)));
    }
    let count = 12 + random.below(40);
    let mut velocities = Vec::new();
    let small = |value: f64| format!("{value:.2}").replace('.', &decimal.to_string());
    let others = |place: usize, random: &mut Random| {
        let first = before.iter().map(|name| match *name {
            "id" | "nr" => (place + 1).to_string(),
            "patient" => format!("P{}", place % 3),
            "Date" => format!("2026-03-{:02}", place % 28 + 1),
            "Time" => format!("10:{:02}:00", place % 60),
            _ => format!("S{place}"),
        });
        let last = behind_names.iter().map(|name| match *name {
            "tof_us" => small(5.0 + random.below(100) as f64 / 100.0),
            "thickness_mm" => small(3.0 + random.below(200) as f64 / 100.0),
            "note" => "ok".to_owned(),
            _ => small(20.0 + random.below(50) as f64 / 10.0),
        });
        (first.collect::<Vec<_>>(), last.collect::<Vec<_>>())
    };
    let gap = random.of(&["NA", "-", "n.d.", "NaN"]);
    let has_gaps = random.one_in(4);
    for place in 0..count {
        let (first, last) = others(place, random);
        let cell = match has_gaps && random.one_in(10) {
            true => gap.to_owned(),
            false => {
                let (cell, rounded) = writing.written(random.velocity());
                velocities.push(rounded);
                cell
            }
        };
        write_row(&row(first, cell, last));
    }
    let mut is_ambiguous = "";
    if language.name == "SV" && is_kilometres && unit.is_empty() && behind.is_empty() {
        is_ambiguous = "a symbol that may mean something else, with numbers of another size";
    }
    if random.one_in(3) {
        let mean = velocities.iter().sum::<f64>() / velocities.len() as f64;
        let squares: f64 = velocities.iter().map(|one| (one - mean) * (one - mean)).sum();
        let deviation = (squares / (velocities.len() - 1) as f64).sqrt();
        let plain = Writing { behind: "", ..writing };
        let shown =
            [plain.written(mean).0, plain.written(deviation).0, velocities.len().to_string()];
        let labels = language.mean.iter().zip(shown).take(1 + random.below(3));
        for (label, value) in labels {
            let label = if is_blank { label.replace(' ', "_") } else { (*label).to_owned() };
            let empty = |count: usize| vec![if is_blank { "-" } else { "" }.to_owned(); count];
            let mut first = empty(before.len());
            first[0] = label;
            write_row(&row(first, value, empty(behind_names.len())));
        }
        if random.one_in(5) {
            // A mean of others: nobody can know.
            let mut first = vec![String::from("-"); before.len()];
            first[0] = "Mean".to_owned();
            let last = vec!["-".to_owned(); behind_names.len()];
            write_row(&row(first, plain.written(mean + 25.0).0, last));
            is_ambiguous = "a mean of other rows";
        }
    }
    match random.below(8) {
        0 => text += "\nRemarks: none, or few\nchecked by A\n",
        1 if is_blank => text += "\nEnd\n",
        1 => writeln!(text, "\nNumber of measurements:{separator}{count}").unwrap(),
        _ => {}
    }
    let end = random.of(&["\n", "\r\n", "\r"]);
    let text = text.replace('\n', end);
    let bytes = match random.below(4) {
        0 => [b"\xef\xbb\xbf", text.as_bytes()].concat(),
        1 => [vec![0xff, 0xfe], text.encode_utf16().flat_map(u16::to_le_bytes).collect()].concat(),
        2 if language.encoding.is_some_and(|encoding| !encoding.encode(&text).2) => {
            language.encoding.unwrap().encode(&text).0.into_owned()
        }
        _ => text.as_bytes().to_vec(),
    };
    Table { bytes, velocities, is_ambiguous, text }
}

/// The velocities that a job has which `init` wrote, in the order of the file; or the refusal.
fn read(table: &Table) -> Result<(Vec<f64>, String), String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("v.csv");
    std::fs::write(&path, &table.bytes).unwrap();
    let first = init::of_csv(&path, "v.csv").map_err(|error| error.to_string())?;
    let said =
        first.understood.join("\n") + "\n" + &first.text[..first.text.find("\n\n").unwrap_or(0)];
    let job = job_file::parse(&first.text, Format::Toml, directory.path(), JobKind::Identification);
    let data = job.map_err(|error| error.to_string())?.data.unwrap();
    let sets = (0..data.sets()).flat_map(|set| data.set(set).unwrap().velocities.to_vec());
    Ok((sets.collect(), said))
}

#[test]
fn generated_tables_are_read_right_or_refused() {
    let mut refused = Vec::new();
    // As many as are asked for, to look for more.
    let tables = std::env::var("OSTEON_TABLES").ok().and_then(|count| count.parse().ok());
    let tables: u64 = tables.unwrap_or(TABLES);
    for seed in FIRST_SEED..FIRST_SEED + tables {
        let table = table(seed);
        let mut expected = table.velocities.clone();
        expected.sort_by(f64::total_cmp);
        match read(&table) {
            Err(message) => {
                assert!(message.lines().count() <= 3, "seed {seed}: {message}");
                refused.push((seed, table.is_ambiguous, message, table.text));
            }
            Ok((mut velocities, said)) => {
                velocities.sort_by(f64::total_cmp);
                let is_equal = velocities.len() == expected.len()
                    && velocities
                        .iter()
                        .zip(&expected)
                        .all(|(one, other)| (one - other).abs() < 1e-6);
                assert!(
                    is_equal,
                    "seed {seed}: {} for {}: {said}\n{}",
                    velocities.len(),
                    expected.len(),
                    table.text
                );
            }
        }
    }
    let unexplained: Vec<_> = refused.iter().filter(|(_, why, _, _)| why.is_empty()).collect();
    for (seed, why, message, text) in &refused {
        let beginning: String = text.chars().take(300).collect();
        println!("seed {seed} refused ({why}): {message}");
        if why.is_empty() {
            println!("{beginning}");
        }
    }
    println!("{} of {tables} refused, from seed {FIRST_SEED} on", refused.len());
    assert!(unexplained.is_empty(), "{} refused without a reason", unexplained.len());
}
