//! Distance between the outcomes of two runs, where their digests only say that they differ.

use dynvox_core::geometry::Transform;

/// The outcome of a frame, in numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// `t_world_camera`, where the run folder has it.
    pub pose: Option<Transform>,
    /// Share of pixels with a disparity.
    pub density: f64,
    /// Mean disparity of both runs, px.
    pub disparity_px: Option<f64>,
    /// Blocks in use.
    pub blocks: u32,
}

/// Distances between the outcomes of two runs. All values are 0 or more.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distance {
    /// Between the positions, m.
    pub position_m: f64,
    /// Between the orientations, degrees.
    pub angle_deg: f64,
    /// Between the mean disparities, px.
    pub disparity_px: f64,
    /// Between the shares of pixels with a disparity.
    pub density: f64,
    /// Between the numbers of blocks in use.
    pub blocks: u32,
}

impl Distance {
    /// Between two outcomes.
    pub fn between(a: &Outcome, b: &Outcome) -> Self {
        // Where one has no pose nothing can be compared, and 0 is said.
        let moved = a.pose.zip(b.pose).map(|(a, b)| a.inverse() * b);
        Self {
            position_m: moved.map_or(0.0, |moved| moved.distance_m()),
            angle_deg: moved.map_or(0.0, |moved| moved.angle_rad().to_degrees()),
            disparity_px: a.disparity_px.zip(b.disparity_px).map_or(0.0, |(a, b)| (a - b).abs()),
            density: (a.density - b.density).abs(),
            blocks: a.blocks.abs_diff(b.blocks),
        }
    }

    /// The larger of each value.
    pub fn max(self, other: Self) -> Self {
        Self {
            position_m: self.position_m.max(other.position_m),
            angle_deg: self.angle_deg.max(other.angle_deg),
            disparity_px: self.disparity_px.max(other.disparity_px),
            density: self.density.max(other.density),
            blocks: self.blocks.max(other.blocks),
        }
    }
}

impl std::fmt::Display for Distance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "pose {:.4} m, {:.4} deg; mean disparity {:.3} px, {:.2} % of the pixels have one more \
             or less; blocks in use {}",
            self.position_m,
            self.angle_deg,
            self.disparity_px,
            100.0 * self.density,
            self.blocks
        )
    }
}
