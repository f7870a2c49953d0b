//! Blocks that a run saw to be free of any surface.
//!
//! A map has blocks about surfaces alone, so where a parked car has left, the map of the day after
//! has nothing that could say so. A view of the map from the poses of its camera has: a block
//! wholly in the picture, all of whose pixels show a surface behind it, was free. Such blocks are
//! added to the run's blocks with the truncation as distance and the number of these views as
//! weight.
//!
//! Views are taken wherever the camera has moved by [`APART_M`], a pixel in [`PIXELS`] on each
//! axis, within [`FAR_M`].
//!
//! **Memory.** 1 KiB a block of the map, and 8 bytes a free block.

use super::distance_field::DistanceField;
use dynvox_core::geometry::{MapSegment, StereoRig, Transform};
use dynvox_core::volume::{BLOCK_SIDE, BlockCoord};
use std::collections::BTreeMap;

/// Way of the camera between two views, m.
const APART_M: f64 = 0.5;
/// Pixels of the camera between two rays.
const PIXELS: usize = 4;
/// Farthest free space that is noted, m.
const FAR_M: f64 = 12.0;
/// Nearest, m.
const NEAR_M: f64 = 1.0;
/// Farthest surface that shows that space before it is free, m.
const HIT_MAX_M: f64 = 20.0;
/// Views that must agree.
const VIEWS_MIN: u8 = 3;

/// A camera that looks at a map.
pub struct Camera {
    /// The rig.
    pub rig: StereoRig,
    /// Image width and height, px.
    pub size: (usize, usize),
    /// Poses of the camera in the frames.
    pub poses: Vec<CameraPose>,
}

/// Pose of the camera in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Time of the frame, s, where it is known.
    pub time_s: Option<f64>,
    /// Segment of the map that the pose lies in.
    pub segment: MapSegment,
    /// The camera in the segment, as far as it is the first: files show others apart.
    pub t_map_camera: Transform,
}

/// Depths of a view, m, 0 where it shows no surface.
struct Depths {
    width: usize,
    height: usize,
    depth_m: Vec<f64>,
}

/// The blocks that are free, with the number of views that show it.
pub fn free_blocks(field: &DistanceField, camera: &Camera) -> BTreeMap<BlockCoord, u8> {
    let mut views: BTreeMap<BlockCoord, u8> = BTreeMap::new();
    let mut last: Option<Transform> = None;
    for CameraPose { t_map_camera: pose, .. } in &camera.poses {
        // Views close together show the same space: they would count it twice.
        if last.is_some_and(|last| (last.inverse() * *pose).distance_m() < APART_M) {
            continue;
        }
        last = Some(*pose);
        let depths = Depths::of(field, camera, pose);
        let to_camera = pose.inverse();
        let block_m = field.voxel_size_m * BLOCK_SIDE as f64;
        let reach = (FAR_M / block_m).ceil() as i32;
        let centre = pose.translation_m.map(|side| (side / block_m).floor() as i32);
        for x in -reach..=reach {
            for y in -reach..=reach {
                // All blocks within reach of the camera.
                for z in -reach..=reach {
                    let Some(coord) = BlockCoord::new(centre[0] + x, centre[1] + y, centre[2] + z)
                    else {
                        continue;
                    };
                    if depths.show_free(camera, &to_camera, coord, (block_m, field.truncation_m)) {
                        let count = views.entry(coord).or_default();
                        *count = count.saturating_add(1);
                    }
                }
            }
        }
    }
    // One view may be mistaken.
    views.retain(|_, count| *count >= VIEWS_MIN);
    views
}

impl Depths {
    fn of(field: &DistanceField, Camera { rig, size, .. }: &Camera, pose: &Transform) -> Self {
        let (width, height) = (size.0 / PIXELS, size.1 / PIXELS);
        let mut depth_m = Vec::with_capacity(width * height);
        for row in 0..height {
            for column in 0..width {
                let across =
                    |px: usize, centre_px: f64| ((px * PIXELS) as f64 - centre_px) / rig.focal_px;
                let ray = pose.rotate([
                    across(column, rig.center_u_px),
                    across(row, rig.center_v_px),
                    1.0,
                ]);
                // 0: the ray met nothing.
                depth_m.push(first_surface(field, pose.translation_m, ray).unwrap_or(0.0));
            }
        }
        Self { width, height, depth_m }
    }

    /// Returns true if all rays through a block end behind it.
    fn show_free(
        &self,
        Camera { rig, .. }: &Camera,
        to_camera: &Transform,
        coord: BlockCoord,
        (block_m, truncation_m): (f64, f64),
    ) -> bool {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in 0..8usize {
            let side = |axis: usize, at: i16| {
                (f64::from(at) + f64::from((corner >> axis & 1) as u8)) * block_m
            };
            let [x, y, z] =
                to_camera.transform_point([side(0, coord.x), side(1, coord.y), side(2, coord.z)]);
            // All corners must be in front of the camera and within range.
            if !(NEAR_M..FAR_M).contains(&z) {
                return false;
            }
            let pixels = PIXELS as f64;
            let at = [
                (rig.focal_px * x / z + rig.center_u_px) / pixels,
                (rig.focal_px * y / z + rig.center_v_px) / pixels,
                z,
            ];
            (0..3).for_each(|axis| {
                (low[axis], high[axis]) = (low[axis].min(at[axis]), high[axis].max(at[axis]))
            });
        }
        // The block's outline must lie in the image as a whole.
        let [left, top, right, bottom] =
            [low[0].floor(), low[1].floor(), high[0].ceil(), high[1].ceil()];
        if left < 0.0 || top < 0.0 || right >= self.width as f64 || bottom >= self.height as f64 {
            return false;
        }
        // Every ray through the outline must end behind the block's farthest corner and the
        // truncation.
        let behind_m = high[2] + truncation_m;
        let mut pixels = (top as usize..=bottom as usize)
            .flat_map(|v| (left as usize..=right as usize).map(move |u| (u, v)));
        pixels.all(|(u, v)| self.depth_m[v * self.width + u] >= behind_m)
    }
}

/// Depth of the first surface along a ray of depth 1. A ray that comes upon the back of a surface
/// shows none.
fn first_surface(field: &DistanceField, from_m: [f64; 3], ray: [f64; 3]) -> Option<f64> {
    let step_m = 1.5 * field.voxel_size_m;
    let (mut depth_m, mut before) = (0.5, None);
    while depth_m < HIT_MAX_M {
        let point = std::array::from_fn(|axis| {
            ((from_m[axis] + ray[axis] * depth_m) / field.voxel_size_m).round() as i32
        });
        let here = field.voxel(point).map(|sdf| f64::from(sdf) / 32_767.0 * field.truncation_m);
        // From before a surface to behind it, or out of nowhere into the back of one.
        match (here, before) {
            (Some(here), Some(before)) if here <= 0.0 && before > 0.0 => return Some(depth_m),
            (Some(here), None) if here <= 0.0 => return None,
            _ => {}
        }
        before = here;
        // Up to a surface the distance itself is a step.
        depth_m += here.map_or(step_m, |here| step_m.max(0.5 * here));
    }
    None
}
