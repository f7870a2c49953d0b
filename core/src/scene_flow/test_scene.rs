//! A textured box seen from within by a stereo camera: the analytic scene of the tests.

use crate::geometry::{StereoRig, Transform};
use nalgebra::{Point3, Vector3};
use std::vec::Vec;

pub(crate) const WIDTH: usize = 400;
pub(crate) const HEIGHT: usize = 160;
pub(crate) const RIG: StereoRig =
    StereoRig { focal_px: 240.0, center_u_px: 198.3, center_v_px: 81.2, baseline_m: 0.5 };

/// Corners of the box; the camera's world origin is inside.
const LOW: [f64; 3] = [-4.0, -2.0, -6.0];
const HIGH: [f64; 3] = [5.0, 1.7, 14.0];

/// Grey images of both cameras at a pose.
pub(crate) fn see(t_world_camera: &Transform) -> [Vec<u8>; 2] {
    [0.0, RIG.baseline_m].map(|x| image(t_world_camera, x))
}

fn image(t_world_camera: &Transform, x_m: f64) -> Vec<u8> {
    let eye = t_world_camera.transform_point(Point3::new(x_m, 0.0, 0.0));
    let mut pixels = Vec::with_capacity(WIDTH * HEIGHT);
    for v in 0..HEIGHT {
        for u in 0..WIDTH {
            let mut sum = 0.0;
            // Four samples for each pixel soften the pattern's edges, as a lens does.
            for (du, dv) in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
                let x = (u as f64 + du - RIG.center_u_px) / RIG.focal_px;
                let y = (v as f64 + dv - RIG.center_v_px) / RIG.focal_px;
                let ray = t_world_camera.rotate(Vector3::new(x, y, 1.0));
                // Seen from inside a box, the nearest of the three walls ahead is the one that is
                // hit.
                let reach = (0..3)
                    .map(|i| ((if ray[i] > 0.0 { HIGH[i] } else { LOW[i] }) - eye[i]) / ray[i])
                    .fold(1e9, |a, b| if a < b { a } else { b });
                sum += grey(eye + ray * reach);
            }
            pixels.push((sum / 4.0).round() as u8);
        }
    }
    pixels
}

/// Smooth noise of three wavelengths.
pub(crate) fn grey(point: Point3<f64>) -> f64 {
    let octave = |wavelength: f64, seed: u32| {
        let p = point.coords / wavelength;
        let cell = p.map(f64::floor);
        let f = (p - cell).map(|x| x * x * (3.0 - 2.0 * x));
        let corner = |i: i32| {
            let at = |axis: usize| cell[axis] as i32 + ((i >> axis) & 1);
            let weight = |axis: usize| if (i >> axis) & 1 == 1 { f[axis] } else { 1.0 - f[axis] };
            weight(0) * weight(1) * weight(2) * hash([at(0), at(1), at(2)], seed)
        };
        (0..8).map(corner).sum::<f64>()
    };
    // Casting to a pixel saturates.
    128.0 + 90.0 * octave(0.9, 1) + 80.0 * octave(0.35, 2) + 40.0 * octave(0.17, 3)
}

/// Uniform in ±1.
fn hash(at: [i32; 3], seed: u32) -> f64 {
    let mut x = seed.wrapping_mul(0x9E37_79B9);
    for a in at {
        x = (x ^ a as u32).wrapping_mul(0x85EB_CA6B);
        x ^= x >> 15;
    }
    x = x.wrapping_mul(0xC2B2_AE35);
    f64::from(x ^ (x >> 16)) / f64::from(u32::MAX) * 2.0 - 1.0
}
