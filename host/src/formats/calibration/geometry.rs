//! The cameras of a recording, from whichever files say it.

use super::{StereoCalibration, read_rig};
use crate::formats::{FormatError, read_text};
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::{Rectification, Sizing};
use dynvox_core::settings::{Range, Setting, Value::Number};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Widest and highest image that raw pairs are rectified to unless a size is given: wider and
/// higher ones cost time and show nothing that was not seen.
pub const LARGEST_PX: [u32; 2] = [1_920, 1_088];

/// Size to which raw pairs are rectified. Without one it is the calibration's own, else the largest
/// rectangle that both cameras see whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RectifiedSize {
    /// Width, px; with `height_px` or not at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width_px: Option<u32>,
    /// Height, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_px: Option<u32>,
    /// Focal length, px, with a size only; the least that leaves no pixel without image when
    /// absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_px: Option<f64>,
}

type Row = Setting<RectifiedSize>;

impl RectifiedSize {
    /// Least side, px.
    const LEAST_PX: u32 = 32;
    /// Largest side, px.
    const MAX_PX: u32 = 4_096;

    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("rectify.width_px", "px", |c| Number(c.width_px.map(f64::from)))
            .range(Range::Within(Self::LEAST_PX as f32, Self::MAX_PX as f32))
            .text("Width of rectified images; with `height_px` or not at all."),
        Row::user("rectify.height_px", "px", |c| Number(c.height_px.map(f64::from)))
            .range(Range::Within(Self::LEAST_PX as f32, Self::MAX_PX as f32))
            .text("Height of rectified images."),
        Row::user("rectify.focal_px", "px", |c| Number(c.focal_px)).range(Range::POSITIVE).text(
            "Focal length of rectified images, with a size only; the least that leaves no pixel \
             without image when absent.",
        ),
    ];

    /// The core's own, or what is wrong, in one sentence.
    ///
    /// # Errors
    /// Sizes out of range, or one figure without the other.
    pub fn sizing(&self) -> Result<Sizing, String> {
        let sides = Self::LEAST_PX..=Self::MAX_PX;
        match (self.width_px, self.height_px, self.focal_px) {
            (None, None, None) => {
                let [max_width, max_height] = LARGEST_PX;
                Ok(Sizing::Automatic { max_width, max_height })
            }
            (Some(width), Some(height), _)
                if !(sides.contains(&width) && sides.contains(&height)) =>
            {
                Err(format!(
                    "the rectified size {width} x {height} px must lie within {} to {} px a side",
                    Self::LEAST_PX,
                    Self::MAX_PX
                ))
            }
            (Some(_), Some(_), Some(focal_px)) if !(focal_px.is_finite() && focal_px > 0.0) => {
                Err(format!("the rectified focal length {focal_px} px must be a positive number"))
            }
            (Some(width), Some(height), focal_px) => Ok(Sizing::Given { width, height, focal_px }),
            (None, None, Some(_)) => {
                Err("a rectified focal length needs a rectified size".to_owned())
            }
            _ => Err("a rectified size needs width and height".to_owned()),
        }
    }
}

/// The cameras of a recording.
#[derive(Clone, Debug)]
pub enum CameraGeometry {
    /// Images come rectified.
    Rectified(StereoRig),
    /// Images come raw.
    Raw {
        /// Lenses and placement.
        calibration: Box<StereoCalibration>,
        /// The first file that says so, to name it.
        path: PathBuf,
    },
}

/// The cameras for images of a known size: rig and size of what is mapped.
#[derive(Clone, Copy, Debug)]
pub struct FittedGeometry {
    /// The rectified rig.
    pub rig: StereoRig,
    /// Width and height of rectified images, px.
    pub size: (usize, usize),
    /// Rectification of raw pairs; `None` if they come rectified.
    pub rectification: Option<Rectification>,
}

impl CameraGeometry {
    /// Reads a calibration of either kind. `image_size` is the images' where it is known.
    ///
    /// # Errors
    /// See [`StereoCalibration::read`] and [`read_rig`].
    pub fn read(paths: &[PathBuf], image_size: Option<[u32; 2]>) -> Result<Self, FormatError> {
        if let [path] = paths
            && path.extension().is_none_or(|ending| ending == "txt")
            && !read_text(path)?.contains("P_rect_")
        {
            return Ok(Self::Rectified(read_rig(path)?));
        }
        let files: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
        let calibration = Box::new(StereoCalibration::read(&files, image_size)?);
        Ok(Self::Raw { calibration, path: paths.first().cloned().unwrap_or_default() })
    }

    /// Principal point of the left camera's images, px.
    pub fn center_px(&self) -> [f64; 2] {
        match self {
            Self::Rectified(rig) => [rig.center_u_px, rig.center_v_px],
            Self::Raw { calibration, .. } => calibration.left.lens.center_px(),
        }
    }

    /// Returns the geometry of mapped images, for raw ones of a size.
    ///
    /// # Errors
    /// A raw calibration is for images of another size, or cannot be rectified to the size that is
    /// asked for.
    pub fn fitted(
        &self,
        size: (usize, usize),
        rectified: &RectifiedSize,
    ) -> Result<FittedGeometry, FormatError> {
        match self {
            Self::Rectified(rig) => Ok(FittedGeometry { rig: *rig, size, rectification: None }),
            Self::Raw { calibration, path } => {
                calibration.fits(
                    path,
                    [size.0, size.1].map(|side| u32::try_from(side).unwrap_or(u32::MAX)),
                )?;
                let sizing = rectified.sizing().map_err(|reason| {
                    FormatError::content(
                        path,
                        reason,
                        "Give --rectified WxH, and --rectified-focal PX with it, or neither",
                    )
                })?;
                let (rectification, rig) = calibration.rectify(sizing).map_err(|problem| {
                    FormatError::content(
                        path,
                        problem.to_string(),
                        "Check the calibration's numbers",
                    )
                })?;
                let size = (rectification.width as usize, rectification.height as usize);
                Ok(FittedGeometry { rig, size, rectification: Some(rectification) })
            }
        }
    }
}

/// The calibration of a raw pair that lies in a recording's folder: our own `calibration.toml`,
/// Kalibr's `camchain.yaml`, EuRoC's `sensor.yaml` of each camera, or KITTI raw's
/// `calib_cam_to_cam.txt`, there or a folder up.
pub fn beside(folder: &Path) -> Option<Vec<PathBuf>> {
    let one = |path: PathBuf| path.is_file().then(|| vec![path]);
    let euroc = || {
        let pair = ["cam0", "cam1"].map(|camera| folder.join(camera).join("sensor.yaml"));
        pair.iter().all(|path| path.is_file()).then(|| pair.to_vec())
    };
    one(folder.join("calibration.toml"))
        .or_else(|| one(folder.join("camchain.yaml")))
        .or_else(euroc)
        .or_else(|| one(folder.join("calib_cam_to_cam.txt")))
        .or_else(|| one(folder.canonicalize().ok()?.parent()?.join("calib_cam_to_cam.txt")))
}
