//! Every parameter of the stereo matcher, with the values of the published presets.

use crate::problem::{Problems, require};

/// Largest disparity the matcher can represent, px.
pub const DISPARITY_LIMIT: u16 = 255;
/// Smallest distance between two support candidates, px: the bound on support points follows from
/// it.
pub const MIN_CANDIDATE_STEP: usize = 5;
/// Widest window to each side of a support point in which alike ones are counted, candidates.
pub(super) const MAX_PLAUSIBLE_WINDOW: usize = 16;
/// Smallest cell of the grid prior, px: the bound on cells follows from it.
pub const MIN_GRID_SIZE: usize = 10;
/// Most passes of the adaptive mean.
const MEAN_PASSES_MAX: u8 = 4;
/// Widest search around the prior plane, px.
pub const MAX_PLANE_RADIUS: usize = 16;

/// What fills a gap whose ends are two surfaces: they differ by [`StereoConfig::gap_discontinuity`]
/// or more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
pub enum GapEnds {
    /// Nothing: only gaps within a surface are filled.
    #[default]
    Surface,
    /// The farther one, as published: what is hidden from one camera is background.
    Farther,
}

/// Parameters of ELAS. [`StereoConfig::robotics`] is the authors' preset for driving,
/// [`StereoConfig::dynslam`] DynSLAM's, which fills wider gaps; [`Default`] trusts the images more
/// and the planes between support points less (docs/decisions/0049-still-less-trust-in-planes.md),
/// fills gaps only within a surface, wide ones too (docs/decisions/0028-gaps-within-a-surface.md),
/// and asks less of a support match.
///
/// ```
/// use dynvox_core::stereo::StereoConfig;
///
/// let mut problems = dynvox_core::Problems::new();
/// StereoConfig::default().validate(&mut problems);
/// assert!(problems.is_empty());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct StereoConfig {
    /// Largest disparity searched, px, 10..=255. Published: 255.
    pub disparity_max: u16,
    /// A support match must cost less than this share of the second best, above 0, at most 1. 0.9
    /// (docs/decisions/0035-support-matches-below-nine-tenths.md); published: 0.85.
    pub support_ratio: f32,
    /// Least texture of a support point's descriptor: sum of gradient magnitudes over its 16
    /// samples. Published: 10.
    pub support_texture: u16,
    /// Distance between support candidates, px, 5..=64. Published: 5.
    pub candidate_step: usize,
    /// Half the window in which a support point needs company, candidates, 1..=16. Published: 5.
    pub plausible_window: usize,
    /// Company is what differs by at most this, px. Published: 5.
    pub plausible_threshold: u16,
    /// Least number of support points in the window, itself included. Published: 5.
    pub plausible_min: u16,
    /// A support point between two alike ones at most so many candidates away, on a row or a
    /// column, is redundant; 0 keeps all. 8; published: 5.
    pub redundant_distance: usize,
    /// Alike is what differs by at most this, px. Published: 1.
    pub redundant_threshold: u16,
    /// Side of a cell of the grid prior, px, 10..=256. 16, two vectors; published: 20.
    pub grid_size: usize,
    /// Weight of the descriptor distance against the prior (beta), above 0. Published: 0.02.
    pub beta: f32,
    /// Uniform share of the prior (gamma), above 0: the larger, the less a disparity far from the
    /// plane costs. 10; published: 3.
    pub gamma: f32,
    /// Standard deviation of disparities about the prior plane (sigma), px, above 0. Published: 1.
    pub sigma: f32,
    /// Disparities searched to each side of the prior plane, in sigmas, 0..=16. 1; published: 2.
    pub plane_radius_sigmas: f32,
    /// A triangle steeper than this bridges two surfaces: its plane is searched but not preferred.
    /// Disparity per px, 0..=1000. Own choice: 0.7; without a limit 4.8 instead of 4.5 % are off on
    /// KITTI 2012.
    pub plane_slope_max: f32,
    /// Least texture of a descriptor that is matched densely. Published: 1.
    pub match_texture: u16,
    /// Whether disparities are refined to fractions of a pixel before they are smoothed. Published:
    /// no. On KITTI 2012 it takes the median error from 0.268 to 0.257 px and the share off by more
    /// than 3 px from 4.8 to 4.5 %; on smooth surfaces it halves the error.
    pub subpixel: bool,
    /// Largest difference between the disparities of left and right image, px. 1; published: 2.
    pub consistency_threshold: u16,
    /// Neighbours that differ by at most this belong to one segment, px. Published: 1.
    pub speckle_similarity: u16,
    /// Segments smaller than this are removed, px; 0 or 1 keeps all. Published: 200.
    pub speckle_size: u32,
    /// Lone segments smaller than this share of the image are removed as well: no pixel of another
    /// one that is as similar is within `lone_gap` px along a row or column. 0..=1; 0 keeps all.
    /// 0.002 (docs/decisions/0043-lone-segments.md); published: 0.
    pub lone_share: f32,
    /// Widest gap to the next segment of the same surface, px: a segment with wider ones is lone.
    /// No more than `gap_width` counts. 70.
    pub lone_gap: usize,
    /// Widest gap filled along rows and columns, px; 0 fills none. 70; published: 3; DynSLAM: 21.
    pub gap_width: usize,
    /// Ends of a gap that differ by less than this are one surface, px. Published: 3.
    pub gap_discontinuity: u16,
    /// What fills a gap between two surfaces. Nothing; published: the farther one.
    pub gap_ends: GapEnds,
    /// How often an edge-preserving mean smooths the result, 0..=4. It also yields fractions of a
    /// pixel. 2 (docs/decisions/0043-lone-segments.md); published: 1.
    pub adaptive_mean: u8,
    /// Whether a 3 x 3 median follows. Published: no.
    pub median: bool,
}

impl StereoConfig {
    /// The published preset for driving.
    pub const fn robotics() -> Self {
        Self {
            disparity_max: 255,
            support_ratio: 0.85,
            support_texture: 10,
            candidate_step: 5,
            plausible_window: 5,
            plausible_threshold: 5,
            plausible_min: 5,
            redundant_distance: 5,
            redundant_threshold: 1,
            grid_size: 20,
            beta: 0.02,
            gamma: 3.0,
            sigma: 1.0,
            plane_radius_sigmas: 2.0,
            plane_slope_max: 0.7,
            match_texture: 1,
            subpixel: true,
            consistency_threshold: 2,
            speckle_similarity: 1,
            speckle_size: 200,
            lone_share: 0.0,
            lone_gap: 70,
            gap_width: 3,
            gap_discontinuity: 3,
            gap_ends: GapEnds::Farther,
            adaptive_mean: 1,
            median: false,
        }
    }

    /// DynSLAM's set: as [`StereoConfig::robotics`], but gaps up to 21 px are filled.
    pub const fn dynslam() -> Self {
        Self { gap_width: 21, ..Self::robotics() }
    }

    /// Notes everything that is wrong.
    pub fn validate(&self, problems: &mut Problems) {
        let mut check = |satisfied, key, rule| require(problems, satisfied, key, rule);
        let positive = |value: f32| value.is_finite() && value > 0.0;
        check(
            (10..=DISPARITY_LIMIT).contains(&self.disparity_max),
            "stereo.disparity_max",
            "must be within 10..=255 px",
        );
        check(
            positive(self.support_ratio) && self.support_ratio <= 1.0,
            "stereo.support_ratio",
            "must be above 0 and at most 1",
        );
        check(
            (MIN_CANDIDATE_STEP..=64).contains(&self.candidate_step),
            "stereo.candidate_step",
            "must be within 5..=64 px",
        );
        check(
            (1..=MAX_PLAUSIBLE_WINDOW).contains(&self.plausible_window),
            "stereo.plausible_window",
            "must be within 1..=16 candidates",
        );
        check(
            self.redundant_distance <= 64,
            "stereo.redundant_distance",
            "must be at most 64 candidates",
        );
        check(
            (MIN_GRID_SIZE..=256).contains(&self.grid_size),
            "stereo.grid_size",
            "must be within 10..=256 px",
        );
        check(positive(self.beta), "stereo.beta", "must be above 0");
        check(positive(self.gamma), "stereo.gamma", "must be above 0");
        check(positive(self.sigma), "stereo.sigma", "must be above 0 px");
        let radius = self.sigma * self.plane_radius_sigmas;
        check(
            (0.0..=MAX_PLANE_RADIUS as f32).contains(&radius),
            "stereo.plane_radius_sigmas",
            "times sigma must be within 0..=16 px",
        );
        check(
            (0.0..=1e3).contains(&self.plane_slope_max),
            "stereo.plane_slope_max",
            "must be within 0..=1000",
        );
        check((0.0..=1.0).contains(&self.lone_share), "stereo.lone_share", "must be within 0..=1");
        check(self.lone_gap <= 4_096, "stereo.lone_gap", "must be at most 4096 px");
        check(self.gap_width <= 4_096, "stereo.gap_width", "must be at most 4096 px");
        check(self.adaptive_mean <= MEAN_PASSES_MAX, "stereo.adaptive_mean", "must be at most 4");
    }

    /// Disparities searched to each side of the prior plane, px.
    pub(super) fn plane_radius(&self) -> usize {
        libm::ceilf(self.sigma * self.plane_radius_sigmas) as usize
    }
}

impl Default for StereoConfig {
    fn default() -> Self {
        Self {
            support_ratio: 0.9,
            redundant_distance: 8,
            grid_size: 16,
            gamma: 10.0,
            plane_radius_sigmas: 1.0,
            consistency_threshold: 1,
            lone_share: 0.002,
            gap_width: 70,
            gap_ends: GapEnds::Surface,
            adaptive_mean: 2,
            ..Self::robotics()
        }
    }
}
