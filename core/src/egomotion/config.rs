//! Settings of the motion estimate.

use crate::problem::{Problems, require};

/// Settings of the motion estimate. One set serves the camera; objects use another copy.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct EgomotionConfig {
    /// Most hypotheses drawn from three matches each; 1..=10000. DynSLAM: 500, always all of them.
    pub samples: u16,
    /// Probability with which one hypothesis should be free of outliers: drawing stops once it is
    /// reached; in 0.5..1. DynSLAM: 1.
    pub confidence: f64,
    /// Largest reprojection error of an inlier over its four coordinates together, px; above 0.
    /// DynSLAM: 2.
    pub inlier_px: f32,
    /// The same in the last rounds of refinement; above 0. DynSLAM: 2.
    pub refined_inlier_px: f32,
    /// Fewest matches, and fewest inliers, an estimate is made of; 3..=1000. DynSLAM: 6.
    pub matches_min: u16,
    /// Least share of the matches that must be inliers; in 0..=1. DynSLAM: 0.
    pub inlier_share_min: f32,
    /// Largest acceleration of a camera, m/s²: a motion that needs a larger one is taken only where
    /// the share of inliers is at least `inlier_share_strong`. Above 0. DynSLAM: none.
    pub acceleration_max_m_s2: f64,
    /// Share of inliers from which on any motion is believed; in 0..=1.
    pub inlier_share_strong: f32,
    /// Distance by which the right camera may seem to stand ahead of where the calibration has it,
    /// or behind, m. A larger one comes of cameras that do not expose at the same time: a motion is
    /// taken only where the share of inliers is at least `inlier_share_strong`, and none above four
    /// times the distance ([`RightAhead::is_synchronous`](super::RightAhead::is_synchronous)).
    /// Above 0. DynSLAM: none.
    pub right_ahead_max_m: f64,
    /// Most Gauss-Newton steps of a hypothesis; 1..=50. DynSLAM: about 12.
    pub sample_steps: u8,
    /// Most Gauss-Newton steps of a round of refinement; 1..=250. DynSLAM: about 250.
    pub refine_steps: u8,
    /// Distance from the middle column, as a share of it, at which what rectification left of the
    /// lenses' errors weighs as much as the noise of a match. Those errors grow with the fourth
    /// power: a match at share s has weight 1 / (1 + (s / knee)^8). Above 0; 10 weighs all alike.
    /// DynSLAM: weights 1 / (s + 0.05), which leave twice the error in scale on the clips measured.
    pub side_knee: f64,
    /// Error of a match, px over its four coordinates, at which it weighs a quarter: at error e it
    /// weighs 1 / (1 + (e / robust_px)²)². Above 0, at most 100, which weighs all alike. DynSLAM:
    /// all alike.
    pub robust_px: f64,
}

impl Default for EgomotionConfig {
    fn default() -> Self {
        Self {
            samples: 500,
            confidence: 0.9999,
            inlier_px: 2.0,
            refined_inlier_px: 2.0,
            matches_min: 6,
            inlier_share_min: 0.35,
            acceleration_max_m_s2: 15.0,
            inlier_share_strong: 0.65,
            right_ahead_max_m: 0.05,
            sample_steps: 12,
            refine_steps: 50,
            side_knee: 0.3,
            robust_px: 0.7,
        }
    }
}

impl EgomotionConfig {
    /// Notes what is wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        let positive = |value: f32| value.is_finite() && value > 0.0;
        require(
            problems,
            (1..=10_000).contains(&self.samples),
            "egomotion.samples",
            "must be in 1..=10000",
        );
        require(
            problems,
            (0.5..1.0).contains(&self.confidence),
            "egomotion.confidence",
            "must be at least 0.5 and below 1",
        );
        require(problems, positive(self.inlier_px), "egomotion.inlier_px", "must be above 0");
        require(
            problems,
            positive(self.refined_inlier_px),
            "egomotion.refined_inlier_px",
            "must be above 0",
        );
        require(
            problems,
            (3..=1000).contains(&self.matches_min),
            "egomotion.matches_min",
            "must be in 3..=1000",
        );
        let is_share = |value: f32| (0.0..=1.0).contains(&value);
        require(
            problems,
            is_share(self.inlier_share_min),
            "egomotion.inlier_share_min",
            "must be in 0..=1",
        );
        require(
            problems,
            is_share(self.inlier_share_strong),
            "egomotion.inlier_share_strong",
            "must be in 0..=1",
        );
        let acceleration =
            self.acceleration_max_m_s2.is_finite() && self.acceleration_max_m_s2 > 0.0;
        require(problems, acceleration, "egomotion.acceleration_max_m_s2", "must be above 0");
        let ahead = self.right_ahead_max_m.is_finite() && self.right_ahead_max_m > 0.0;
        require(problems, ahead, "egomotion.right_ahead_max_m", "must be above 0");
        require(
            problems,
            (1..=50).contains(&self.sample_steps),
            "egomotion.sample_steps",
            "must be in 1..=50",
        );
        require(
            problems,
            (1..=250).contains(&self.refine_steps),
            "egomotion.refine_steps",
            "must be in 1..=250",
        );
        require(
            problems,
            self.side_knee > 0.0 && self.side_knee <= 10.0,
            "egomotion.side_knee",
            "must be above 0 and at most 10",
        );
        require(
            problems,
            self.robust_px > 0.0 && self.robust_px <= 100.0,
            "egomotion.robust_px",
            "must be above 0 and at most 100",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    type Setting = (&'static str, fn(&mut EgomotionConfig, f64), &'static [f64], &'static [f64]);
    const SHARE: (&[f64], &[f64]) = (&[0.0, 1.0], &[-0.01, 1.01, f64::NAN]);
    const ABOVE_0: (&[f64], &[f64]) = (&[1e-9, 1e9], &[0.0, -1.0, f64::NAN, f64::INFINITY]);
    const SETTINGS: [Setting; 13] = [
        (
            "egomotion.samples",
            |config, value| config.samples = value as u16,
            &[1.0, 10_000.0],
            &[0.0, 10_001.0],
        ),
        (
            "egomotion.confidence",
            |config, value| config.confidence = value,
            &[0.5, 0.99],
            &[0.49, 1.0, f64::NAN],
        ),
        (
            "egomotion.inlier_px",
            |config, value| config.inlier_px = value as f32,
            ABOVE_0.0,
            ABOVE_0.1,
        ),
        (
            "egomotion.refined_inlier_px",
            |config, value| config.refined_inlier_px = value as f32,
            ABOVE_0.0,
            ABOVE_0.1,
        ),
        (
            "egomotion.matches_min",
            |config, value| config.matches_min = value as u16,
            &[3.0, 1_000.0],
            &[2.0, 1_001.0],
        ),
        (
            "egomotion.inlier_share_min",
            |config, value| config.inlier_share_min = value as f32,
            SHARE.0,
            SHARE.1,
        ),
        (
            "egomotion.inlier_share_strong",
            |config, value| config.inlier_share_strong = value as f32,
            SHARE.0,
            SHARE.1,
        ),
        (
            "egomotion.acceleration_max_m_s2",
            |config, value| config.acceleration_max_m_s2 = value,
            ABOVE_0.0,
            ABOVE_0.1,
        ),
        (
            "egomotion.right_ahead_max_m",
            |config, value| config.right_ahead_max_m = value,
            ABOVE_0.0,
            ABOVE_0.1,
        ),
        (
            "egomotion.sample_steps",
            |config, value| config.sample_steps = value as u8,
            &[1.0, 50.0],
            &[0.0, 51.0],
        ),
        (
            "egomotion.refine_steps",
            |config, value| config.refine_steps = value as u8,
            &[1.0, 250.0],
            &[0.0, 251.0],
        ),
        (
            "egomotion.side_knee",
            |config, value| config.side_knee = value,
            &[1e-9, 10.0],
            &[0.0, -1.0, 10.01, f64::NAN],
        ),
        (
            "egomotion.robust_px",
            |config, value| config.robust_px = value,
            &[1e-9, 100.0],
            &[0.0, -1.0, 100.1, f64::NAN],
        ),
    ];

    #[test]
    fn settings_out_of_range_are_named_and_their_bounds_are_taken() {
        for (key, change, good, bad) in SETTINGS {
            let problems = |value: f64| {
                let (mut problems, mut config) = (Problems::new(), EgomotionConfig::default());
                change(&mut config, value);
                config.validate(&mut problems);
                problems.iter().map(|problem| problem.key).collect::<Vec<_>>()
            };
            good.iter().for_each(|&value| assert!(problems(value).is_empty(), "{key} = {value}"));
            bad.iter().for_each(|&value| assert_eq!(problems(value), [key], "{key} = {value}"));
        }
    }
}
