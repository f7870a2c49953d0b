//! Every parameter of the stereo matcher, with the values of the published presets.

use super::MAX_IMAGE_SIZE;
use crate::settings::{
    Problems, Range, Rule, Setting,
    Value::{Bool, Choice, F32, U8, U16, U32, Usize},
    check, choices, rules,
};

/// Largest disparity the matcher can represent, px.
pub const DISPARITY_LIMIT: u16 = 255;
/// Distance between two support candidates, px, as published: the bound on support points follows
/// from it.
pub const CANDIDATE_STEP: usize = 5;
/// Smallest cell of the grid prior, px: the bound on cells follows from it.
pub const MIN_GRID_SIZE: usize = 10;
/// Most passes of the adaptive mean.
const MAX_MEAN_PASSES: u8 = 4;
/// Widest search around the prior plane, px.
pub const MAX_PLANE_RADIUS: usize = 16;
/// Widest gap, px.
const MAX_GAP: f32 = 4096.0;

/// Filling of a gap whose ends are two surfaces.
///
/// ```
/// use dynvox_core::stereo::{GapEnds, StereoConfig};
///
/// assert_eq!(StereoConfig::robotics().gap_ends, GapEnds::Farther, "as published");
/// assert_eq!(StereoConfig::default().gap_ends, GapEnds::Surface);
/// ```
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

choices! { GapEnds { "surface" = Surface, "farther" = Farther } }

/// Parameters of ELAS. [`StereoConfig::robotics`] is the authors' preset for driving,
/// [`StereoConfig::dynslam`] DynSLAM's, which fills wider gaps; [`Default`] trusts the images more
/// and the planes between support points less (docs/decisions/0049-still-less-trust-in-planes.md),
/// fills gaps only within a surface, wide ones too (docs/decisions/0028-gaps-within-a-surface.md),
/// and asks less of a support match. [`StereoConfig::SETTINGS`] has the ranges.
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
    /// Largest disparity searched, px.
    pub disparity_max: u16,
    /// Largest cost of a support match, as a share of the second best.
    pub support_ratio: f32,
    /// Reach within which a support point between two alike ones is redundant, candidates.
    pub redundant_distance: usize,
    /// Reach from the image's rim within which a support point's surface is continued up to it,
    /// candidates; 0 leaves rims empty.
    pub rim_reach: usize,
    /// Side of a cell of the grid prior, px.
    pub grid_size: usize,
    /// Uniform share of the prior (gamma).
    pub gamma: f32,
    /// Disparities searched to each side of the prior plane, px: sigma is 1 px.
    pub plane_radius_sigmas: f32,
    /// Height from which on images are matched densely on every second row only, px; the rows
    /// between are interpolated. 0: every row of any image.
    pub second_rows_from: usize,
    /// Refinement of disparities to fractions of a pixel before they are smoothed.
    pub subpixel: bool,
    /// Largest difference between the disparities of left and right image, px.
    pub consistency_threshold: u16,
    /// Largest difference of neighbours that belong to one segment, px.
    pub speckle_similarity: u16,
    /// Size below which segments are removed, px.
    pub speckle_size: u32,
    /// Size below which lone segments are removed, share of the image.
    pub lone_share: f32,
    /// Widest gap between a segment and the next of its surface, px.
    pub lone_gap: usize,
    /// Widest gap filled along rows and columns, px.
    pub gap_width: usize,
    /// Filling of a gap between two surfaces.
    pub gap_ends: GapEnds,
    /// Passes of an edge-preserving mean over the result.
    pub adaptive_mean: u8,
    /// A 3 x 3 median at the end.
    pub median: bool,
    /// Least confidence of a disparity that is kept; 0 measures none, 1 keeps all.
    pub min_confidence: u8,
}

impl StereoConfig {
    /// The published preset for driving.
    pub const fn robotics() -> Self {
        Self {
            disparity_max: 255,
            support_ratio: 0.85,
            redundant_distance: 5,
            // Not of libelas, and off.
            rim_reach: 0,
            grid_size: 20,
            gamma: 3.0,
            plane_radius_sigmas: 2.0,
            second_rows_from: 0,
            subpixel: true,
            consistency_threshold: 2,
            speckle_similarity: 1,
            speckle_size: 200,
            // Not of libelas, and off.
            lone_share: 0.0,
            lone_gap: 70,
            gap_width: 3,
            gap_ends: GapEnds::Farther,
            adaptive_mean: 1,
            median: false,
            min_confidence: 0,
        }
    }

    /// DynSLAM's set: as [`StereoConfig::robotics`], but gaps up to 21 px are filled.
    ///
    /// ```
    /// use dynvox_core::stereo::StereoConfig;
    ///
    /// assert!(StereoConfig::dynslam().gap_width > StereoConfig::robotics().gap_width);
    /// ```
    pub const fn dynslam() -> Self {
        Self { gap_width: 21, ..Self::robotics() }
    }

    /// Notes everything that is wrong.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }

    /// Disparities searched to each side of the prior plane, px.
    pub(super) fn plane_radius(&self) -> usize {
        libm::ceilf(self.plane_radius_sigmas) as usize
    }
}

impl Default for StereoConfig {
    fn default() -> Self {
        Self {
            support_ratio: 0.9,
            redundant_distance: 8,
            rim_reach: 4,
            grid_size: 16,
            gamma: 10.0,
            plane_radius_sigmas: 1.0,
            second_rows_from: 200,
            consistency_threshold: 1,
            lone_share: 0.002,
            gap_width: 70,
            gap_ends: GapEnds::Surface,
            adaptive_mean: 2,
            ..Self::robotics()
        }
    }
}

type Row = Setting<StereoConfig>;

impl StereoConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("stereo.disparity_max", "px", |c| U16(&mut c.disparity_max))
            .range(Range::Within(10.0, DISPARITY_LIMIT as f32))
            .text("Largest disparity searched."),
        Row::expert("stereo.support_ratio", "", |c| F32(&mut c.support_ratio))
            .range(Range::AboveTo(0.0, 1.0))
            .published("0.85")
            .text(
                "A support match must cost less than this share of the second best \
                 ([decision 35](decisions/0035-support-matches-below-nine-tenths.md)).",
            ),
        Row::expert("stereo.redundant_distance", "candidates", |c| {
            Usize(&mut c.redundant_distance)
        })
        .range(Range::Within(0.0, 64.0))
        .published("5")
        .text(
            "A support point between two alike ones at most so far away, on a row or a column, \
                 is redundant; 0 keeps all.",
        ),
        Row::expert("stereo.rim_reach", "candidates", |c| Usize(&mut c.rim_reach))
            .range(Range::Within(0.0, 64.0))
            .published("0")
            .text(
                "Surfaces of support points at most so far from the image's rim are continued up \
                 to it; 0 leaves the rims empty \
                 ([decision 106](decisions/0106-confidence-by-density.md)).",
            ),
        Row::expert("stereo.grid_size", "px", |c| Usize(&mut c.grid_size))
            .range(Range::Within(MIN_GRID_SIZE as f32, 256.0))
            .published("20")
            .text("Side of a cell of the grid prior. The default is two vectors."),
        Row::expert("stereo.gamma", "", |c| F32(&mut c.gamma))
            .range(Range::POSITIVE)
            .published("3")
            .text(
                "Uniform share of the prior (gamma): the larger, the less a disparity far from the \
                 plane costs.",
            ),
        Row::expert("stereo.plane_radius_sigmas", "sigmas", |c| F32(&mut c.plane_radius_sigmas))
            .range(Range::Within(0.0, MAX_PLANE_RADIUS as f32))
            .published("2")
            .text("Disparities searched to each side of the prior plane; sigma is 1 px."),
        Row::user("stereo.second_rows_from", "px", |c| Usize(&mut c.second_rows_from))
            .range(Range::Within(0.0, MAX_IMAGE_SIZE as f32))
            .published("0")
            .text(
                "Height from which on images are matched densely on every second row only; the \
                 rows between are interpolated. 0 matches every row of any image \
                 ([decision 100](decisions/0100-every-second-row.md)).",
            ),
        Row::expert("stereo.subpixel", "", |c| Bool(&mut c.subpixel)).published("false").text(
            "Refinement of disparities to fractions of a pixel before they are smoothed. On KITTI \
             2012 it takes the median error from 0.268 to 0.257 px and the share off by more than \
             3 px from 4.8 to 4.5 %; on smooth surfaces it halves the error.",
        ),
        Row::expert("stereo.consistency_threshold", "px", |c| U16(&mut c.consistency_threshold))
            .published("2")
            .text("Largest difference between the disparities of left and right image."),
        Row::expert("stereo.speckle_similarity", "px", |c| U16(&mut c.speckle_similarity))
            .text("Largest difference of neighbours that belong to one segment."),
        Row::user("stereo.speckle_size", "px", |c| U32(&mut c.speckle_size))
            .text("Segments of fewer pixels are removed; 0 or 1 keeps all."),
        Row::expert("stereo.lone_share", "", |c| F32(&mut c.lone_share))
            .range(Range::SHARE)
            .published("0")
            .text(
                "Lone segments smaller than this share of the image are removed as well: no pixel \
                 of another one that is as similar is within `lone_gap` along a row or column; 0 \
                 keeps all ([decision 43](decisions/0043-lone-segments.md)).",
            ),
        Row::expert("stereo.lone_gap", "px", |c| Usize(&mut c.lone_gap))
            .range(Range::Within(0.0, MAX_GAP))
            .text(
                "Widest gap to the next segment of the same surface: a segment with wider ones is \
                 lone. No more than `gap_width` counts.",
            ),
        Row::user("stereo.gap_width", "px", |c| Usize(&mut c.gap_width))
            .range(Range::Within(0.0, MAX_GAP))
            .published("3; DynSLAM: 21")
            .text("Widest gap filled along rows and columns; 0 fills none."),
        Row::expert("stereo.gap_ends", "", |c| Choice(&mut c.gap_ends)).published("farther").text(
            "Filling of a gap between two surfaces, whose ends differ by 3 px or more: \
                 nothing, or the farther one \
                 ([decision 28](decisions/0028-gaps-within-a-surface.md)).",
        ),
        Row::expert("stereo.adaptive_mean", "passes", |c| U8(&mut c.adaptive_mean))
            .range(Range::Within(0.0, MAX_MEAN_PASSES as f32))
            .published("1")
            .text(
                "Passes of an edge-preserving mean over the result; it also yields fractions of a \
                 pixel.",
            ),
        Row::expert("stereo.median", "", |c| Bool(&mut c.median))
            .text("A 3 x 3 median at the end."),
        Row::user("stereo.min_confidence", "", |c| U8(&mut c.min_confidence)).text(
            "Disparities of less confidence are removed. A confidence is one more than the number \
             of measured pixels, neither filled in nor without a disparity, in the 16 x 16 about a \
             pixel, at most 255. 0 measures none, 1 keeps all \
             ([decision 106](decisions/0106-confidence-by-density.md)).",
        ),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);
}
