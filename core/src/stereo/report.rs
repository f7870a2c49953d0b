//! Counts of one stereo frame.

/// Result of a frame's stereo matching.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StereoStatus {
    /// Disparities were computed; how many the counts say.
    #[default]
    Matched,
    /// Nothing was matched: the disparities came from elsewhere.
    Given,
    /// The support points make no triangle (a black image, fog, a covered lens): no disparity.
    TooFewSupportPoints,
    /// Left and right image differ in size: no disparity.
    SizesDiffer,
    /// The images are larger than the capacity, or than [`super::MAX_IMAGE_SIZE`]: no disparity.
    TooLarge,
    /// The images are smaller than [`super::MIN_IMAGE_SIZE`]: no disparity.
    TooSmall,
    /// The configuration does not pass `validate`: no disparity.
    ConfigRefused,
}

/// Counts of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct StereoReport {
    /// Result of the frame.
    pub status: StereoStatus,
    /// Candidates on the grid.
    pub candidates: u32,
    /// Candidates matched, before filtering.
    pub support_matches: u32,
    /// Support points removed because too few neighbours agree.
    pub implausible: u32,
    /// Support points removed as redundant.
    pub redundant: u32,
    /// Support points added on the image's rim, before filtering.
    pub rim_points: u32,
    /// Support points left.
    pub support_points: u32,
    /// Support points dropped in the right image because another lies at the same pixel.
    pub occluded_right: u32,
    /// Triangles in the left image.
    pub triangles_left: u32,
    /// Triangles in the right image.
    pub triangles_right: u32,
    /// Pixels matched densely in the left image: of every second row only in images of many rows,
    /// like all counts of pixels up to `filled`.
    pub matched: u32,
    /// Matched pixels that the right image contradicts.
    pub inconsistent: u32,
    /// Matched pixels in segments that are too small.
    pub speckles: u32,
    /// Pixels filled between others.
    pub filled: u32,
    /// Pixels removed because their confidence is too low.
    pub doubtful: u32,
    /// Given disparities that no pair of this width can have, taken as none.
    pub refused: u32,
    /// Pixels with a disparity in the end.
    pub valid: u32,
    /// Pixels of the image.
    pub pixels: u32,
    /// Pixels of the rows that are matched densely; 0 if disparities are given.
    pub row_pixels: u32,
}

impl StereoReport {
    /// Share of pixels with a disparity.
    ///
    /// ```
    /// use dynvox_core::stereo::StereoReport;
    ///
    /// let mut report = StereoReport::default();
    /// (report.valid, report.pixels) = (30, 120);
    /// assert_eq!(report.density(), 0.25);
    /// ```
    pub fn density(&self) -> f32 {
        if self.pixels == 0 { 0.0 } else { self.valid as f32 / self.pixels as f32 }
    }

    /// Returns true if a budget of work left no row to look for support points or to match.
    ///
    /// ```
    /// use dynvox_core::stereo::{StereoReport, StereoStatus};
    ///
    /// let mut report = StereoReport::default();
    /// (report.status, report.pixels, report.candidates) = (StereoStatus::Matched, 1_000, 100);
    /// assert!(report.is_left_out());
    /// ```
    pub fn is_left_out(&self) -> bool {
        let is_looked_for =
            matches!(self.status, StereoStatus::Matched | StereoStatus::TooFewSupportPoints);
        is_looked_for && self.pixels > 0 && (self.row_pixels == 0 || self.candidates == 0)
    }
}

/// A step of the matcher, as a name for measurements.
///
/// ```
/// use dynvox_core::stereo::StereoStep;
///
/// let names = StereoStep::ALL.map(StereoStep::name);
/// assert_eq!((names[0], names[4]), ("gradients", "dense_matching"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StereoStep {
    /// Sobel responses of both images.
    Gradients,
    /// Support points matched over the full disparity range.
    Support,
    /// Implausible and redundant support points removed.
    FilterSupport,
    /// Both triangulations and grid priors.
    Triangulation,
    /// Planes drawn, both images matched densely and compared.
    DenseMatching,
    /// Small segments removed.
    Speckles,
    /// Gaps filled.
    Gaps,
    /// Adaptive mean and median.
    Smoothing,
    /// Conversion to the result's unit.
    Output,
}

impl StereoStep {
    /// All steps, in order.
    pub const ALL: [Self; 9] = [
        Self::Gradients,
        Self::Support,
        Self::FilterSupport,
        Self::Triangulation,
        Self::DenseMatching,
        Self::Speckles,
        Self::Gaps,
        Self::Smoothing,
        Self::Output,
    ];

    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gradients => "gradients",
            Self::Support => "support",
            Self::FilterSupport => "filter_support",
            Self::Triangulation => "triangulation",
            Self::DenseMatching => "dense_matching",
            Self::Speckles => "speckles",
            Self::Gaps => "gaps",
            Self::Smoothing => "smoothing",
            Self::Output => "output",
        }
    }
}
