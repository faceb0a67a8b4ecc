//! Statistics of velocities that figures show. They state nothing of the result: `result.json` has its
//! own numbers.

/// Most points of a curve: more are not seen.
const POINTS_MAX: usize = 400;
/// Number of cells in which velocities are counted before they are smoothed.
const CELLS: usize = 2048;
/// Number of points of a density.
const DENSITY_POINTS: usize = 240;
/// Half the width of a normal law's 95 % interval, in standard deviations.
pub(crate) const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Velocities in ascending order, with those in the order of their indices beside them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct VelocitySample {
    in_order: Vec<f64>,
    sorted: Vec<f64>,
}

impl VelocitySample {
    /// Returns the velocities as a sample; `None` if there is none.
    pub(crate) fn new(velocities: Vec<f64>) -> Option<Self> {
        let mut sorted: Vec<f64> =
            velocities.iter().copied().filter(|velocity| velocity.is_finite()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let in_order = velocities.into_iter().filter(|velocity| velocity.is_finite()).collect();
        (!sorted.is_empty()).then_some(Self { in_order, sorted })
    }

    pub(crate) fn len(&self) -> usize {
        self.sorted.len()
    }

    /// The velocities in the order of their indices.
    pub(crate) fn in_order(&self) -> &[f64] {
        &self.in_order
    }

    /// The smallest and the largest.
    pub(crate) fn range(&self) -> [f64; 2] {
        [self.sorted[0], self.sorted[self.len() - 1]]
    }

    /// Returns the share of velocities at most `velocity`, of those equal to it half.
    pub(crate) fn share_below(&self, velocity: f64) -> f64 {
        let below = self.sorted.partition_point(|one| *one < velocity);
        let up_to = self.sorted.partition_point(|one| *one <= velocity);
        (below + up_to) as f64 / (2.0 * self.len() as f64)
    }

    /// Returns the distribution function as a line of steps, thinned to what is seen.
    pub(crate) fn distribution(&self) -> Vec<[f64; 2]> {
        let n = self.len() as f64;
        let every = self.len().div_ceil(POINTS_MAX);
        let mut line = vec![[self.sorted[0], 0.0]];
        let mut height = 0.0;
        let places = (0..self.len())
            .filter(|place| (place + 1).is_multiple_of(every) || place + 1 == self.len());
        for place in places {
            let velocity = self.sorted[place];
            line.push([velocity, height]);
            height = (place + 1) as f64 / n;
            line.push([velocity, height]);
        }
        line
    }

    /// Returns the band that holds the whole distribution function of independent velocities with a
    /// probability of at least 95 % (Dvoretzky, Kiefer, Wolfowitz, with Massart's constant).
    pub(crate) fn band(&self) -> Vec<[f64; 3]> {
        let half = libm::sqrt(libm::log(2.0 / 0.05) / (2.0 * self.len() as f64));
        let around = |[x, y]: [f64; 2]| [x, (y - half).max(0.0), (y + half).min(1.0)];
        self.distribution().into_iter().map(around).collect()
    }

    /// Returns the width of the normal kernel that smooths the velocities (Silverman's rule).
    pub(crate) fn bandwidth(&self) -> f64 {
        let deviation = libm::sqrt(self.variance());
        let quartiles = (self.quantile(0.75) - self.quantile(0.25)) / 1.349;
        let spread = if quartiles > 0.0 { deviation.min(quartiles) } else { deviation };
        let fifth = libm::pow(self.len() as f64, -0.2);
        let [low, high] = self.range();
        (0.9 * spread * fifth).max(1e-6 * (high - low).abs()).max(1e-9 * high.abs())
    }

    /// Returns a density (1/(m/s)) smoothed by a normal kernel, on a grid that ends three widths of
    /// the kernel beyond the velocities.
    pub(crate) fn density(&self) -> Vec<[f64; 2]> {
        let width = self.bandwidth();
        let [low, high] = self.range();
        let (low, high) = (low - 3.0 * width, high + 3.0 * width);
        let cell = (high - low) / CELLS as f64;
        let mut counts = vec![0_u32; CELLS];
        for velocity in &self.sorted {
            let place = ((velocity - low) / cell) as usize;
            counts[place.min(CELLS - 1)] += 1;
        }
        let filled: Vec<(f64, f64)> = counts
            .iter()
            .enumerate()
            .filter(|(_, count)| **count > 0)
            .map(|(place, count)| (low + (place as f64 + 0.5) * cell, f64::from(*count)))
            .collect();
        let scale = 1.0 / (self.len() as f64 * width * libm::sqrt(2.0 * std::f64::consts::PI));
        let at = |velocity: f64| -> f64 {
            let kernel = |(center, count): &(f64, f64)| {
                let deviations = (velocity - center) / width;
                count * libm::exp(-0.5 * deviations * deviations)
            };
            scale * filled.iter().map(kernel).sum::<f64>()
        };
        let step = (high - low) / (DENSITY_POINTS - 1) as f64;
        let velocities = (0..DENSITY_POINTS).map(|place| low + place as f64 * step);
        velocities.map(|velocity| [velocity, at(velocity)]).collect()
    }

    /// Returns the lowest density that a logarithmic plot should show: a tenth of the contribution of
    /// one velocity at its place.
    pub(crate) fn lowest_density(&self) -> f64 {
        let peak = self.bandwidth() * libm::sqrt(2.0 * std::f64::consts::PI);
        0.1 / (self.len() as f64 * peak)
    }

    /// Returns the share of velocities at each place of a histogram as a density: left, right, height.
    pub(crate) fn histogram(&self) -> Vec<[f64; 3]> {
        let [low, high] = self.range();
        if high <= low {
            return Vec::new();
        }
        let count = (2.0 * libm::cbrt(self.len() as f64)).ceil().clamp(5.0, 60.0);
        let width = (high - low) / count;
        let edge = |place: f64| low + place * width;
        let places = (0..count as u32).map(f64::from);
        let bar = |place: f64| {
            let from = self.sorted.partition_point(|one| *one < edge(place));
            let last = place + 1.0 >= count;
            let to = self.sorted.partition_point(|one| *one < edge(place + 1.0));
            let inside = if last { self.len() - from } else { to - from };
            [edge(place), edge(place + 1.0), inside as f64 / (self.len() as f64 * width)]
        };
        places.map(bar).collect()
    }

    fn quantile(&self, share: f64) -> f64 {
        self.sorted[((self.len() - 1) as f64 * share).round() as usize]
    }

    fn variance(&self) -> f64 {
        let mut sums = PowerSums::new(self.sorted[0]);
        self.sorted.iter().for_each(|velocity| sums.add(*velocity));
        sums.variance()
    }

    /// Returns mean and coefficient of variation of the first n velocities with their standard errors,
    /// as if they were independent, for about `steps` values of n with equal ratios.
    pub(crate) fn running_moments(&self, steps: u32) -> Vec<Running> {
        let Some(first) = self.in_order.first() else { return Vec::new() };
        let (mut sums, mut found, mut next) = (PowerSums::new(*first), Vec::new(), 2.0);
        let ratio = libm::pow(self.len() as f64 / 2.0, 1.0 / f64::from(steps.max(1)));
        for (place, velocity) in self.in_order.iter().enumerate() {
            sums.add(*velocity);
            let count = (place + 1) as f64;
            if count >= 2.0 && (count >= next || place + 1 == self.len()) {
                found.push(sums.moments_so_far());
                while next <= count {
                    next = (next * ratio).max(next + 1.0).round();
                }
            }
        }
        found
    }
}

/// Moments of the first velocities of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Running {
    pub(crate) count: f64,
    /// Mean and its standard error, m/s.
    pub(crate) mean: [f64; 2],
    /// Coefficient of variation and its standard error.
    pub(crate) variation: [f64; 2],
}

/// Sums of powers of the distances from a velocity near the mean.
struct PowerSums {
    origin: f64,
    count: f64,
    sums: [f64; 4],
}

impl PowerSums {
    fn new(origin: f64) -> Self {
        Self { origin, count: 0.0, sums: [0.0; 4] }
    }

    fn add(&mut self, velocity: f64) {
        let distance = velocity - self.origin;
        let mut power = 1.0;
        for sum in &mut self.sums {
            power *= distance;
            *sum += power;
        }
        self.count += 1.0;
    }

    fn variance(&self) -> f64 {
        let mean = self.sums[0] / self.count;
        let squares = self.sums[1] - self.count * mean * mean;
        (squares / (self.count - 1.0).max(1.0)).max(0.0)
    }

    /// The error of the coefficient of variation is that of the first order, from the third and fourth
    /// central moments.
    fn moments_so_far(&self) -> Running {
        let n = self.count;
        let [a, b, c, d] = self.sums.map(|sum| sum / n);
        let (second, mean) = (b - a * a, self.origin + a);
        let third = c - 3.0 * a * b + 2.0 * a * a * a;
        let fourth = d - 4.0 * a * c + 6.0 * a * a * b - 3.0 * a * a * a * a;
        let variance = self.variance();
        let variation = libm::sqrt(variance) / mean;
        let relative = if second > 0.0 {
            let (skew, kurtosis) =
                (third / (second * libm::sqrt(second)), fourth / (second * second));
            ((kurtosis - 1.0) / (4.0 * n) + variation * variation / n - variation * skew / n)
                .max(0.0)
        } else {
            0.0
        };
        Running {
            count: n,
            mean: [mean, libm::sqrt(variance / n)],
            variation: [variation, variation * libm::sqrt(relative)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(velocities: &[f64]) -> VelocitySample {
        VelocitySample::new(velocities.to_vec()).unwrap()
    }

    #[test]
    fn a_distribution_rises_by_equal_steps() {
        let line = sample(&[3.0, 1.0]).distribution();
        assert_eq!(line, [[1.0, 0.0], [1.0, 0.0], [1.0, 0.5], [3.0, 0.5], [3.0, 1.0]]);
    }

    #[test]
    fn a_thinned_distribution_keeps_its_ends() {
        let many: Vec<f64> = (0..100_003).map(f64::from).collect();
        let line = sample(&many).distribution();
        assert!(line.len() <= 2 * POINTS_MAX + 3, "{}", line.len());
        assert_eq!((line[0], line[line.len() - 1]), ([0.0, 0.0], [100_002.0, 1.0]));
    }

    #[test]
    fn a_density_and_a_histogram_have_the_area_one() {
        let many: Vec<f64> = (0..1000).map(|n| 4000.0 + f64::from(n * n % 997)).collect();
        let sample = sample(&many);
        let density = sample.density();
        let step = density[1][0] - density[0][0];
        let area: f64 = density.iter().map(|[_, height]| height * step).sum();
        assert!((area - 1.0).abs() < 1e-3, "{area}");
        let bars = sample.histogram();
        let area: f64 = bars.iter().map(|[from, to, height]| (to - from) * height).sum();
        assert!((area - 1.0).abs() < 1e-12, "{area}");
    }

    #[test]
    fn shares_count_equal_velocities_half() {
        let sample = sample(&[1.0, 2.0, 2.0, 4.0]);
        for (velocity, expected) in [(0.5, 0.0), (1.0, 0.125), (2.0, 0.5), (3.0, 0.75), (5.0, 1.0)]
        {
            assert_eq!(sample.share_below(velocity), expected, "{velocity}");
        }
    }

    #[test]
    fn running_moments_end_with_those_of_all() {
        let running = sample(&[1.0, 2.0, 3.0, 6.0]).running_moments(50);
        let last = running[running.len() - 1];
        assert_eq!((last.count, last.mean[0]), (4.0, 3.0));
        // Variance 14/3 with three degrees of freedom.
        assert!((last.mean[1] - libm::sqrt(14.0 / 12.0)).abs() < 1e-12, "{last:?}");
        assert!((last.variation[0] - libm::sqrt(14.0 / 3.0) / 3.0).abs() < 1e-12, "{last:?}");
        assert_eq!(running[0].count, 2.0);
    }

    #[test]
    fn equal_velocities_do_no_harm() {
        let sample = sample(&[4000.0; 7]);
        assert!(sample.bandwidth() > 0.0 && sample.histogram().is_empty());
        assert!(sample.density().iter().all(|[_, height]| height.is_finite()));
        assert_eq!(sample.running_moments(10)[0].variation, [0.0, 0.0]);
        assert_eq!(VelocitySample::new(vec![f64::NAN]), None);
    }
}
