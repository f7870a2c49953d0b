//! Images through a lens, or of a rig that is off: sampled from a rendering of the ideal pinhole
//! that is twice as fine and as large as the image needs.
//!
//! The two ideal pinholes of [`Optics::rig`] stay what depth, masks and poses are of:
//! rectifying the raw images by the calibration gives their images. Each raw camera is rotated
//! against its pinhole by a fixed small angle, so that rectification has to rotate.
//!
//! Memory: 16 bytes a pixel and camera. Time: four views instead of one.

use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::rectify::{Lens, RawCamera, Rectification, TurnedCamera};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::error::SynthError;
use super::lens::RigError;
use super::optics::Optics;
use super::raster::Pinhole;
use super::sensor::Sensor;
use crate::formats::calibration::{Placement, StereoCalibration};

/// Rotations of the raw cameras against the ideal ones, rad: pitch, yaw, roll.
const ROTATIONS_RAD: [[f64; 3]; 2] = [[0.006, -0.008, 0.010], [-0.007, 0.009, -0.006]];
/// Pixels of the rendering for one of the image, along one axis.
const FINENESS: f64 = 2.0;
/// Positions of a pixel's samples, px from its centre.
const SAMPLES_PX: [[f64; 2]; 4] = [[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]];
/// Pixels of the rendering beyond the outermost sample.
const MARGIN_PX: f64 = 2.0;
/// Tangent of the widest angle that is rendered; beyond it images are black.
const WIDEST_TANGENT: f64 = 2.2;
/// Height of a pixel over its width.
const ASPECT: f64 = 1.004;
/// Raw pixels beyond what the ideal images show.
const RIM_PX: f64 = 2.0;
/// Points along a side by which the size of raw images is found.
const SIDE_POINTS: u32 = 64;

/// The calibration of a world's raw cameras; `None` where images come rectified.
pub fn calibration(optics: &Optics) -> Result<Option<StereoCalibration>, SynthError> {
    let Some(model) = optics.lens.model() else { return Ok(None) };
    let (rig, section) = (&optics.rig, optics.section);
    let refused =
        |reason: String| SynthError::Config(format!("{section}.lens cannot be used: {reason}"));
    let lens = |focal_px: f64, center_px: [f64; 2]| {
        Lens::new([focal_px, ASPECT * focal_px], center_px, model)
            .map_err(|problem| refused(problem.to_string()))
    };
    // The middle at the scale of the ideal images.
    let plain = lens(rig.focal_px, [0.0; 2])?;
    // The focal length is chosen so that the middle keeps the ideal images' scale.
    let focal_px = rig.focal_px * rig.focal_px / middle_focal_px(&plain);
    let plain = lens(focal_px, [0.0; 2])?;
    let rotations = ROTATIONS_RAD.map(rotation);
    let extents = rotations.map(|r| extent(&plain, &r, optics));
    let [Some(left), Some(right)] = extents else {
        return Err(refused(format!(
            "it does not show all of the ideal image. Choose other parameters, or a \
                     longer {section}.focal_px"
        )));
    };
    // One size for both cameras: the larger extent, with a rim.
    let side = |axis: usize| {
        let span = |extent: &[[f64; 2]; 2]| extent[1][axis] - extent[0][axis];
        (span(&left).max(span(&right)) + 2.0 * RIM_PX).ceil() as u32 + 1
    };
    let [width, height] = [side(0), side(1)];
    let camera = |[low, high]: [[f64; 2]; 2]| {
        // The middle of what is seen comes to the middle of the image.
        let center =
            |axis: usize, side: u32| 0.5 * (f64::from(side) - 1.0) - 0.5 * (low[axis] + high[axis]);
        Ok::<_, SynthError>(RawCamera {
            lens: lens(focal_px, [center(0, width), center(1, height)])?,
            width,
            height,
        })
    };
    let [r_rectified_left, r_rectified_right] = rotations;
    Ok(Some(StereoCalibration {
        left: camera(left)?,
        right: camera(right)?,
        placement: Placement::Rectified {
            r_rectified_left,
            r_rectified_right,
            rig: *rig,
            size: optics.size,
        },
        format: "the synthetic world",
    }))
}

/// Pixels per radian on the optical axis, mean of both directions.
fn middle_focal_px(lens: &Lens) -> f64 {
    const STEP: f64 = 1e-5;
    let column = |x: f64| lens.project([x, 0.0, 1.0]).map_or(0.0, |[u, _]| u);
    0.5 * (1.0 + ASPECT) * (column(STEP) - column(-STEP)) / (2.0 * STEP)
}

/// The ray of a pixel of the ideal images, at depth 1.
fn ray(rig: &StereoRig, [u, v]: [f64; 2]) -> Vector3<f64> {
    Vector3::new((u - rig.center_u_px) / rig.focal_px, (v - rig.center_v_px) / rig.focal_px, 1.0)
}

fn rotation(rotation_rad: [f64; 3]) -> Matrix3<f64> {
    Matrix3::from(Transform::new(rotation_rad, [0.0; 3]).rotation_matrix()).transpose()
}

/// Raw pixels that the ideal image's border shows: smallest and largest; `None` where the lens does
/// not show all of it.
fn extent(lens: &Lens, r_rectified_raw: &Matrix3<f64>, optics: &Optics) -> Option<[[f64; 2]; 2]> {
    let last = optics.size.map(|side| f64::from(side) - 1.0);
    let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
    // The border bounds the image: lenses are monotonic.
    for step in 0..=SIDE_POINTS {
        let share = f64::from(step) / f64::from(SIDE_POINTS);
        let [u, v] = [last[0] * share, last[1] * share];
        for [u, v] in [[u, 0.0], [u, last[1]], [0.0, v], [last[0], v]] {
            let pixel =
                lens.project((r_rectified_raw.transpose() * ray(&optics.rig, [u, v])).into())?;
            for axis in 0..2 {
                low[axis] = low[axis].min(pixel[axis]);
                high[axis] = high[axis].max(pixel[axis]);
            }
        }
    }
    Some([low, high])
}

/// Sampling of one camera's image from a rendering.
pub struct CameraView {
    /// Camera of the rendering.
    pub pinhole: Pinhole,
    /// Width and height of the image.
    pub size: [usize; 2],
    /// Positions in the rendering of each pixel's samples, px; NaN where nothing is seen.
    samples_px: Vec<[[f32; 2]; 4]>,
}

/// Both views of a world that is not taken by an ideal rig; `None` where it is.
pub fn views(optics: &Optics, calibration: Option<&StereoCalibration>) -> Option<[CameraView; 2]> {
    if calibration.is_none() && optics.rig_error.is_none() {
        return None;
    }
    // Both cameras as the rectification turns them.
    let rectification = calibration.and_then(rectification);
    let (rig, ideal) = (&optics.rig, optics.size);
    let left = CameraView::new(
        rig,
        ideal,
        rectification.as_ref().map(|both| &both.left),
        &RigError::default(),
    );
    Some([
        left,
        CameraView::new(
            rig,
            ideal,
            rectification.as_ref().map(|both| &both.right),
            &optics.rig_error,
        ),
    ])
}

/// Returns the rectification of raw images by a calibration.
pub fn rectification(calibration: &StereoCalibration) -> Option<Rectification> {
    // Only a calibration that states its rectification has one to return.
    let Placement::Rectified { r_rectified_left, r_rectified_right, size, .. } =
        calibration.placement
    else {
        return None;
    };
    let camera =
        |raw: RawCamera, r_rectified_raw: Matrix3<f64>| TurnedCamera { raw, r_rectified_raw };
    Rectification::given(
        camera(calibration.left, r_rectified_left),
        camera(calibration.right, r_rectified_right),
        size,
    )
    .ok()
}

impl CameraView {
    fn new(rig: &StereoRig, ideal: [u32; 2], raw: Option<&TurnedCamera>, error: &RigError) -> Self {
        let [width, height] = raw.map_or(ideal, |camera| [camera.raw.width, camera.raw.height]);
        let off = Misalignment::new(error, rig);
        let tangents = |[u, v]: [f64; 2]| {
            let ray = match raw {
                Some(camera) => {
                    camera.r_rectified_raw * Vector3::from(camera.raw.lens.unproject([u, v])?)
                }
                None => ray(rig, [u, v]),
            };
            // Rays nearly across the axis have no tangent worth rendering.
            (ray.z > 0.05).then(|| off.seen([ray.x / ray.z, ray.y / ray.z]))
        };
        let of_pixel = |pixel: u32| {
            let [u, v] = [f64::from(pixel % width), f64::from(pixel / width)];
            SAMPLES_PX.map(|[du, dv]| {
                let at = tangents([u + du, v + dv])
                    .filter(|at| at.iter().all(|tangent| tangent.abs() <= WIDEST_TANGENT));
                at.unwrap_or([f64::NAN; 2])
            })
        };
        let tangents: Vec<[[f64; 2]; 4]> =
            (0..width * height).into_par_iter().map(of_pixel).collect();
        // The rendering covers every sample of every raw pixel.
        let (mut low, mut high) = ([0.0f64; 2], [0.0f64; 2]);
        for [x, y] in tangents.iter().flatten() {
            // The smaller of a number and NaN is the number.
            low = [low[0].min(*x), low[1].min(*y)];
            high = [high[0].max(*x), high[1].max(*y)];
        }
        let focal_px = FINENESS * rig.focal_px;
        let first = low.map(|low| MARGIN_PX - focal_px * low);
        let side = |axis: usize| {
            (focal_px * (high[axis] - low[axis]) + 2.0 * MARGIN_PX).ceil() as usize + 1
        };
        let pinhole =
            Pinhole { width: side(0), height: side(1), focal_px, center_px: (first[0], first[1]) };
        let in_rendering =
            |[x, y]: [f64; 2]| [(focal_px * x + first[0]) as f32, (focal_px * y + first[1]) as f32];
        Self {
            pinhole,
            size: [width as usize, height as usize],
            samples_px: tangents.iter().map(|samples| samples.map(in_rendering)).collect(),
        }
    }

    /// The image as the sensor reads it.
    pub fn image(&self, rendering: &[[u8; 3]], sensor: &Sensor) -> Vec<[u8; 3]> {
        let read = |(pixel, samples): (usize, &[[f32; 2]; 4])| {
            let mut levels = [0.0; 3];
            for &sample in samples {
                let seen = bilinear(rendering, self.pinhole.width, sample).unwrap_or_default();
                levels = [0, 1, 2].map(|channel| levels[channel] + 0.25 * seen[channel]);
            }
            sensor.read(pixel, levels)
        };
        self.samples_px.par_iter().enumerate().map(read).collect()
    }
}

fn bilinear(picture: &[[u8; 3]], width: usize, [u, v]: [f32; 2]) -> Option<[f32; 3]> {
    // False for NaN as well.
    if !(u >= 0.0 && v >= 0.0) {
        return None;
    }
    let (column, row) = (u as usize, v as usize);
    let (right, down) = (u - column as f32, v - row as f32);
    let at = row * width + column;
    let [a, b, c, d] = [at, at + 1, at + width, at + width + 1].map(|at| picture.get(at));
    let (a, b, c, d) = (a?, b?, c?, d?);
    let mix = |channel: usize| {
        let [a, b, c, d] = [a, b, c, d].map(|pixel| f32::from(pixel[channel]));
        (a * (1.0 - right) + b * right) * (1.0 - down) + (c * (1.0 - right) + d * right) * down
    };
    Some([mix(0), mix(1), mix(2)])
}

/// Mapping from a calibrated camera's view to that of one which is misaligned.
struct Misalignment {
    /// Rays of the camera as it is calibrated to rays of the camera as it stands.
    rotation: Matrix3<f64>,
    /// Shift of the image, as tangents.
    shift: [f64; 2],
}

impl Misalignment {
    fn new(error: &RigError, rig: &StereoRig) -> Self {
        let pitch = rotation([error.pitch_deg.to_radians(), 0.0, 0.0]);
        let roll = rotation([0.0, 0.0, -error.roll_deg.to_radians()]);
        Self {
            rotation: pitch * roll,
            shift: [
                error.disparity_offset_px / rig.focal_px,
                error.vertical_shift_px / rig.focal_px,
            ],
        }
    }

    fn seen(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ray = self.rotation * Vector3::new(x - self.shift[0], y - self.shift[1], 1.0);
        [ray.x / ray.z, ray.y / ray.z]
    }
}
