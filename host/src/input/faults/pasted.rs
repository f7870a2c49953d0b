//! Surfaces before the cameras that move with them or past them: a vehicle, a person, a bonnet, a
//! reflection, dirt.

use super::changed::{Pixel, each_pixel};
use super::noise::{fixed, smooth};
use crate::input::source::StereoImages;
use dynvox_core::geometry::StereoRig;

/// Share of the camera's height at which what stands on the ground ends, m below the camera.
const GROUND_M: f64 = 1.4;
/// Disparities of a bonnet and of a reflection, as shares of the width.
const BONNET_DISPARITY: f64 = 0.094;
const REFLECTION_DISPARITY: f64 = 0.03;
/// Share of the height by which a bonnet is lower at its ends.
const BONNET_BEND: f64 = 0.1;
/// Sizes of the texture's grain, px, and its height, grey levels.
const GRAINS_PX: [f64; 2] = [3.0, 11.0];
const GRAIN: f64 = 70.0;
/// Size of a blot of dirt, as a share of the width, its grey level and how much it hides.
const BLOT: f64 = 0.07;
const DIRT: f64 = 60.0;
const HIDES: f64 = 0.9;
/// Grey level of a tunnel's wall.
const WALL: f64 = 40.0;

/// Textured upright surface that faces the cameras.
#[derive(Clone, Copy, Debug)]
pub(super) struct Panel {
    /// Middle to the right of the left camera, m.
    pub right_m: f64,
    /// Distance ahead, m.
    pub ahead_m: f64,
    pub width_m: f64,
    pub height_m: f64,
}

impl Panel {
    /// Rear of a truck that keeps its distance.
    pub fn truck(ahead_m: f64) -> Self {
        Self { right_m: 0.0, ahead_m, width_m: 2.5, height_m: 3.6 }
    }

    /// Person who walks ahead at the camera's speed.
    pub fn walker(ahead_m: f64) -> Self {
        Self { right_m: 0.1, ahead_m, width_m: 0.55, height_m: 1.75 }
    }

    /// Side of a row of buses that passes 5 m ahead, `passed_m` since it came.
    pub fn bus(passed_m: f64) -> Self {
        Self { right_m: 20.0 - passed_m, ahead_m: 5.0, width_m: 60.0, height_m: 3.4 }
    }
}

/// Puts a panel before the cameras.
pub(super) fn put_panel(images: &mut StereoImages, rig: &StereoRig, panel: &Panel) {
    let px_per_m = rig.focal_px / panel.ahead_m;
    each_pixel(images, |at, value| {
        // Position on the panel's plane, m from its middle and above its lower end.
        let eye_m = if at.is_right { rig.baseline_m } else { 0.0 };
        let along_m = (at.u - rig.center_u_px) / px_per_m + eye_m - panel.right_m;
        let up_m = GROUND_M - (at.v - rig.center_v_px) / px_per_m;
        let is_inside =
            along_m.abs() < 0.5 * panel.width_m && (0.0..panel.height_m).contains(&up_m);
        if is_inside { texture(along_m * px_per_m, up_m * px_per_m) } else { value }
    });
}

/// Puts the vehicle's own bonnet over the lower `share` of both images.
pub(super) fn put_bonnet(images: &mut StereoImages, share: f64) {
    each_pixel(images, |at, value| {
        let from_middle = 2.0 * at.u / at.width - 1.0;
        let edge = 1.0 - share + BONNET_BEND * from_middle * from_middle;
        let shift = if at.is_right { BONNET_DISPARITY * at.width } else { 0.0 };
        if at.v > edge * at.height { texture(at.u + shift, at.v) } else { value }
    });
}

/// Reflects what lies behind a windscreen in the lower half of both images, of this weight.
pub(super) fn put_reflection(images: &mut StereoImages, weight: f64) {
    each_pixel(images, |at, value| {
        let shift = if at.is_right { REFLECTION_DISPARITY * at.width } else { 0.0 };
        let weight = if at.v > 0.5 * at.height { weight } else { 0.0 };
        (1.0 - weight) * value + weight * texture(at.u + shift, at.v)
    });
}

/// Soils about this share of both lenses, each with blots of its own.
pub(super) fn put_dirt(images: &mut StereoImages, share: f64) {
    each_pixel(images, |at, value| {
        let scale = 1.0 / (BLOT * at.width);
        let seed = 31 + u64::from(at.is_right);
        // Smooth noise is about evenly spread between a fifth and four fifths.
        let depth = smooth(seed, at.u * scale, at.v * scale) - (0.8 - 0.6 * share);
        let hidden = HIDES * (depth * 12.0).clamp(0.0, 1.0);
        (1.0 - hidden) * value + hidden * DIRT
    });
}

/// Hides all but the middle share of both images' sides: a tunnel's mouth, with far surfaces only.
pub(super) fn put_tunnel(images: &mut StereoImages, share: f64) {
    each_pixel(images, |at, value| {
        let off = |px: f64, side: f64| (2.0 * px / side - 1.0).abs();
        let is_open = off(at.u, at.width) < share && off(at.v, at.height) < share;
        if is_open { value } else { WALL }
    });
}

/// Texture of what is pasted, grey levels.
fn texture(x_px: f64, y_px: f64) -> f64 {
    let grain = |size_px: f64| smooth(7, x_px / size_px, y_px / size_px) - 0.5;
    110.0 + GRAIN * 2.0 * GRAINS_PX.map(grain).iter().sum::<f64>()
}

/// Adds a pattern that each sensor has in all frames alike, grey levels (1 sigma).
pub(super) fn put_pattern(images: &mut StereoImages, sigma: f64) {
    let seed = |at: &Pixel| 41 + u64::from(at.is_right);
    each_pixel(images, |at, value| value + sigma * fixed(seed(&at), &at));
}
