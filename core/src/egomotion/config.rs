//! Settings of the motion estimate.

use crate::settings::{
    Problems, Range, Rule, Setting,
    Value::{F32, F64, U8, U16},
    check, rules,
};

/// Settings of the motion estimate. One set serves the camera; objects use another copy.
/// [`EgomotionConfig::SETTINGS`] has the ranges, and DynSLAM's values where they differ.
///
/// ```
/// use dynvox_core::{Problems, egomotion::EgomotionConfig};
///
/// let mut problems = Problems::new();
/// EgomotionConfig { inlier_px: -1.0, ..EgomotionConfig::default() }.validate(&mut problems);
/// assert_eq!(problems[0].key, "egomotion.inlier_px");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct EgomotionConfig {
    /// Most hypotheses, drawn from three matches each.
    pub samples: u16,
    /// Probability with which one hypothesis should be free of outliers.
    pub confidence: f64,
    /// Largest reprojection error of an inlier over its four coordinates together, px.
    pub inlier_px: f32,
    /// Largest reprojection error of an inlier in the last rounds of refinement, px.
    pub refined_inlier_px: f32,
    /// Fewest matches, and fewest inliers, of an estimate.
    pub matches_min: u16,
    /// Least share of the matches that must be inliers.
    pub inlier_share_min: f32,
    /// Largest acceleration of a camera, m/s².
    pub acceleration_max_m_s2: f64,
    /// Share of inliers from which on any motion is believed.
    pub inlier_share_strong: f32,
    /// Farthest that the right camera may seem to stand ahead of its calibration, or behind, m.
    pub right_ahead_max_m: f64,
    /// Most Gauss-Newton steps of a hypothesis.
    pub sample_steps: u8,
    /// Most Gauss-Newton steps of a round of refinement.
    pub refine_steps: u8,
    /// Distance from the middle column at which errors of the lenses weigh as much as the noise of
    /// a match, share of the distance to the side.
    pub side_knee: f64,
    /// Error of a match at which it weighs a quarter, px over its four coordinates.
    pub robust_px: f64,
}

impl Default for EgomotionConfig {
    fn default() -> Self {
        Self {
            // libviso2 takes 200 samples; the search ends earlier where `confidence` is reached.
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

type Row = Setting<EgomotionConfig>;

impl EgomotionConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::expert("egomotion.samples", "", |c| U16(&mut c.samples))
            .range(Range::Within(1.0, 10_000.0))
            .published("500, always all of them")
            .text("Most hypotheses, drawn from three matches each."),
        Row::expert("egomotion.confidence", "", |c| F64(&mut c.confidence))
            .range(Range::FromBelow(0.5, 1.0))
            .published("1")
            .text(
                "Probability with which one hypothesis should be free of outliers: drawing stops \
                 once it is reached.",
            ),
        Row::expert("egomotion.inlier_px", "px", |c| F32(&mut c.inlier_px))
            .range(Range::POSITIVE)
            .text("Largest reprojection error of an inlier over its four coordinates together."),
        Row::expert("egomotion.refined_inlier_px", "px", |c| F32(&mut c.refined_inlier_px))
            .range(Range::POSITIVE)
            .text("Largest reprojection error of an inlier in the last rounds of refinement."),
        Row::expert("egomotion.matches_min", "", |c| U16(&mut c.matches_min))
            .range(Range::Within(3.0, 1000.0))
            .text("Fewest matches, and fewest inliers, of an estimate."),
        Row::user("egomotion.inlier_share_min", "", |c| F32(&mut c.inlier_share_min))
            .range(Range::SHARE)
            .published("0")
            .text("Least share of the matches that must be inliers."),
        Row::user("egomotion.acceleration_max_m_s2", "m/s²", |c| F64(&mut c.acceleration_max_m_s2))
            .range(Range::POSITIVE)
            .published("none")
            .text(
                "Largest acceleration of a camera: a motion that needs a larger one is taken only \
                 where the share of inliers is at least `inlier_share_strong`.",
            ),
        Row::expert("egomotion.inlier_share_strong", "", |c| F32(&mut c.inlier_share_strong))
            .range(Range::SHARE)
            .text("Share of inliers from which on any motion is believed."),
        Row::user("egomotion.right_ahead_max_m", "m", |c| F64(&mut c.right_ahead_max_m))
            .range(Range::POSITIVE)
            .published("none")
            .text(
                "Farthest that the right camera may seem to stand ahead of where the calibration \
                 has it, or behind. A larger distance comes of cameras that do not expose at the \
                 same time: a motion is taken only where the share of inliers is at least \
                 `inlier_share_strong`, and none above four times the distance.",
            ),
        Row::expert("egomotion.sample_steps", "", |c| U8(&mut c.sample_steps))
            .range(Range::Within(1.0, 50.0))
            .text("Most Gauss-Newton steps of a hypothesis."),
        Row::expert("egomotion.refine_steps", "", |c| U8(&mut c.refine_steps))
            .range(Range::Within(1.0, 250.0))
            .published("about 250")
            .text("Most Gauss-Newton steps of a round of refinement."),
        Row::expert("egomotion.side_knee", "", |c| F64(&mut c.side_knee))
            .range(Range::AboveTo(0.0, 10.0))
            .published("weights 1 / (s + 0.05), which leave twice the error in scale")
            .text(
                "Distance from the middle column, as a share of it, at which what rectification \
                 left of the lenses' errors weighs as much as the noise of a match. Those errors \
                 grow with the fourth power: a match at share s has weight 1 / (1 + (s / knee)^8). \
                 10 weighs all alike.",
            ),
        Row::expert("egomotion.robust_px", "px", |c| F64(&mut c.robust_px))
            .range(Range::AboveTo(0.0, 100.0))
            .published("all alike")
            .text(
                "Error of a match over its four coordinates at which it weighs a quarter: at error \
                 e it weighs 1 / (1 + (e / robust_px)²)². 100 weighs all alike.",
            ),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);

    /// Notes everything wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    type Case = (&'static str, fn(&mut EgomotionConfig, f64), &'static [f64], &'static [f64]);
    const SHARE: (&[f64], &[f64]) = (&[0.0, 1.0], &[-0.01, 1.01, f64::NAN]);
    const ABOVE_0: (&[f64], &[f64]) = (&[1e-9, 1e9], &[0.0, -1.0, f64::NAN, f64::INFINITY]);
    const CASES: [Case; 13] = [
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
        for (key, change, good, bad) in CASES {
            // One setting is changed, and the others are in range.
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
