//! Rows that sum up others, known by their label and by their value.

use super::units::folded;

/// What a label says that a value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Statistic {
    Mean,
    Deviation,
    Count,
    Sum,
    Largest,
    Smallest,
    Median,
    /// Something that is not compared.
    Other,
}

/// Words of labels, in lower case.
const WORDS: [(Statistic, &[&str]); 8] = [
    (
        Statistic::Mean,
        &[
            "mean",
            "means",
            "average",
            "averages",
            "avg",
            "mittelwert",
            "mittel",
            "mw",
            "durchschnitt",
            "moyenne",
            "moy",
            "media",
            "promedio",
            "m\u{e9}dia",
            "gemiddelde",
            "medelv\u{e4}rde",
            "\u{441}\u{440}\u{435}\u{434}\u{43d}\u{435}\u{435}",
            "\u{5e73}\u{5747}",
            "\u{5e73}\u{5747}\u{503c}",
            "\u{5e73}\u{5747}\u{5024}",
            "\u{5747}\u{503c}",
            "\u{f8}",
        ],
    ),
    (
        Statistic::Deviation,
        &[
            "sd",
            "std",
            "stdev",
            "stddev",
            "dev",
            "stdabw",
            "stabw",
            "deviation",
            "standardabweichung",
            "sigma",
            "\u{3c3}",
            "\u{e9}cart",
            "ecart",
            "desviaci\u{f3}n",
            "desviacion",
            "desvest",
            "deviazione",
            "\u{6807}\u{51c6}\u{5dee}",
            "\u{6a19}\u{6e96}\u{504f}\u{5dee}",
        ],
    ),
    (
        Statistic::Count,
        &["n", "count", "anzahl", "nombre", "number", "\u{6570}", "\u{500b}\u{6570}"],
    ),
    (
        Statistic::Sum,
        &[
            "sum",
            "total",
            "totals",
            "summe",
            "gesamt",
            "somme",
            "totale",
            "suma",
            "\u{438}\u{442}\u{43e}\u{433}\u{43e}",
            "\u{5408}\u{8ba1}",
            "\u{5408}\u{8a08}",
        ],
    ),
    (
        Statistic::Largest,
        &[
            "max",
            "maximum",
            "m\u{e1}ximo",
            "massimo",
            "maximo",
            "\u{6700}\u{5927}",
            "\u{6700}\u{5927}\u{503c}",
            "\u{6700}\u{5927}\u{5024}",
        ],
    ),
    (
        Statistic::Smallest,
        &[
            "min",
            "minimum",
            "m\u{ed}nimo",
            "minimo",
            "\u{6700}\u{5c0f}",
            "\u{6700}\u{5c0f}\u{503c}",
            "\u{6700}\u{5c0f}\u{5024}",
        ],
    ),
    (
        Statistic::Median,
        &[
            "median",
            "m\u{e9}diane",
            "mediane",
            "mediana",
            "\u{4e2d}\u{4f4d}\u{6570}",
            "\u{4e2d}\u{592e}\u{5024}",
        ],
    ),
    (
        Statistic::Other,
        &[
            "cv",
            "cov",
            "variationskoeffizient",
            "sem",
            "se",
            "stderr",
            "range",
            "spannweite",
            "variance",
            "varianz",
            "iqr",
            "q1",
            "q3",
            "percentile",
            "rms",
        ],
    ),
];
/// Labels that may as well be the initials or the name of somebody.
const LIKE_NAMES: [&str; 16] = [
    "mw", "sd", "n", "max", "min", "se", "cv", "media", "total", "std", "dev", "moy", "sem", "cov",
    "\u{f8}", "q1",
];
/// Most words of a label.
const WORDS_MAX: usize = 5;
/// Longest label, bytes.
const BYTES_MAX: usize = 80;

/// The label of a row that seems to sum up others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SummaryLabel {
    pub(super) text: String,
    pub(super) statistic: Statistic,
    /// Whether it may be somebody's name.
    pub(super) is_like_name: bool,
}

impl SummaryLabel {
    /// Returns the label that a cell is.
    pub(super) fn recognize(cell: &str) -> Option<Self> {
        let begins = cell.chars().next()?;
        if cell.len() > BYTES_MAX
            || !(begins.is_alphabetic() || matches!(begins, '"' | '\'' | '#' | '*' | '('))
        {
            return None;
        }
        // No word of a label is one letter of ASCII but n.
        if cell.len() == 1 && !cell.eq_ignore_ascii_case("n") {
            return None;
        }
        let folded = if cell.is_ascii() { cell.to_ascii_lowercase() } else { folded(cell) };
        let words: Vec<&str> =
            folded.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
        // "Out of range" is no range.
        if words.len() > WORDS_MAX || words.first() == Some(&"out") {
            return None;
        }
        let is_word = |word: &&str| WORDS.iter().any(|(_, list)| list.contains(word));
        // "SD-01" is a specimen.
        let is_alone = || words.iter().all(is_word);
        let (first, last) = (*words.first()?, *words.last()?);
        // In "standard deviation" the word that counts is not the first.
        let of_word = |word: &str| {
            let (statistic, _) = WORDS.iter().find(|(_, list)| list.contains(&word))?;
            let is_like_name = LIKE_NAMES.contains(&word);
            (!is_like_name || is_alone()).then_some((*statistic, is_like_name))
        };
        let (statistic, is_like_name) = of_word(first).or_else(|| of_word(last))?;
        Some(Self { text: cell.to_owned(), statistic, is_like_name })
    }
}

/// The statistics of some velocities, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Statistics {
    count: f64,
    mean: f64,
    deviation: f64,
    largest: f64,
    smallest: f64,
    median: f64,
}

impl Statistics {
    /// Returns those of velocities; `None` if there are fewer than two.
    pub(super) fn from_velocities(velocities: &[f64]) -> Option<Self> {
        if velocities.len() < 2 {
            return None;
        }
        let count = velocities.len() as f64;
        let mean = velocities.iter().sum::<f64>() / count;
        let squares: f64 = velocities.iter().map(|one| (one - mean) * (one - mean)).sum();
        let mut sorted = velocities.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (below, above) = (sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]);
        Some(Self {
            count,
            mean,
            deviation: (squares / (count - 1.0)).sqrt(),
            smallest: sorted[0],
            largest: sorted[sorted.len() - 1],
            median: f64::midpoint(below, above),
        })
    }

    /// Returns whether a value is this statistic, within what both may have been rounded by.
    pub(super) fn is(&self, statistic: Statistic, value: f64, rounding: f64) -> bool {
        let is =
            |expected: f64, more: f64| (value - expected).abs() <= (rounding + more) * 1.000_001;
        match statistic {
            Statistic::Mean => is(self.mean, 0.0),
            // By n - 1, or by n.
            Statistic::Deviation => {
                let of_all = self.deviation * ((self.count - 1.0) / self.count).sqrt();
                is(self.deviation, 0.0) || is(of_all, 0.0)
            }
            Statistic::Count => value == self.count,
            Statistic::Sum => is(self.mean * self.count, rounding * self.count),
            Statistic::Largest => is(self.largest, 0.0),
            Statistic::Smallest => is(self.smallest, 0.0),
            Statistic::Median => is(self.median, 0.0),
            Statistic::Other => false,
        }
    }

    /// Returns the value of a statistic, for a message.
    pub(super) fn value(&self, statistic: Statistic) -> f64 {
        match statistic {
            Statistic::Mean | Statistic::Other => self.mean,
            Statistic::Deviation => self.deviation,
            Statistic::Count => self.count,
            Statistic::Sum => self.mean * self.count,
            Statistic::Largest => self.largest,
            Statistic::Smallest => self.smallest,
            Statistic::Median => self.median,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_told_from_names() {
        let check = |text: &str, expected: Option<Statistic>| {
            assert_eq!(
                SummaryLabel::recognize(text).map(|label| label.statistic),
                expected,
                "{text}"
            );
        };
        for (text, expected) in [
            ("Mean", Statistic::Mean),
            ("MEAN:", Statistic::Mean),
            ("Average of all", Statistic::Mean),
            ("P1 mean", Statistic::Mean),
            ("Mittelwert", Statistic::Mean),
            ("\u{5e73}\u{5747}", Statistic::Mean),
            ("Standard deviation", Statistic::Deviation),
            ("SD", Statistic::Deviation),
            ("Std.Dev", Statistic::Deviation),
            ("N", Statistic::Count),
            ("Maximum", Statistic::Largest),
            ("min", Statistic::Smallest),
            ("Total", Statistic::Sum),
            ("Median", Statistic::Median),
        ] {
            check(text, Some(expected));
        }
        for text in ["P1", "A", "Max M\u{fc}ller", "Meaney", "12", "", "left", "total hip left"] {
            check(text, None);
        }
        assert!(SummaryLabel::recognize("SD").is_some_and(|label| label.is_like_name));
        assert!(SummaryLabel::recognize("Mean").is_some_and(|label| !label.is_like_name));
    }

    #[test]
    fn a_statistic_is_known_by_its_value() {
        let of_four = Statistics::from_velocities(&[3900.0, 3910.0, 3920.0, 3950.0]).unwrap();
        for (statistic, value, rounding, expected) in [
            (Statistic::Mean, 3920.0, 0.5, true),
            (Statistic::Mean, 3921.0, 0.5, false),
            (Statistic::Deviation, 21.6, 0.05, true),
            (Statistic::Deviation, 18.7, 0.05, true),
            (Statistic::Count, 4.0, 0.5, true),
            (Statistic::Count, 5.0, 0.5, false),
            (Statistic::Sum, 15_680.0, 0.5, true),
            (Statistic::Largest, 3950.0, 0.5, true),
            (Statistic::Smallest, 3910.0, 0.5, false),
            (Statistic::Median, 3915.0, 0.5, true),
            (Statistic::Other, 3920.0, 0.5, false),
        ] {
            assert_eq!(of_four.is(statistic, value, rounding), expected, "{statistic:?} {value}");
        }
        assert_eq!(Statistics::from_velocities(&[3900.0]), None);
    }
}
