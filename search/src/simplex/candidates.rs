//! Candidate points: the points that a simplex asks for after each possible cost of its pending
//! point, the most probable first.

use super::{Move, Simplex, Vertex};

/// Probabilities that a reflected point is the best of all, is better than the second worst vertex,
/// is better than the worst vertex only, and is no better than any. They are approximately those
/// observed in identifications.
const REFLECTED: [f64; 4] = [0.15, 0.30, 0.10, 0.45];
/// Probability that an expansion is better than the reflected point.
const EXPANDED: f64 = 0.4;
/// Probability that a contraction is accepted; each further rank among the vertices is half as
/// probable as the one before.
const CONTRACTED: f64 = 0.98;

impl Simplex {
    /// Returns at most `most` points, other than the pending one, that the search may ask for after
    /// it, the most probable first. Each is bit for bit what [`Simplex::ask`] returns if the costs
    /// turn out accordingly. Does not change the state.
    pub fn candidates(&self, most: usize) -> Vec<Vec<f64>> {
        let mut found: Vec<Vec<f64>> = Vec::new();
        let mut ahead = self.outcomes(1.0);
        // Each turn finds a new point or one that was already found by another path.
        for _ in 0..2 * most {
            let likeliest = (0..ahead.len()).max_by(|&a, &b| ahead[a].0.total_cmp(&ahead[b].0));
            let Some((chance, next)) = likeliest.map(|at| ahead.swap_remove(at)) else {
                break;
            };
            if next.pending != self.pending && !found.contains(&next.pending) {
                found.push(next.pending.clone());
            }
            if found.len() >= most {
                break;
            }
            for (chance, next) in next.outcomes(chance) {
                join(&mut ahead, chance, next);
            }
        }
        found
    }

    /// Returns the possible states after the pending point with their probabilities, whose sum is
    /// at most `chance`.
    fn outcomes(&self, chance: f64) -> Vec<(f64, Self)> {
        let mut outcomes = Vec::new();
        let mut suppose = |share: f64, cost: Option<f64>| {
            if let Some(next) = cost.and_then(|cost| self.supposing(cost)) {
                join(&mut outcomes, chance * share, next);
            }
        };
        let last = self.vertices.len().saturating_sub(1);
        match &self.purpose {
            // The order of the vertices of a complete fresh simplex cannot be predicted.
            Move::Build if self.vertices.len() < self.origin.len() => suppose(1.0, Some(f64::MAX)),
            Move::Shrink { index } if *index < last => suppose(1.0, Some(f64::MAX)),
            Move::Build | Move::Shrink { .. } => {}
            Move::Reflect => {
                let [best, better, outside, inside] = REFLECTED;
                suppose(best, self.at_rank(0, None));
                for rank in 1..last {
                    suppose(better / (last - 1) as f64, self.at_rank(rank, None));
                }
                suppose(outside, self.at_rank(last, None));
                suppose(inside, Some(f64::INFINITY));
            }
            Move::Expand { reflected } => {
                suppose(EXPANDED, self.at_rank(0, Some(reflected)));
                suppose(1.0 - EXPANDED, Some(f64::INFINITY));
            }
            Move::ContractOutside { .. } | Move::ContractInside => {
                let reflected = match &self.purpose {
                    Move::ContractOutside { reflected } => Some(reflected),
                    _ => None,
                };
                let mut share = CONTRACTED;
                for rank in 0..=last {
                    share *= 0.5;
                    suppose(share, self.at_rank(rank, reflected));
                }
                suppose(1.0 - CONTRACTED, Some(f64::INFINITY));
            }
        }
        outcomes
    }

    /// Returns a cost with which the pending point ranks after the `rank` best vertices and before
    /// the others, and before `limit`; `None` if there is no such cost.
    fn at_rank(&self, rank: usize, limit: Option<&Vertex>) -> Option<f64> {
        let below = rank.checked_sub(1).map(|before| self.vertices[before].cost);
        let above = self.vertices[rank].cost;
        let above = limit.map_or(above, |limit| limit.cost.min(above));
        let cost = match below {
            None if above.is_finite() => above - above.abs().max(f64::MIN_POSITIVE) / 2.0,
            None => 1.0,
            Some(below) if above.is_finite() => below + 0.5 * (above - below),
            Some(below) => below + below.abs().max(f64::MIN_POSITIVE),
        };
        (cost < above && below.is_none_or(|below| cost >= below)).then_some(cost)
    }

    /// Returns the search as it is after the pending point gets this cost, unless that ends it.
    fn supposing(&self, cost: f64) -> Option<Self> {
        let mut next = self.clone();
        next.evaluations += 1;
        next.step(cost);
        next.skip_what_needs_no_evaluation();
        next.stop.is_none().then_some(next)
    }
}

/// Adds a possible state; a state with the same pending point adds to its probability instead.
fn join(ways: &mut Vec<(f64, Simplex)>, chance: f64, next: Simplex) {
    match ways.iter_mut().find(|(_, way)| way.pending == next.pending) {
        Some((known, _)) => *known += chance,
        None => ways.push((chance, next)),
    }
}
