//! Depth of one frame, counted: how much of it a map can show.

use dynvox_core::Config;
use dynvox_core::image::View;
use serde::{Deserialize, Serialize};

/// Pixels of a frame by their depth, and the map that they could give.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DepthCensus {
    /// Pixels of the image.
    pub pixels: u32,
    /// Pixels nearer than the map's nearest depth.
    pub nearer: u32,
    /// Pixels within the map's depths.
    pub mapped: u32,
    /// Pixels beyond the map's farthest depth.
    pub farther: u32,
    /// Triangles of a map of what is within, as of walls that face the camera.
    pub triangles: f64,
    /// Mean disparity of the pixels that have one, px.
    pub disparity_mean_px: Option<f64>,
}

impl DepthCensus {
    /// Counts the disparities of a frame, 1/256 px, 0 none.
    pub fn new(disparity_q8: View<'_, u16>, config: &Config) -> Self {
        let (rig, volume) = (&config.rig, &config.volume);
        // Depth is worked out once for each disparity that there is, not for each pixel.
        let mut counts = vec![0u32; 1 << u16::BITS];
        for &disparity_q8 in disparity_q8.rows().flatten() {
            if let Some(count) = counts.get_mut(usize::from(disparity_q8)) {
                *count += 1;
            }
        }
        let (mut found, mut sum_q8) = (Self::default(), 0u64);
        found.pixels = counts.iter().sum();
        // A pixel at depth z covers a square of side z / f; a voxel's face has two triangles.
        let faces_per_m = 1.0 / (rig.focal_px * f64::from(volume.voxel_size_m));
        let known = counts.into_iter().enumerate().skip(1).filter(|(_, count)| *count > 0);
        for (disparity_q8, count) in known {
            sum_q8 += disparity_q8 as u64 * u64::from(count);
            let depth_m = rig.focal_px * rig.baseline_m * 256.0 / disparity_q8 as f64;
            if depth_m < f64::from(volume.near_m) {
                found.nearer += count;
            } else if depth_m > f64::from(volume.far_m) {
                found.farther += count;
            } else {
                found.mapped += count;
                found.triangles += f64::from(count) * 2.0 * (depth_m * faces_per_m).powi(2);
            }
        }
        let known = found.known();
        found.disparity_mean_px = (known > 0).then(|| sum_q8 as f64 / f64::from(known) / 256.0);
        found
    }

    /// Pixels with a depth.
    pub fn known(&self) -> u32 {
        self.nearer + self.mapped + self.farther
    }
}

/// Depth of all frames together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DepthTotals {
    /// Pixels of all images.
    pub pixels: u64,
    /// Pixels nearer than the map's nearest depth.
    pub nearer: u64,
    /// Pixels within the map's depths.
    pub mapped: u64,
    /// Pixels beyond the map's farthest depth.
    pub farther: u64,
    /// Most triangles that the depth of one frame gives.
    pub triangles_most: f64,
}

impl DepthTotals {
    /// Adds a frame.
    pub fn add(&mut self, frame: &DepthCensus) {
        let DepthCensus { pixels, nearer, mapped, farther, triangles, .. } = *frame;
        self.pixels += u64::from(pixels);
        self.nearer += u64::from(nearer);
        self.mapped += u64::from(mapped);
        self.farther += u64::from(farther);
        self.triangles_most = self.triangles_most.max(triangles);
    }

    /// Pixels with a depth.
    pub fn known(&self) -> u64 {
        self.nearer + self.mapped + self.farther
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynvox_core::geometry::StereoRig;

    #[test]
    fn pixels_are_counted_by_the_depths_that_a_map_shows() {
        let rig =
            StereoRig { focal_px: 100.0, center_u_px: 2.0, center_v_px: 0.5, baseline_m: 1.0 };
        // 0.39 m, 10 m and 50 m, and one pixel without depth.
        let disparity_q8 = [65_535, 2_560, 512, 0];
        let config = Config::for_rig(rig);
        let census = DepthCensus::new(View::new(&disparity_q8, 4, 1).unwrap(), &config);
        assert_eq!((census.pixels, census.known()), (4, 3));
        assert_eq!((census.nearer, census.mapped, census.farther), (1, 1, 1));
        // 10 cm a pixel: four faces of 5 cm.
        assert!((census.triangles - 8.0).abs() < 1e-6, "{}", census.triangles);
        assert_eq!(census.disparity_mean_px, Some((65_535 + 2_560 + 512) as f64 / 3.0 / 256.0));
    }
}
