//! Raw cameras: a configuration whose pairs are rectified by the mapper.

use crate::{
    DynvoxConfig, DynvoxRig, DynvoxStatus, dynvox_config_default,
    given::{output, read},
};
use dynvox_core::rectify::{LENS_MODELS, Lens, RawCamera, RawRig, Rectification, Sizing};
use dynvox_core::{Config, geometry::StereoRig};

/// A lens by its model. Numbers as in dynvox's own table of models.
pub type DynvoxLensModel = u32;
/// Pinhole with radial and tangential distortion; parameters k1 to k6, p1, p2.
pub const DYNVOX_LENS_RADIAL_TANGENTIAL: DynvoxLensModel = 0;
/// Equidistant fisheye (Kannala, Brandt); parameters k1 to k4.
pub const DYNVOX_LENS_EQUIDISTANT: DynvoxLensModel = 1;
/// Double sphere; parameters xi, alpha.
pub const DYNVOX_LENS_DOUBLE_SPHERE: DynvoxLensModel = 2;
/// Extended unified; parameters alpha, beta.
pub const DYNVOX_LENS_EXTENDED_UNIFIED: DynvoxLensModel = 3;
/// Mei's sphere with OpenCV's whole distortion; parameters xi, k1 to k6, p1, p2, s1 to s4, tilt
/// about x and y.
pub const DYNVOX_LENS_GENERAL: DynvoxLensModel = 4;

/// A camera as it is: its lens and the size of its images.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxRawCamera {
    /// Columns of its images, px, at most 4,096.
    pub width: u32,
    /// Rows of its images, px, at most 4,096.
    pub height: u32,
    /// Focal lengths, horizontal and vertical, px.
    pub focal_px: [f64; 2],
    /// Principal point, px from the centre of the upper left pixel.
    pub center_px: [f64; 2],
    /// DYNVOX_LENS_...
    pub model: DynvoxLensModel,
    /// Parameters of the model; those that it does not have are not read.
    pub parameters: [f64; 15],
}

impl DynvoxRawCamera {
    const NONE: Self = Self {
        width: 0,
        height: 0,
        focal_px: [0.0; 2],
        center_px: [0.0; 2],
        model: 0,
        parameters: [0.0; 15],
    };

    fn camera(&self) -> Result<RawCamera, DynvoxStatus> {
        let kind = usize::try_from(self.model).ok().and_then(|at| LENS_MODELS.get(at));
        let mut model = kind.ok_or(DynvoxStatus::Unknown)?.typical;
        let mut given = self.parameters.into_iter();
        model.visit_parameters(|_, values| {
            values.iter_mut().zip(given.by_ref()).for_each(|(value, given)| *value = given);
        });
        let lens =
            Lens::new(self.focal_px, self.center_px, model).map_err(|_| DynvoxStatus::Config)?;
        Ok(RawCamera { lens, width: self.width, height: self.height })
    }
}

/// Two cameras as they are, the motion between them, and the size their images are rectified to.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxRawRig {
    /// The left camera.
    pub left: DynvoxRawCamera,
    /// The right camera.
    pub right: DynvoxRawCamera,
    /// Rotation of left camera coordinates to right ones, row by row.
    pub r_right_left: [f64; 9],
    /// The left camera's centre in right camera coordinates, m.
    pub t_right_left_m: [f64; 3],
    /// Columns of the rectified images, px; 0 where pairs come rectified.
    pub width: u32,
    /// Rows of the rectified images, px.
    pub height: u32,
    /// Focal length of the rectified images, px; 0 takes the least that shows no pixel without
    /// image.
    pub focal_px: f64,
}

impl DynvoxRawRig {
    pub(crate) const NONE: Self = Self {
        left: DynvoxRawCamera::NONE,
        right: DynvoxRawCamera::NONE,
        r_right_left: [0.0; 9],
        t_right_left_m: [0.0; 3],
        width: 0,
        height: 0,
        focal_px: 0.0,
    };

    /// The rectification and the rectified rig; `None` where pairs come rectified.
    pub(crate) fn rectification(&self) -> Result<Option<(Rectification, StereoRig)>, DynvoxStatus> {
        if self.width == 0 {
            return Ok(None);
        }
        // Rows, as C has them; the matrix is built of columns.
        let [a, b, c, d, e, f, g, h, i] = self.r_right_left;
        let rig = RawRig {
            left: self.left.camera()?,
            right: self.right.camera()?,
            r_right_left: [[a, d, g], [b, e, h], [c, f, i]].into(),
            t_right_left_m: self.t_right_left_m.into(),
        };
        // A zeroed struct asks for the default, as everywhere in this interface.
        let focal_px = if self.focal_px == 0.0 { None } else { Some(self.focal_px) };
        let sizing = Sizing::Given { width: self.width, height: self.height, focal_px };
        Rectification::new(&rig, sizing).map(Some).map_err(|_| DynvoxStatus::Config)
    }
}

/// Writes all defaults for raw cameras, whose pairs the mapper rectifies: frames then have the size
/// of the raw images, and the capacity's `raw_width` and `raw_height` bound it. The rectified rig
/// is in the configuration. DYNVOX_STATUS_CONFIG where the calibration cannot be used.
///
/// # Safety
/// `rig` is null or points to a rig, `config` is null or points to a configuration.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_config_raw(
    rig: *const DynvoxRawRig,
    config: *mut DynvoxConfig,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let (raw, to) = match unsafe { (read(rig), output(config)) } {
        (Ok(raw), Ok(to)) => (raw, to),
        (Err(status), _) | (_, Err(status)) => return status,
    };
    // A rig without a width stands for pairs that come rectified, which need no raw cameras.
    let rectified = match raw.rectification() {
        Ok(Some((_, rig))) => rig,
        Ok(None) => return DynvoxStatus::Size,
        Err(status) => return status,
    };
    let rectified = DynvoxRig::from(&rectified);
    // SAFETY: both point to what they should, as checked.
    unsafe {
        let status = dynvox_config_default(&raw const rectified, config);
        (*to).raw = raw;
        status
    }
}

/// The defaults for a rig, or for raw cameras where there are any.
pub(crate) fn defaults(rig: StereoRig, raw: &DynvoxRawRig) -> Result<Config, DynvoxStatus> {
    Ok(match raw.rectification()? {
        Some((rectification, rig)) => {
            Config { rectification: Some(rectification), ..Config::for_rig(rig) }
        }
        None => Config::for_rig(rig),
    })
}
