//! Depth errors of the static map in metres, as histograms: memory does not grow with the frames.

use crate::evaluate::quantile::quantile_bin;
use serde::{Deserialize, Serialize};

/// Width of a bin of the error histogram, m.
const ERROR_BIN_M: f64 = 0.000_5;
/// Width of a bin of the depth histogram, m.
const DEPTH_BIN_M: f64 = 0.01;
/// Bins of either histogram; larger values fall into the last.
const BINS: usize = 10_000;

/// Depth errors of the static map, at the points it shows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DepthErrorFigures {
    /// Median of |depth of the map - reference depth|, m, to half a millimetre.
    pub median_error_m: f64,
    /// Median reference depth of the same points, m, to a centimetre.
    pub median_depth_m: f64,
    /// Median distance of the reference points from the plane the map shows at their pixel, m, to
    /// half a millimetre: on a road seen from low above it is a small part of the depth error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub median_surface_m: Option<f64>,
}

/// Collects depth errors.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct DepthErrors {
    /// Empty until the first point.
    errors: Vec<u64>,
    depths: Vec<u64>,
    #[serde(default)]
    surfaces: Vec<u64>,
}

impl DepthErrors {
    /// Takes in a point that the map shows. `along_normal` is the length of a ray of depth 1 along
    /// the surface's normal, where there is a normal.
    pub fn add(&mut self, shown_m: f64, true_m: f64, along_normal: Option<f64>) {
        let error_m = (shown_m - true_m).abs();
        count(&mut self.errors, error_m / ERROR_BIN_M);
        count(&mut self.depths, true_m / DEPTH_BIN_M);
        if let Some(along_normal) = along_normal {
            count(&mut self.surfaces, error_m * along_normal.abs() / ERROR_BIN_M);
        }
    }

    /// The figures; `None` without a point.
    pub fn figures(&self) -> Option<DepthErrorFigures> {
        // The middle of the bin in which the median lies.
        let median =
            |counts: &[u64], bin_m: f64| Some(bin_m * (quantile_bin(counts, 0.5)? as f64 + 0.5));
        Some(DepthErrorFigures {
            median_error_m: median(&self.errors, ERROR_BIN_M)?,
            median_depth_m: median(&self.depths, DEPTH_BIN_M)?,
            median_surface_m: median(&self.surfaces, ERROR_BIN_M),
        })
    }
}

fn count(bins: &mut Vec<u64>, bin: f64) {
    bins.resize(BINS, 0);
    if let Some(count) = bins.get_mut((bin as usize).min(BINS - 1)) {
        *count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_right_to_half_a_bin_and_outliers_do_not_move_them() {
        let mut errors = DepthErrors::default();
        assert_eq!(errors.figures(), None);
        // The third is a gross outlier on a nearer point.
        for (shown_m, true_m) in [(10.1, 10.0), (9.9, 10.0), (400.0, 12.0)] {
            errors.add(shown_m, true_m, Some(-0.2));
        }
        let figures = errors.figures().unwrap();
        assert!(
            (figures.median_error_m - 0.1).abs() < 0.001
                && (figures.median_depth_m - 10.0).abs() < 0.02,
            "{figures:?}"
        );
        // 0.1 m along the ray is 0.02 m along the normal.
        assert!((figures.median_surface_m.unwrap() - 0.02).abs() < 0.001, "{figures:?}");
    }
}
