//! The likelihood of random effects: a share ρ of the variance σ² lies between the subjects, the rest
//! between the velocities of one subject (S. R. Searle, G. Casella and C. E. McCulloch, Variance
//! Components (1992), Sec. 3.7). ρ is unknown, and integrated out under a uniform prior.
//!
//! As a function of ρ the likelihood may be a very narrow peak, where a few per cent of the variance
//! lie within the subjects as well as in the middle. The integral is computed in
//! y = ln(ρ/(1 - ρ)), by the trapezoidal rule from where the integrand begins to where it ends.

/// Distance of the values of y at which the peak is looked for.
const COARSE: f64 = 1.5;
/// The first and the last of these. Beyond, less than 1e-5 of the variance lies between subjects, or
/// less than 1e-8 within them.
const ENDS: [f64; 2] = [-12.0, 18.0];
/// Number of times that the peak's interval is halved.
const HALVED: usize = 12;
/// First distance from the peak at which the integrand's end is looked for; doubled until it is there.
const FIRST_STEP: f64 = 0.05;
/// The integrand ends where its logarithm is smaller than the largest by this much.
const DROP: f64 = 16.0;
/// Number of intervals of the trapezoidal rule.
const INTERVALS: usize = 96;
/// Velocities of a subject that differ by less than this share of the variance are repeats of one.
const REPEATS: f64 = 1e-12;

/// Subjects that have the same number of velocities each, and the sums over them that are
/// sufficient for the likelihood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SubjectClass {
    /// Velocities of each subject.
    size: f64,
    /// Number of subjects.
    count: f64,
    /// Sum of their means, from the centre.
    means: f64,
    /// Sum of the squares of their means, from the centre.
    squares: f64,
    /// Sum of squares within the subjects.
    within: f64,
}

/// All subjects, in classes of equal numbers of velocities.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Subjects(pub(super) Vec<SubjectClass>);

/// The integrand for one mean and variance.
struct Integrand<'a> {
    classes: &'a [SubjectClass],
    mean: f64,
    variance: f64,
    instrument: f64,
}

impl SubjectClass {
    /// Returns the class of `count` independent velocities of which only the standard deviation is
    /// known.
    pub(super) fn of_moments(count: f64, deviation: f64) -> Self {
        let squares = count * (deviation * deviation);
        Self { size: 1.0, count, means: 0.0, squares, within: 0.0 }
    }

    /// Returns the logarithm of the likelihood, given the mean and the variances within and between
    /// subjects.
    pub(super) fn log(&self, mean: f64, within: f64, between: f64) -> f64 {
        let whole = within + self.size * between;
        let logs = (self.size - 1.0) * libm::log(within) + libm::log(whole);
        let residual = self.residual(mean);
        -0.5 * (self.count * logs + self.within / within + self.size * residual / whole)
    }

    /// Returns the sum of squares of the subjects' means from `mean`, which is given as distance from
    /// the centre.
    fn residual(&self, mean: f64) -> f64 {
        self.squares - 2.0 * mean * self.means + self.count * (mean * mean)
    }
}

impl Subjects {
    /// Sums velocities by their subjects, whose indices are given, and the subjects by the number of
    /// their velocities.
    pub(super) fn new(velocities: impl Iterator<Item = (f64, u32)>, centre: f64) -> Self {
        let mut sums: Vec<[f64; 3]> = Vec::new();
        for (velocity, subject) in velocities {
            let off = velocity - centre;
            sums.resize(sums.len().max(subject as usize + 1), [0.0; 3]);
            let [size, sum, square] = &mut sums[subject as usize];
            *size += 1.0;
            *sum += off;
            *square += off * off;
        }
        let mut classes: Vec<SubjectClass> = Vec::new();
        for [size, sum, square] in sums {
            if size == 0.0 {
                continue;
            }
            let mean = sum / size;
            let within = (square - sum * mean).max(0.0);
            let one = SubjectClass { size, count: 1.0, means: mean, squares: mean * mean, within };
            match classes.iter_mut().find(|class| class.size == size) {
                Some(class) => {
                    class.count += 1.0;
                    class.means += one.means;
                    class.squares += one.squares;
                    class.within += one.within;
                }
                None => classes.push(one),
            }
        }
        Self(classes)
    }

    /// Returns the number of subjects.
    pub(super) fn count(&self) -> f64 {
        self.0.iter().map(|class| class.count).sum()
    }

    /// Returns the variance within the subjects; `None` if each has one velocity only.
    pub(super) fn within_variance(&self) -> Option<f64> {
        let free: f64 = self.0.iter().map(|class| class.count * (class.size - 1.0)).sum();
        let within: f64 = self.0.iter().map(|class| class.within).sum();
        (free > 0.0).then(|| within / free)
    }

    /// Returns the subjects with one velocity each, if all velocities of every subject are equal.
    pub(super) fn without_repeats(mut self) -> Self {
        let squares: f64 = self.0.iter().map(|class| class.squares).sum();
        if self.within_variance().is_some_and(|within| within <= REPEATS * squares) {
            self.0.iter_mut().for_each(|class| (class.size, class.within) = (1.0, 0.0));
        }
        self
    }

    /// Returns an estimate of the share of `variance` that lies between the subjects.
    pub(super) fn share(&self, variance: f64, instrument: f64) -> f64 {
        let Some(within) = self.within_variance() else { return 1.0 };
        (1.0 - (within - instrument).max(0.0) / variance).clamp(0.0, 1.0)
    }

    /// Returns the numbers of independent velocities that would tell as much of the mean, and of the
    /// variance, if `between` of the variance `total` of one velocity lie between subjects.
    pub(super) fn effective_counts(&self, between: f64, total: f64) -> [f64; 2] {
        let alike = between / total;
        let of = |alike: f64| {
            let each = |class: &SubjectClass| class.size / (1.0 + (class.size - 1.0) * alike);
            self.0.iter().map(|class| class.count * each(class)).sum()
        };
        [of(alike), of(alike * alike)]
    }

    /// Returns the logarithm of the likelihood, up to a constant, with the mean given as distance from
    /// the centre.
    pub(super) fn log(&self, mean: f64, variance: f64, instrument: f64) -> f64 {
        let integrand = Integrand { classes: &self.0, mean, variance, instrument };
        if self.0.iter().all(|class| class.size == 1.0) {
            return integrand.log_likelihood(variance + instrument, 0.0);
        }
        integrand.log_integral()
    }
}

impl Integrand<'_> {
    /// Returns the logarithm of the likelihood, given the variances within and between subjects.
    fn log_likelihood(&self, within: f64, between: f64) -> f64 {
        self.classes.iter().map(|class| class.log(self.mean, within, between)).sum()
    }

    /// Returns the logarithm of the integrand at y.
    fn log(&self, y: f64) -> f64 {
        let [share, rest] = shares(y);
        let of_data = self
            .log_likelihood(rest.mul_add(self.variance, self.instrument), share * self.variance);
        of_data + libm::log(share * rest)
    }

    /// Returns the derivative of the logarithm of the integrand by y.
    fn slope(&self, y: f64) -> f64 {
        let [share, rest] = shares(y);
        let within = rest.mul_add(self.variance, self.instrument);
        let step = self.variance * share * rest;
        let of = |class: &SubjectClass| {
            let whole = within + class.size * share * self.variance;
            let by_within =
                class.count * (class.size - 1.0) / within - class.within / (within * within);
            let by_whole =
                class.count / whole - class.size * class.residual(self.mean) / (whole * whole);
            step * ((class.size - 1.0) * by_whole - by_within)
        };
        rest - share - 0.5 * self.classes.iter().map(of).sum::<f64>()
    }

    fn log_integral(&self) -> f64 {
        let [first, last] = ENDS;
        let count = ((last - first) / COARSE) as usize;
        let coarse: Vec<(f64, f64)> = (0..=count)
            .map(|k| {
                let y = first + k as f64 * COARSE;
                (y, self.log(y))
            })
            .collect();
        let highest = coarse.iter().fold(coarse[0], |a, b| if b.1 > a.1 { *b } else { a });
        let peak = self.peak(highest.0 - COARSE, highest.0 + COARSE);
        let largest = self.log(peak).max(highest.1);
        let (mut low, mut high) = (self.end(peak, -1.0, largest), self.end(peak, 1.0, largest));
        // There may be a second, lower peak.
        for (y, _) in coarse.iter().filter(|(_, log)| *log > largest - DROP) {
            low = if *y < low { y - COARSE } else { low };
            high = if *y > high { y + COARSE } else { high };
        }
        let step = (high - low) / INTERVALS as f64;
        let nodes = (0..=INTERVALS).map(|k| self.log(low + k as f64 * step) - largest);
        largest + libm::log(step * nodes.map(libm::exp).sum::<f64>())
    }

    /// Returns where the integrand is largest between two values of y, by halving where its slope
    /// changes sign.
    fn peak(&self, mut low: f64, mut high: f64) -> f64 {
        for _ in 0..HALVED {
            let middle = 0.5 * (low + high);
            if self.slope(middle) > 0.0 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Returns where the integrand has become negligible, seen from its peak in one direction.
    fn end(&self, peak: f64, direction: f64, largest: f64) -> f64 {
        let mut step = FIRST_STEP;
        let reach = 2.0 * (ENDS[1] - ENDS[0]);
        while step < reach && self.log(peak + direction * step) > largest - DROP {
            step *= 2.0;
        }
        peak + direction * step
    }
}

/// Returns ρ and 1 - ρ.
fn shares(y: f64) -> [f64; 2] {
    let small = libm::exp(-y.abs());
    let (larger, smaller) = (1.0 / (1.0 + small), small / (1.0 + small));
    if y > 0.0 { [larger, smaller] } else { [smaller, larger] }
}
