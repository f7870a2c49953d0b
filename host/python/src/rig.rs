//! The cameras.

use super::error::{raise, refuse};
use dynvox::formats::calibration::{
    CalibrationFiles, CalibrationHints, CameraGeometry, Cameras, FittedGeometry, RectifiedSize,
};
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::Rectification;
use pyo3::prelude::*;
use std::path::PathBuf;

/// Two identical pinhole cameras, rectified; of raw cameras also how their pairs become so.
#[pyclass(frozen, module = "dynvox", from_py_object)]
#[derive(Clone)]
pub struct Rig {
    rig: StereoRig,
    /// Width and height of what is mapped, px, where they are known.
    size: Option<(usize, usize)>,
    rectification: Option<Box<Rectification>>,
}

impl Rig {
    pub fn of(rig: StereoRig, size: (usize, usize), rectification: Option<&Rectification>) -> Self {
        Self { rig, size: Some(size), rectification: rectification.map(|of| Box::new(*of)) }
    }

    /// Width and height of the pictures a mapper is made for, where the rig says so.
    pub fn mapped_size(&self) -> Option<(usize, usize)> {
        self.rectification.as_ref().and(self.size)
    }

    /// The cameras for pictures of a size, which that of rectified ones overrules.
    pub fn fitted(&self, size: (usize, usize)) -> FittedGeometry {
        FittedGeometry {
            rig: self.rig,
            size: self.mapped_size().unwrap_or(size),
            rectification: self.rectification.as_deref().copied(),
        }
    }
}

#[pymethods]
impl Rig {
    #[new]
    fn new(focal_px: f64, center_u_px: f64, center_v_px: f64, baseline_m: f64) -> PyResult<Self> {
        let rig = StereoRig { focal_px, center_u_px, center_v_px, baseline_m };
        match dynvox_core::Config::for_rig(rig).validate().first() {
            Some(problem) => Err(refuse(format!("{problem}. Check the numbers of the rig"))),
            None => Ok(Self { rig, size: None, rectification: None }),
        }
    }

    #[getter]
    fn focal_px(&self) -> f64 {
        self.rig.focal_px
    }

    #[getter]
    fn center_u_px(&self) -> f64 {
        self.rig.center_u_px
    }

    #[getter]
    fn center_v_px(&self) -> f64 {
        self.rig.center_v_px
    }

    #[getter]
    fn baseline_m(&self) -> f64 {
        self.rig.baseline_m
    }

    /// Width and height of rectified pictures, where known.
    #[getter]
    fn size(&self) -> Option<(usize, usize)> {
        self.size
    }

    /// Width and height of the left camera's raw pictures; None where pairs come rectified.
    #[getter]
    fn raw_size(&self) -> Option<(u32, u32)> {
        self.rectification.as_ref().map(|of| (of.left.raw.width, of.left.raw.height))
    }

    fn __repr__(&self) -> String {
        let StereoRig { focal_px, center_u_px, center_v_px, baseline_m } = self.rig;
        format!(
            "Rig(focal_px={focal_px}, center_u_px={center_u_px}, center_v_px={center_v_px}, \
             baseline_m={baseline_m})"
        )
    }
}

/// Reads the calibration of raw or rectified cameras, in any format that `dynvox calibration`
/// reads.
#[pyfunction]
#[pyo3(signature = (*files, image=None, rectified=None, rectified_focal_px=None))]
pub fn read_calibration(
    files: Vec<PathBuf>,
    image: Option<(u32, u32)>,
    rectified: Option<(u32, u32)>,
    rectified_focal_px: Option<f64>,
) -> PyResult<Rig> {
    if files.is_empty() {
        return Err(refuse(
            "no file of a calibration is given. Name one file with both cameras, or one for each",
        ));
    }
    let image = image.map(|(width, height)| [width, height]);
    let read = CalibrationFiles::read(&files, CalibrationHints::default()).map_err(raise)?;
    let read = read.cameras(image).map_err(raise)?;
    if let Cameras::Rectified(cameras) = &read.cameras
        && cameras.offset_px == 0.0
    {
        let rig = cameras.rig;
        return Rig::new(rig.focal_px, rig.center_u_px, rig.center_v_px, rig.baseline_m);
    }
    let calibration = Box::new(read.raw(image).map_err(raise)?);
    let raw = calibration.left;
    let cameras = CameraGeometry::Raw { calibration, path: read.path };
    let size = RectifiedSize {
        width_px: rectified.map(|(width, _)| width),
        height_px: rectified.map(|(_, height)| height),
        focal_px: rectified_focal_px,
    };
    let fitted = cameras.fitted((raw.width as usize, raw.height as usize), &size).map_err(raise)?;
    Ok(Rig::of(fitted.rig, fitted.size, fitted.rectification.as_ref()))
}
