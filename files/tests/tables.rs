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

/// How a table is written.
struct Design {
    language: Language,
    separator: &'static str,
    is_blank: bool,
    has_trailing: bool,
    writing: Writing,
    unit: &'static str,
    has_unit_row: bool,
    /// Names of the other columns, before and behind that of the velocities.
    others: [&'static [&'static str]; 2],
}

impl Design {
    fn of(random: &mut Random) -> Self {
        let language = random.of(&LANGUAGES);
        let separator = random.of(&[",", ",", ";", ";", "\t", "\t", "|", " ", "   "]);
        let is_blank = separator.trim().is_empty() && separator != "\t";
        let marks = if separator == ";" { ['.', ',', '.', ','] } else { ['.', '.', '.', ','] };
        let decimal = random.of(&marks);
        let is_kilometres = random.one_in(4);
        let thousands = match (is_kilometres || is_blank, random.below(5)) {
            (true, _) => None,
            (_, 0) => Some(if decimal == '.' { ',' } else { '.' }),
            (_, 1) => Some(random.of(&['\'', '\u{a0}', '\u{202f}'])),
            _ => None,
        };
        let behind = match (is_blank, is_kilometres, random.below(6)) {
            (false, false, 0) => " \u{b1} 12",
            (false, false, 1) => " m/s",
            (false, true, 1) => " km/s",
            _ => "",
        };
        let decimals = 1 + random.below(2);
        let writing = Writing { decimal, decimals, thousands, behind, is_kilometres };
        let unit = match (is_kilometres, random.below(4)) {
            (false, 0) => "m/s",
            (false, 1) => "m s-1",
            (true, 0) => "km/s",
            (true, 1) => "mm/\u{b5}s",
            _ => "",
        };
        let has_unit_row = !unit.is_empty() && random.one_in(4) && !is_blank;
        let before =
            random.of(&[&["id"][..], &["nr", "patient"], &["Date", "Time"], &["specimen"]]);
        let behind = match (language.encoding, random.below(4)) {
            (None, 0) => &["T_(\u{b0}C)"][..],
            (_, 1) => &["tof_us", "thickness_mm"],
            (_, 2) => &["note"],
            _ => &[],
        };
        let has_trailing = !is_blank && random.one_in(6);
        let others = [before, behind];
        Self { language, separator, is_blank, has_trailing, writing, unit, has_unit_row, others }
    }

    fn write_row(&self, text: &mut String, first: &[String], velocity: &str, last: &[String]) {
        let cells = first.iter().map(String::as_str).chain([velocity]);
        let cells = cells.chain(last.iter().map(String::as_str));
        let cells: Vec<String> = cells.map(|cell| quoted(cell, self.separator)).collect();
        let end = if self.has_trailing { self.separator } else { "" };
        writeln!(text, "{}{end}", cells.join(self.separator)).unwrap();
    }

    /// Writes the names, and the line of units.
    fn write_header(&self, text: &mut String) {
        let (join, blank) = if self.is_blank { ("_", "") } else { (" ", " ") };
        let name = self.language.name.replace(' ', join);
        let unit = self.unit.replace("m s-1", "m/s");
        let name = match unit.is_empty() || self.has_unit_row {
            true => name,
            false => format!("{name}{blank}({unit})"),
        };
        let [before, behind] =
            self.others.map(|list| list.iter().map(|&one| one.to_owned()).collect::<Vec<_>>());
        self.write_row(text, &before, &name, &behind);
        if self.has_unit_row {
            let [before, behind] = self.others.map(|list| vec!["-".to_owned(); list.len()]);
            self.write_row(text, &before, &format!("[{}]", self.unit), &behind);
        }
    }

    /// The cell of another column in a row.
    fn other(&self, name: &str, place: usize, random: &mut Random) -> String {
        let small =
            |value: f64| format!("{value:.2}").replace('.', &self.writing.decimal.to_string());
        match name {
            "id" | "nr" => (place + 1).to_string(),
            "patient" => format!("P{}", place % 3),
            "Date" => format!("2026-03-{:02}", place % 28 + 1),
            "Time" => format!("10:{:02}:00", place % 60),
            "specimen" => format!("S{place}"),
            "note" => "ok".to_owned(),
            "tof_us" => small(5.0 + random.below(100) as f64 / 100.0),
            "thickness_mm" => small(3.0 + random.below(200) as f64 / 100.0),
            _ => small(20.0 + random.below(50) as f64 / 10.0),
        }
    }

    /// Writes rows; returns the velocities in them.
    fn write_rows(&self, text: &mut String, count: usize, random: &mut Random) -> Vec<f64> {
        let mut velocities = Vec::new();
        let gap = random.of(&["NA", "-", "n.d.", "NaN"]);
        let has_gaps = random.one_in(4);
        for place in 0..count {
            let [first, last] = self.others.map(|list| {
                list.iter().map(|name| self.other(name, place, random)).collect::<Vec<_>>()
            });
            let (cell, rounded) = self.writing.written(random.velocity());
            if has_gaps && random.one_in(10) {
                self.write_row(text, &first, gap, &last);
            } else {
                velocities.push(rounded);
                self.write_row(text, &first, &cell, &last);
            }
        }
        velocities
    }

    /// Writes rows that sum up the others.
    fn write_summaries(&self, text: &mut String, velocities: &[f64], random: &mut Random) {
        let mean = velocities.iter().sum::<f64>() / velocities.len() as f64;
        let squares: f64 = velocities.iter().map(|one| (one - mean) * (one - mean)).sum();
        let deviation = (squares / (velocities.len() - 1) as f64).sqrt();
        let plain = Writing { behind: "", ..self.writing };
        let count = velocities.len().to_string();
        let shown = [plain.written(mean).0, plain.written(deviation).0, count];
        for (label, value) in self.language.mean.iter().zip(shown).take(1 + random.below(3)) {
            let label = if self.is_blank { label.replace(' ', "_") } else { (*label).to_owned() };
            let empty = if self.is_blank { "-" } else { "" };
            let [mut first, last] = self.others.map(|list| vec![empty.to_owned(); list.len()]);
            first[0] = label;
            self.write_row(text, &first, &value, &last);
        }
    }

    fn bytes(&self, text: &str, random: &mut Random) -> Vec<u8> {
        let old = self.language.encoding.map(|encoding| encoding.encode(text));
        match (random.below(4), old) {
            (0, _) => [b"\xef\xbb\xbf", text.as_bytes()].concat(),
            (1, _) => [vec![0xff, 0xfe], text.encode_utf16().flat_map(u16::to_le_bytes).collect()]
                .concat(),
            (2, Some((bytes, _, false))) => bytes.into_owned(),
            _ => text.as_bytes().to_vec(),
        }
    }

    /// Why the table may be refused.
    fn ambiguity(&self) -> &'static str {
        let Writing { is_kilometres, behind, .. } = self.writing;
        match self.language.name == "SV"
            && is_kilometres
            && self.unit.is_empty()
            && behind.is_empty()
        {
            true => "a symbol that may mean something else, with numbers of another size",
            false => "",
        }
    }
}

fn table(seed: u64) -> Table {
    let random = &mut Random(seed);
    let design = Design::of(random);
    let mut text = String::new();
    for line in random.of(&PREAMBLES) {
        writeln!(text, "{}", line.replace("{s}", design.separator)).unwrap();
    }
    design.write_header(&mut text);
    let count = 12 + random.below(40);
    let velocities = design.write_rows(&mut text, count, random);
    if random.one_in(3) {
        design.write_summaries(&mut text, &velocities, random);
    }
    match random.below(8) {
        0 => text += "\nRemarks: none, or few\nchecked by A\n",
        1 if design.is_blank => text += "\nEnd\n",
        1 => writeln!(text, "\nNumber of measurements:{}{count}", design.separator).unwrap(),
        _ => {}
    }
    let text = text.replace('\n', random.of(&["\n", "\r\n", "\r"]));
    let bytes = design.bytes(&text, random);
    Table { bytes, velocities, is_ambiguous: design.ambiguity(), text }
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
