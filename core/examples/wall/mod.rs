//! A textured wall and a stereo camera that drives towards it: frames for the examples, without
//! files.

use dynvox_core::{StereoFrame, geometry::StereoRig, image::View};

pub const RIG: StereoRig =
    StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
const WIDTH: usize = 320;
const HEIGHT: usize = 96;

/// The left and the right image of one frame.
pub struct Pair([Vec<u8>; 2]);

impl Pair {
    /// Frame `number` of a run that starts 9 m away from the wall.
    pub fn new(number: u32) -> Self {
        let m_per_px = (9.0 - 0.2 * f64::from(number)) / RIG.focal_px;
        let image = |camera_x_m: f64| {
            let pixel = |at: usize| {
                let (u, v) = ((at % WIDTH) as f64, (at / WIDTH) as f64);
                brightness(
                    (u - RIG.center_u_px) * m_per_px + camera_x_m,
                    (v - RIG.center_v_px) * m_per_px,
                )
            };
            (0..WIDTH * HEIGHT).map(pixel).collect()
        };
        Self([image(0.0), image(RIG.baseline_m)])
    }

    /// The frame as the core takes it.
    pub fn frame(&self) -> Result<StereoFrame<'_>, &'static str> {
        let [left, right] = &self.0;
        let view = |pixels| View::new(pixels, WIDTH, HEIGHT).ok_or("an image is too small");
        Ok(StereoFrame::pair(view(left)?, view(right)?))
    }
}

/// Brightness of the wall at a point: noise in cells of 15 cm, smooth between their corners.
fn brightness(x_m: f64, y_m: f64) -> u8 {
    let (x, y) = (x_m / 0.15, y_m / 0.15);
    let corner = |i: f64, j: f64| {
        let mixed = (x.floor() + i) as i64 * 374_761_393 + (y.floor() + j) as i64 * 668_265_263;
        ((mixed ^ mixed >> 13).wrapping_mul(1_274_126_177) >> 16 & 0xFF) as f64
    };
    let (s, t) = (x - x.floor(), y - y.floor());
    ((corner(0.0, 0.0) * (1.0 - s) + corner(1.0, 0.0) * s) * (1.0 - t)
        + (corner(0.0, 1.0) * (1.0 - s) + corner(1.0, 1.0) * s) * t) as u8
}
