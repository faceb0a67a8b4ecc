//! Mean and deviation of velocities that come one after another.

/// Number, sum and sum of the squares of velocities.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct RunningMoments {
    count: usize,
    sum: f64,
    squares: f64,
}

impl RunningMoments {
    pub(super) fn add(&mut self, velocity: f64) {
        self.count += 1;
        self.sum += velocity;
        self.squares += velocity * velocity;
    }

    /// Returns those without one of the velocities.
    pub(super) fn without(self, velocity: f64) -> Self {
        Self {
            count: self.count - 1,
            sum: self.sum - velocity,
            squares: self.squares - velocity * velocity,
        }
    }

    pub(super) fn count(&self) -> usize {
        self.count
    }

    pub(super) fn mean(&self) -> f64 {
        self.sum / self.count as f64
    }

    /// Returns the standard deviation.
    pub(super) fn deviation(&self) -> f64 {
        let (count, mean) = (self.count as f64, self.mean());
        ((self.squares - count * mean * mean) / (count - 1.0)).max(0.0).sqrt()
    }
}
