//! Boxes along the camera's axes.

use crate::geometry::scalar::max_f64;
use nalgebra::Vector3;

/// A box in the camera's axes, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Extent {
    pub low: [f64; 3],
    pub high: [f64; 3],
}

impl Extent {
    pub fn contains(&self, point: &Vector3<f64>) -> bool {
        let axes = self.low.iter().zip(&self.high).zip(point.iter());
        axes.into_iter().all(|((low, high), at)| low <= at && at <= high)
    }

    pub fn center(&self) -> Vector3<f64> {
        (Vector3::from(self.low) + Vector3::from(self.high)) * 0.5
    }

    pub fn union(&self, other: &Self) -> Self {
        // The least box that holds both.
        let mut joined = *self;
        for (low, theirs) in joined.low.iter_mut().zip(other.low) {
            *low = if theirs < *low { theirs } else { *low };
        }
        for (high, theirs) in joined.high.iter_mut().zip(other.high) {
            *high = max_f64(theirs, *high);
        }
        joined
    }

    /// Returns the distance between two extents, m; 0 if they overlap.
    pub fn gap(&self, other: &Self) -> f64 {
        let mut squared = 0.0;
        for axis in 0..3 {
            let at = |values: &[f64; 3]| values.get(axis).copied().unwrap_or(0.0);
            let gap = max_f64(at(&other.low) - at(&self.high), at(&self.low) - at(&other.high));
            squared += if gap > 0.0 { gap * gap } else { 0.0 };
        }
        libm::sqrt(squared)
    }
}
