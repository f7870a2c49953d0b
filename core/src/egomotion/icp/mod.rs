//! The camera's motion from depth alone, against what the map shows from where the camera was: the
//! tracker that voxel-hash mappers for hand-held depth cameras come with, kept here as the baseline
//! they are.
//!
//! Projective data association and point-to-plane distance (Newcombe et al., *KinectFusion*, ISMAR
//! 2011, Section 3.5), coarse to fine, as in InfiniTAM (Kähler et al., *Very High Frame Rate
//! Volumetric Integration of Depth Images on Mobile Devices*, TVCG 2015; Prisacariu et al.,
//! *InfiniTAM v3*, 2017): a measured point is carried by the motion so far into the picture of the
//! map, paired with the surface at the pixel it falls on, and the motion is in_previous to bring
//! points onto their partners' planes. Every frame begins from standing still.
//!
//! On a street this is expected to fail: at 1 m a frame partners are wrong from the start, and a
//! road between façades holds nothing along itself, so that standing still fits well. Such a motion
//! must not pass for an estimate. KinectFusion's own tests are made (enough pairs, every direction
//! held, a small motion); and since those do not see a slide along the street, the images' matches,
//! which the tracker does not use, are asked whether they agree ([`IcpStatus::Contradicted`]).
//!
//! **Memory.** None of its own: the pyramid takes a third of a depth image that is lent. **Time.**
//! Pixels / 4 x steps, on one thread; with a picture of every second pixel a quarter of it.
//!
//! **What can go wrong.** [`IcpStatus`] says it; a failed motion is not handed out. Sums run row by
//! row.

mod config;
mod pyramid;
#[cfg(test)]
mod tests;

pub use config::{IcpConfig, MAX_LEVELS};

use super::normal_equations::NormalEquations;
use crate::{
    geometry::{StereoRig, Transform},
    image::View,
};
use nalgebra::Vector3;
use pyramid::Pyramid;

/// Fewest pairs a motion is sought with.
const PAIRS_MIN: u32 = 100;
/// Least share of the pairs in the least constrained direction: a flat wall constrains one only.
const MIN_EIGEN_SHARE: f32 = 0.0005;
/// Largest rotation between two frames, rad.
const STEP_MAX_RAD: f32 = 0.35;
/// Least share of the matches of the images, which the tracker does not use, that its motion must
/// explain.
const EXPLAINED_MIN: f32 = 0.5;
/// Distance within which a match counts as explained, px over its four coordinates.
pub(crate) const EXPLAINED_PX: f32 = 5.0;
/// Step below which a level is done, rad and m: a tenth of a voxel at most.
const STEP_MIN: f64 = 1e-4;
/// Noise of a point in addition to that of its disparity, m.
const NOISE_M: f64 = 0.02;
/// Units of a normal's components.
const NORMAL_ONE: f64 = 127.0;

/// Outcome of tracking.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum IcpStatus {
    /// There is a motion, and nothing speaks against it.
    #[default]
    Tracked,
    /// The map shows too little, or the frame has too little depth.
    TooFewPairs,
    /// Pairs leave a direction free.
    Degenerate,
    /// Most points in view of the map lie off it.
    OffTheMap,
    /// The motion is larger than it may be.
    TooFar,
    /// The matches of the images say otherwise.
    Contradicted,
}

impl IcpStatus {
    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tracked => "tracked",
            Self::TooFewPairs => "too few pairs",
            Self::Degenerate => "degenerate direction",
            Self::OffTheMap => "off the map",
            Self::TooFar => "too far",
            Self::Contradicted => "contradicted by the images",
        }
    }
}

/// Result of tracking a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct IcpReport {
    /// Outcome.
    pub status: IcpStatus,
    /// Maps previous camera coordinates to current ones; what was found, even where the status says
    /// that it is no motion to follow.
    pub t_current_previous: Transform,
    /// Points of the finest level that fall on a surface of the map.
    pub points: u32,
    /// Points among them within the distance of that surface.
    pub pairs: u32,
    /// Root mean square distance of the pairs from their planes, m.
    pub residual_rms_m: f64,
    /// Share of the pairs that constrain the least constrained direction.
    pub eigen_share: f64,
    /// Steps, over all levels.
    pub steps: u32,
    /// Matches of the images that agree, and how many were asked.
    pub matches: [u32; 2],
}

impl IcpReport {
    /// Report of a frame without a pair.
    pub(crate) fn unpaired() -> Self {
        Self { status: IcpStatus::TooFewPairs, ..Self::default() }
    }

    /// Contradicts the motion where too few of the matches counted in `matches` agree with it.
    /// Without matches it stands.
    pub(crate) fn check_matches(&mut self) {
        let [agreeing, all] = self.matches.map(f64::from);
        if self.status == IcpStatus::Tracked && agreeing < f64::from(EXPLAINED_MIN) * all {
            self.status = IcpStatus::Contradicted;
        }
    }

    /// The motion, where there is one to follow.
    pub(crate) fn motion(&self) -> Option<Transform> {
        (self.status == IcpStatus::Tracked).then_some(self.t_current_previous)
    }
}

/// Picture of the map from where the camera was.
#[derive(Clone, Copy, Debug)]
pub struct MapPicture<'a> {
    /// Depth, m, 0 none.
    pub depth_m: View<'a, f32>,
    /// Normals in that camera's axes, in 1/127.
    pub normal: View<'a, [i8; 3]>,
    /// Interval of the picture's pixels in the image of the disparity, px, at least 1. Levels of
    /// the pyramid that are less than half as coarse as the picture are left out.
    pub every: usize,
}

/// Depth that a rig measured.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredDepth<'a> {
    /// Rig of the disparity image.
    pub rig: &'a StereoRig,
    /// Smallest and largest depth used, m.
    pub limits_m: [f32; 2],
    /// Disparity, 1/256 px, 0 none.
    pub disparity_q8: View<'a, u16>,
}

/// Tracks one frame: `measured` now, `map` as seen from where the camera was. `memory` is
/// overwritten; it needs a third of the image's pixels. The matches are not checked here.
pub fn track(
    config: &IcpConfig,
    measured: &MeasuredDepth<'_>,
    map: &MapPicture<'_>,
    memory: &mut [f32],
) -> IcpReport {
    let &MeasuredDepth { rig, limits_m, disparity_q8 } = measured;
    // Coarse levels reach far, fine ones are precise.
    let pyramid = Pyramid::build(rig, limits_m, disparity_q8, config.levels, memory);
    let mut t_previous_current = Transform::IDENTITY;
    let mut report = IcpReport::unpaired();
    let finest = pyramid.finest_for(map.every);
    for (level, disparity_px) in pyramid.coarse_to_fine().filter(|(level, _)| *level >= finest) {
        let pairing = Pairing::new(config, rig, level);
        for _ in 0..config.steps {
            report.steps += 1;
            let sums = pairing.sums(&t_previous_current, disparity_px, map);
            // Too few pairs, or a direction that none determines: keep the motion so far.
            let Some(step) = sums.equations.solve().filter(|_| sums.pairs >= PAIRS_MIN) else {
                break;
            };
            t_previous_current = t_previous_current.retract(step);
            if step.iter().all(|part| part.abs() < STEP_MIN) {
                break;
            }
        }
        // Only the finest level says how well the motion fits.
        if level == finest {
            let sums = pairing.sums(&t_previous_current, disparity_px, map);
            (report.points, report.pairs) = (sums.points, sums.pairs);
            report.residual_rms_m = libm::sqrt(sums.squared_m2 / f64::from(sums.pairs.max(1)));
            report.eigen_share = sums.equations.min_eigen_share();
            report.t_current_previous = t_previous_current.inverse();
            report.status = classify(config, &report);
        }
    }
    report
}

/// Checks a motion by KinectFusion's tests.
fn classify(config: &IcpConfig, report: &IcpReport) -> IcpStatus {
    let motion = &report.t_current_previous;
    // Twice the vector of the quaternion is the angle for the small turns that pass here.
    let (way_m, turn_rad) = (motion.distance_m(), 2.0 * motion.quaternion().coords.xyz().norm());
    if report.pairs < PAIRS_MIN {
        IcpStatus::TooFewPairs
    } else if report.eigen_share < f64::from(MIN_EIGEN_SHARE) {
        IcpStatus::Degenerate
    } else if f64::from(report.pairs) < f64::from(config.pairs_min) * f64::from(report.points) {
        IcpStatus::OffTheMap
    } else if !(way_m <= f64::from(config.step_max_m) && turn_rad <= f64::from(STEP_MAX_RAD)) {
        IcpStatus::TooFar
    } else {
        IcpStatus::Tracked
    }
}

/// Pairing of the points of one level.
struct Pairing<'c> {
    rig: &'c StereoRig,
    /// Px of the image between two points.
    stride_px: f64,
    /// Factor on the distance.
    widening: f64,
    distance_m: f64,
    /// Noise of a depth: its square times this, m.
    noise_per_m: f64,
}

/// Sums over the pairs of a level.
struct PairSums {
    equations: NormalEquations,
    points: u32,
    pairs: u32,
    squared_m2: f64,
}

impl<'c> Pairing<'c> {
    fn new(config: &IcpConfig, rig: &'c StereoRig, level: usize) -> Self {
        let stride_px = Pyramid::stride_px(level);
        Self {
            rig,
            stride_px,
            widening: 0.5 * stride_px,
            distance_m: f64::from(config.distance_m),
            noise_per_m: f64::from(config.noise_px) / rig.focal_baseline_px_m(),
        }
    }

    /// Sums of the point-to-plane error's normal equations, row by row.
    fn sums(
        &self,
        t_previous_current: &Transform,
        disparity_px: View<'_, f32>,
        map: &MapPicture<'_>,
    ) -> PairSums {
        let rig = self.rig;
        let mut sums =
            PairSums { equations: NormalEquations::ZERO, points: 0, pairs: 0, squared_m2: 0.0 };
        let middle = |at: usize| (at as f64 + 0.5) * self.stride_px - 0.5;
        for (v, row) in disparity_px.rows().enumerate() {
            for (u, &disparity) in row.iter().enumerate().filter(|(_, disparity)| **disparity > 0.0)
            {
                // Each pixel is moved into the previous camera, where the map was drawn.
                let depth = rig.focal_baseline_px_m() / f64::from(disparity);
                let point = rig.ray(middle(u), middle(v)).map(|part| part * depth);
                let in_previous = Vector3::from(t_previous_current.transform_point(point));
                let Some((surface, normal)) = self.associate(&in_previous, map) else { continue };
                sums.points += 1;
                // A point far from the surface is another surface: noise widens the reach with
                // depth.
                let away = in_previous - surface;
                let noise_m = self.noise_per_m * depth * depth;
                let reach_m = (self.distance_m + 3.0 * noise_m) * self.widening;
                if away.dot(&away) > reach_m * reach_m {
                    continue;
                }
                // Point to plane: motion along the surface is free.
                let distance_m = normal.dot(&away);
                let turn = in_previous.cross(&normal);
                let weight = 1.0 / (NOISE_M * NOISE_M + noise_m * noise_m);
                sums.pairs += 1;
                sums.squared_m2 += distance_m * distance_m;
                sums.equations.add_row(
                    [turn.x, turn.y, turn.z, normal.x, normal.y, normal.z],
                    distance_m,
                    weight,
                );
            }
        }
        sums
    }

    /// The map's surface at the pixel a point falls on, and its normal.
    fn associate(
        &self,
        point: &Vector3<f64>,
        map: &MapPicture<'_>,
    ) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let rig = self.rig;
        let seen = rig.project((*point).into())?;
        let every = map.every as f64;
        let (u, v) =
            ((seen.u_left_px + rig.center_u_px) / every, (seen.v_px + rig.center_v_px) / every);
        // Rounded down half a pixel further on: the nearest pixel. Casts hold at the ends, and a
        // negative one is none.
        if !(u >= -0.5 && v >= -0.5) {
            return None;
        }
        let (u, v) = ((u + 0.5) as usize, (v + 0.5) as usize);
        let depth = f64::from(map.depth_m.get(u, v).filter(|depth| *depth > 0.0)?);
        let normal = map.normal.get(u, v)?.map(|part| f64::from(part) / NORMAL_ONE);
        let ray = rig.ray(u as f64 * every, v as f64 * every);
        Some((Vector3::from(ray) * depth, Vector3::from(normal)))
    }
}
