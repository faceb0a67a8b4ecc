//! Nodes of averages over a normal error.

/// Nodes and weights of Gauss-Hermite quadrature for the standard normal law (M. Abramowitz and
/// I. A. Stegun, Handbook of Mathematical Functions (1964), Table 25.10, n = 5).
pub(super) const NORMAL_NODES: [(f64, f64); 5] = [
    (-2.856_970_013_872_806, 0.011_257_411_327_720_7),
    (-1.355_626_179_974_266, 0.222_075_922_005_612_6),
    (0.0, 0.533_333_333_333_333_3),
    (1.355_626_179_974_266, 0.222_075_922_005_612_6),
    (2.856_970_013_872_806, 0.011_257_411_327_720_7),
];
/// Largest error of the model's moments, in units of the data's, that Gauss-Hermite quadrature can
/// average over; larger ones need nodes whose distance is a fraction of the data's error.
const SMALL: f64 = 1.0;
/// Distance of these nodes, in units of the data's error, and how far they reach, in units of the
/// model's.
const WIDE_NODES: (f64, f64) = (1.25, 4.5);
/// Largest error of the model's moments, in units of the data's, that is averaged over.
pub const MODEL_ERROR_MAX: f64 = 6.0;
/// Errors of the model's moments below this fraction of the data's are negligible.
const NEGLIGIBLE: f64 = 0.02;

/// Returns nodes and weights of the average over a normal error, in units of its standard deviation,
/// for a function whose width is 1/`ratio` of that.
pub(super) fn normal_nodes(ratio: f64) -> Vec<(f64, f64)> {
    if ratio <= NEGLIGIBLE {
        return vec![(0.0, 1.0)];
    }
    if ratio <= SMALL {
        return NORMAL_NODES.to_vec();
    }
    let (distance, reach) = WIDE_NODES;
    let half = (reach * ratio.min(MODEL_ERROR_MAX) / distance).ceil();
    let nodes = (0..=2 * half as usize).map(|k| {
        let z = reach * (k as f64 / half - 1.0);
        (z, libm::exp(-0.5 * z * z))
    });
    let nodes: Vec<(f64, f64)> = nodes.collect();
    let total: f64 = nodes.iter().map(|node| node.1).sum();
    nodes.into_iter().map(|(z, weight)| (z, weight / total)).collect()
}
