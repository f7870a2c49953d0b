//! Far matches, tested together with their neighbours.
//!
//! What keeps its distance to the camera moves by less, in the image, than one match errs by. The
//! mean residual of n neighbours errs by less: with the neighbours' own variance V, the camera's
//! part Q of the covariance, which all of them share, and half of them independent,
//! `r' (2 V / n + Q + F)^-1 r` is compared with the same bound as that of one match. F is what no
//! number of matches averages out: whole patterns are matched with a common error.
//!
//! Time: a comparison for each pair of at most [`MAX_JOINT`] matches.

use super::residual::CANDIDATE_CHI_SQUARE;
use super::residual::{Residual, StaticModel};
use crate::{geometry::GroundPlane, scene_flow::Match};
use bytemuck::{Pod, Zeroable};
use nalgebra::{Cholesky, Matrix3, Vector3};

/// Most far matches of a frame.
pub(super) const MAX_JOINT: usize = 1024;
/// Depth from which on matches are tested together, m.
pub(super) const FROM_M: f64 = 10.0;
/// Distance in the image at which two matches are neighbours, m, and at least, px.
const REACH_M: f64 = 0.9;
const REACH_MIN_PX: f64 = 10.0;
/// Largest difference of disparities in a joint group, px and as a share.
const DISPARITY_MIN_PX: f64 = 0.6;
const DISPARITY_SHARE: f64 = 0.04;
/// Residuals of neighbours differ by less, px.
const RESIDUAL_PX: [f64; 3] = [1.2, 1.2, 1.2];
/// Fewest neighbours, the match among them.
const NEIGHBOURS_MIN: u32 = 6;
/// Standard deviation of what neighbours err by in common, px.
const COMMON_PX: f64 = 0.06;
/// Least standard deviation of one of them, px.
const NOISE_MIN_PX: f64 = 0.1;
/// Heights above the ground that are tested, m.
const ABOVE_MIN_M: f64 = 0.25;
const ABOVE_MAX_M: f64 = 3.5;

/// A far match. The position in the image is of the current left frame.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct FarMatch {
    at: [f32; 3],
    residual_px: [f32; 3],
    motion_m: [f32; 3],
    depth_m: f32,
    /// Position among the matches.
    index: u32,
    /// 1 if the point is a candidate by itself, else 0.
    candidate: u32,
}

/// Far matches of a frame.
pub(super) struct FarMatches<'m> {
    slots: &'m mut [FarMatch],
    len: usize,
    ground: Option<&'m GroundPlane>,
}

/// Sums over a match's neighbours.
#[derive(Default)]
struct Sums {
    count: u32,
    residual: Vector3<f64>,
    squares: Vector3<f64>,
    motion: Vector3<f64>,
}

impl<'m> FarMatches<'m> {
    pub fn new(slots: &'m mut [FarMatch], ground: Option<&'m GroundPlane>) -> Self {
        Self { slots, len: 0, ground }
    }

    /// Adds a match that is far, and not the ground's; beyond the bound none is added.
    pub fn add(&mut self, m: &Match, index: usize, residual: &Residual, candidate: bool) {
        let depth_m = residual.point_m.z;
        // Without a known ground nothing can be told from it, and all counts.
        let above_m = self.ground.map(|ground| ground.above_m(residual.point_m.into()));
        let is_tested = depth_m > FROM_M
            && above_m.is_none_or(|above_m| above_m > ABOVE_MIN_M && above_m < ABOVE_MAX_M);
        if let Some(slot) = self.slots.get_mut(self.len).filter(|_| is_tested) {
            let numbers = |v: &Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
            *slot = FarMatch {
                at: [m.current_left[0], m.current_left[1], m.current_disparity_px()],
                residual_px: numbers(&residual.residual_px),
                motion_m: numbers(&residual.motion_m),
                depth_m: depth_m as f32,
                index: index as u32,
                candidate: u32::from(candidate),
            };
            self.len += 1;
        }
    }

    /// Returns the number of frames.
    pub fn len(&self) -> usize {
        self.len
    }

    /// The position among the matches of the far match at `at`, and its residual as its neighbours
    /// together have it, if it is a candidate only by these.
    pub fn candidate(
        &self,
        model: &StaticModel<'_>,
        matches: &[Match],
        at: usize,
    ) -> Option<(usize, Residual)> {
        let own = self.slots.get(at).filter(|own| own.candidate == 0)?;
        let m = matches.get(own.index as usize)?;
        // A reach in the world, in pixels at the match's depth; far away a floor in pixels.
        let reach_px = REACH_M * model.rig.focal_px / f64::from(own.depth_m);
        let reach_px = (if reach_px > REACH_MIN_PX { reach_px } else { REACH_MIN_PX }) as f32;
        let mut sums = Sums::default();
        self.slots
            .iter()
            .take(self.len)
            .filter(|other| own.is_neighbour(other, reach_px))
            .for_each(|other| sums.add(other));
        // A mean of too few says no more than the single match.
        if sums.count < NEIGHBOURS_MIN {
            return None;
        }
        let count = f64::from(sums.count);
        // The spread of the neighbours is their noise, with a floor; what they have in common, such
        // as the camera's motion, does not average out.
        let mean = sums.residual / count;
        let variance = (sums.squares / count - mean.component_mul(&mean)).map(|square| {
            let least = NOISE_MIN_PX * NOISE_MIN_PX;
            (if square > least { square } else { least }) * 2.0 / count + COMMON_PX * COMMON_PX
        });
        let (residual, shared) = model.residual_and_shared(m)?;
        let covariance = Matrix3::from_diagonal(&variance) + shared;
        // The chi-square test of a single match, with the mean and its covariance.
        let chi_square = mean.dot(&Cholesky::new(covariance).map(|factor| factor.solve(&mean))?);
        let depth_sigma_m =
            libm::sqrt(covariance.m33) * f64::from(own.depth_m) / f64::from(own.at[2]);
        let joint = Residual {
            chi_square,
            residual_px: mean,
            motion_m: sums.motion / count,
            depth_sigma_m,
            ..residual
        };
        (chi_square > f64::from(CANDIDATE_CHI_SQUARE)).then_some((own.index as usize, joint))
    }
}

impl FarMatch {
    fn is_neighbour(&self, other: &Self, reach_px: f32) -> bool {
        let [[u, v, d], [u2, v2, d2]] = [self.at, other.at];
        let apart = |a: f32, b: f32| libm::fabsf(a - b);
        if apart(u, u2) > reach_px || apart(v, v2) > reach_px {
            return false;
        }
        let share_px = DISPARITY_SHARE * f64::from(d);
        let disparity_px = if share_px > DISPARITY_MIN_PX { share_px } else { DISPARITY_MIN_PX };
        // Neighbours of one object are off in the same direction, by about as much.
        let residuals = self.residual_px.iter().zip(other.residual_px).zip(RESIDUAL_PX);
        f64::from(apart(d, d2)) < disparity_px
            && residuals
                .into_iter()
                .all(|((own, other), most)| f64::from(apart(*own, other)) < most)
    }
}

impl Sums {
    fn add(&mut self, other: &FarMatch) {
        let residual = Vector3::from(other.residual_px.map(f64::from));
        self.count += 1;
        self.residual += residual;
        self.squares += residual.component_mul(&residual);
        self.motion += Vector3::from(other.motion_m.map(f64::from));
    }
}
