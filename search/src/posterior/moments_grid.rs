//! Draws of the two moments from the data's likelihood.
//!
//! The likelihood is tabulated on a grid of cells that covers where it is not negligible, and
//! drawn from as a piecewise constant density. The small difference to the likelihood itself is
//! left to the weights of the draws.

use osteon_common::data_likelihood::DataLikelihood;

/// Cells along each axis.
const CELLS: usize = 48;
/// Cells whose likelihood is smaller than the largest by more than this are cut off, nats.
const NEGLIGIBLE: f64 = 22.0;
/// How often the grid is narrowed to the cells that are not negligible.
const NARROWED: usize = 6;

/// Interval of one of the moments, as logarithm.
pub(super) type LogSpan = [f64; 2];

/// A piecewise constant density of the logarithms of mean and coefficient of variation.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MomentsGrid {
    spans: [LogSpan; 2],
    /// Probability of each cell: rows along the mean, columns along the variation.
    cells: Vec<[f64; CELLS]>,
}

/// A draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MomentsDraw {
    /// The logarithms of both moments; a moment that was not asked for is not a number.
    pub(super) at: [f64; 2],
    /// Logarithm of their density, of those that were asked for.
    pub(super) log_density: f64,
}

impl MomentsGrid {
    /// Tabulates the likelihood where it is not negligible within `reach`, the moments that a model
    /// can have.
    pub(super) fn new(likelihood: &DataLikelihood, reach: [LogSpan; 2]) -> Self {
        let (centre, extent) = (likelihood.moments(), likelihood.extent());
        let mut spans = [0, 1].map(|k| nearby(centre[k], extent[k], reach[k]));
        let mut logs = Vec::new();
        for _ in 0..NARROWED {
            logs = tabulated(likelihood, spans);
            let narrower = narrowed(&logs, spans);
            let done = [0, 1]
                .iter()
                .all(|&k| narrower[k][1] - narrower[k][0] > 0.7 * (spans[k][1] - spans[k][0]));
            if done {
                break;
            }
            spans = narrower;
            logs = tabulated(likelihood, spans);
        }
        Self { spans, cells: probabilities(&logs) }
    }

    /// Draws the moments that are asked for, by two numbers that are uniform from 0 to 1.
    pub(super) fn draw(&self, wanted: [bool; 2], uniform: [f64; 2]) -> MomentsDraw {
        let by_mean: Vec<f64> = self.cells.iter().map(|row| row.iter().sum()).collect();
        let mut draw = MomentsDraw { at: [f64::NAN; 2], log_density: 0.0 };
        let mut row = None;
        if wanted[0] {
            let (cell, within) = cell(&by_mean, uniform[0]);
            draw.take(0, self.spans[0], cell, within, by_mean[cell]);
            row = Some(cell);
        }
        if wanted[1] {
            let column = |k: usize| match row {
                Some(row) => self.cells[row][k] / by_mean[row],
                None => self.cells.iter().map(|row| row[k]).sum(),
            };
            let by_variation: Vec<f64> = (0..CELLS).map(column).collect();
            let (cell, within) = cell(&by_variation, uniform[1]);
            draw.take(1, self.spans[1], cell, within, by_variation[cell]);
        }
        draw
    }
}

impl MomentsDraw {
    fn take(&mut self, axis: usize, span: LogSpan, cell: usize, within: f64, probability: f64) {
        let width = (span[1] - span[0]) / CELLS as f64;
        self.at[axis] = span[0] + (cell as f64 + within) * width;
        self.log_density += libm::log(probability / width);
    }
}

/// Returns the part of `reach` within a distance of `centre`, or the end of it that is nearest.
fn nearby(centre: f64, distance: f64, reach: LogSpan) -> LogSpan {
    let low = (centre - distance).clamp(reach[0], reach[1]);
    let high = (centre + distance).clamp(reach[0], reach[1]);
    if high > low {
        return [low, high];
    }
    // The data are out of reach; the model comes as near as it can.
    let tenth = 0.1 * (reach[1] - reach[0]);
    if centre > reach[1] { [reach[1] - tenth, reach[1]] } else { [reach[0], reach[0] + tenth] }
}

fn middle(span: LogSpan, cell: usize) -> f64 {
    span[0] + (cell as f64 + 0.5) * (span[1] - span[0]) / CELLS as f64
}

fn tabulated(likelihood: &DataLikelihood, spans: [LogSpan; 2]) -> Vec<[f64; CELLS]> {
    let row = |i: usize| {
        std::array::from_fn(|j| likelihood.log([middle(spans[0], i), middle(spans[1], j)]))
    };
    (0..CELLS).map(row).collect()
}

/// Returns the spans of the cells that are not negligible, with one more on either side.
fn narrowed(logs: &[[f64; CELLS]], spans: [LogSpan; 2]) -> [LogSpan; 2] {
    let largest = largest(logs);
    let mut ends = [[CELLS, 0]; 2];
    for (i, row) in logs.iter().enumerate() {
        for (j, log) in row.iter().enumerate() {
            if *log > largest - NEGLIGIBLE {
                for (ends, cell) in ends.iter_mut().zip([i, j]) {
                    *ends = [ends[0].min(cell), ends[1].max(cell)];
                }
            }
        }
    }
    [0, 1].map(|k| {
        let width = (spans[k][1] - spans[k][0]) / CELLS as f64;
        let low = spans[k][0] + ends[k][0].saturating_sub(1) as f64 * width;
        let high = spans[k][0] + (ends[k][1] + 2).min(CELLS) as f64 * width;
        if high > low { [low, high] } else { spans[k] }
    })
}

fn largest(logs: &[[f64; CELLS]]) -> f64 {
    logs.iter().flatten().fold(f64::NEG_INFINITY, |largest, log| largest.max(*log))
}

fn probabilities(logs: &[[f64; CELLS]]) -> Vec<[f64; CELLS]> {
    let largest = largest(logs);
    // Neighbours of cells that are just above the limit must have some probability, too.
    let floor = -2.0 * NEGLIGIBLE;
    let weigh = |log: f64| libm::exp((log - largest).max(floor));
    let weights: Vec<[f64; CELLS]> = logs.iter().map(|row| row.map(weigh)).collect();
    let total: f64 = weights.iter().flatten().sum();
    weights.iter().map(|row| row.map(|weight| weight / total)).collect()
}

/// Returns the cell of a uniform number among cells of these probabilities, and where it lies in
/// it, from 0 to 1.
fn cell(probabilities: &[f64], uniform: f64) -> (usize, f64) {
    let mut below = 0.0;
    for (cell, probability) in probabilities.iter().enumerate() {
        if uniform < below + probability {
            return (cell, (uniform - below) / probability);
        }
        below += probability;
    }
    (probabilities.len() - 1, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn likelihood() -> DataLikelihood {
        let velocities: Vec<f64> = (0..40).map(|k| 3900.0 + 17.0 * f64::from(k % 13)).collect();
        DataLikelihood::independent(&velocities, 0.0).unwrap()
    }

    /// Checks that weighted draws have the moments of the likelihood.
    #[test]
    fn draws_are_those_of_the_likelihood() {
        let likelihood = likelihood();
        let grid = MomentsGrid::new(&likelihood, [[7.0, 9.0], [-6.0, 0.0]]);
        let count = 200;
        let (mut sum, mut mean, mut square) = (0.0, [0.0; 2], [0.0; 2]);
        let mut weights_square = 0.0;
        let [centre, errors] = [likelihood.moments(), likelihood.errors()];
        for i in 0..count {
            for j in 0..count {
                let uniform = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(count));
                let draw = grid.draw([true, true], uniform);
                let log = likelihood.log(draw.at) - likelihood.log(centre);
                let weight = libm::exp(log - draw.log_density);
                sum += weight;
                weights_square += weight * weight;
                for k in 0..2 {
                    let off = (draw.at[k] - centre[k]) / errors[k];
                    mean[k] += weight * off;
                    square[k] += weight * off * off;
                }
            }
        }
        let effective = sum * sum / weights_square / f64::from(count * count);
        assert!(effective > 0.97, "{effective}");
        for k in 0..2 {
            let deviation = (square[k] / sum - (mean[k] / sum) * (mean[k] / sum)).sqrt();
            assert!((0.93..1.1).contains(&deviation), "{k}: {deviation}");
        }
        // The law of the logarithm of a standard deviation with 39 degrees of freedom is skew.
        assert!((0.05..0.4).contains(&(mean[1] / sum)), "{mean:?}");
    }

    #[test]
    fn data_out_of_reach_lead_to_the_nearest_end() {
        let grid = MomentsGrid::new(&likelihood(), [[7.0, 8.0], [-6.0, 0.0]]);
        let draw = grid.draw([true, false], [0.5, 0.5]);
        assert!((7.9..8.0).contains(&draw.at[0]), "{draw:?}");
        assert!(draw.at[1].is_nan());
    }
}
