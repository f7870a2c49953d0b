//! The cameras.

use super::error::{raise, refuse};
use super::{options, pickled};
use dynvox::formats::calibration::{
    CalibrationFiles, CalibrationHints, CameraGeometry, Cameras, FittedGeometry, RectifiedSize,
};
use dynvox::input::diagnosis::LiveExamination;
use dynvox_core::StereoFrame;
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::Rectification;
use pyo3::basic::CompareOp;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyTuple};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;

/// Two identical pinhole cameras, rectified. That of a data set or of `read_calibration` can also
/// be of raw cameras: the mapper rectifies then.
///
/// Rigs of equal numbers are equal, and can be pickled.
#[pyclass(frozen, module = "dynvox", from_py_object)]
#[derive(Clone, PartialEq)]
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

    /// Begins to examine pairs.
    pub fn examination(&self) -> PyResult<LiveExamination> {
        let refused = |reason| refuse(format!("{reason}. Check the calibration"));
        LiveExamination::new(&self.rig, self.rectification.as_deref()).map_err(refused)
    }

    /// Returns true if both pictures have the same size, and of raw cameras the rig's: others are
    /// the mapper's to refuse.
    pub fn suits(&self, frame: &StereoFrame<'_>) -> bool {
        let size = |width: usize, height: usize| (width as u32, height as u32);
        let left = size(frame.left.width(), frame.left.height());
        let right = size(frame.right.width(), frame.right.height());
        match &self.rectification {
            None => left == right,
            Some(of) => {
                let raw = [&of.left.raw, &of.right.raw].map(|raw| (raw.width, raw.height));
                raw == [left, right]
            }
        }
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

    /// Focal length, px.
    #[getter]
    fn focal_px(&self) -> f64 {
        self.rig.focal_px
    }

    /// Column of the principal point, px from the centre of the upper left pixel.
    #[getter]
    fn center_u_px(&self) -> f64 {
        self.rig.center_u_px
    }

    /// Row of the principal point, px from the centre of the upper left pixel.
    #[getter]
    fn center_v_px(&self) -> f64 {
        self.rig.center_v_px
    }

    /// Distance between the cameras, m.
    #[getter]
    fn baseline_m(&self) -> f64 {
        self.rig.baseline_m
    }

    /// Width and height of rectified pictures, where known.
    #[getter]
    fn size(&self) -> Option<(usize, usize)> {
        self.size
    }

    /// Width and height of raw pictures; None where pairs come rectified.
    #[getter]
    fn raw_size(&self) -> Option<(u32, u32)> {
        self.rectification.as_ref().map(|of| (of.left.raw.width, of.left.raw.height))
    }

    fn __richcmp__(&self, other: &Bound<'_, PyAny>, op: CompareOp) -> PyResult<Py<PyAny>> {
        let py = other.py();
        let Ok(other) = other.extract::<Self>() else { return Ok(py.NotImplemented()) };
        let result = match op {
            CompareOp::Eq => *self == other,
            CompareOp::Ne => *self != other,
            _ => return Ok(py.NotImplemented()),
        };
        Ok(PyBool::new(py, result).to_owned().into_any().unbind())
    }

    fn __hash__(&self) -> u64 {
        let StereoRig { focal_px, center_u_px, center_v_px, baseline_m } = self.rig;
        let mut hasher = DefaultHasher::new();
        // Both zeros are equal, and hash alike.
        let numbers = [focal_px, center_u_px, center_v_px, baseline_m].map(|value| value + 0.0);
        (numbers.map(f64::to_bits), self.size).hash(&mut hasher);
        hasher.finish()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let StereoRig { focal_px, center_u_px, center_v_px, baseline_m } = self.rig;
        let numbers = [focal_px, center_u_px, center_v_px, baseline_m];
        let raw = self.rectification.as_deref().map(pickled::numbers);
        let make = py.import("dynvox._dynvox")?.getattr("_rig")?;
        (make, (numbers, self.size, raw)).into_pyobject(py)
    }

    fn __repr__(&self) -> String {
        let StereoRig { focal_px, center_u_px, center_v_px, baseline_m } = self.rig;
        format!(
            "Rig(focal_px={focal_px}, center_u_px={center_u_px}, center_v_px={center_v_px}, \
             baseline_m={baseline_m})"
        )
    }
}

/// Reads a calibration in any format that `dynvox calibration` reads: one file with both cameras,
/// or one for each.
///
/// `image` is the raw pictures' size, where the files do not say it; `rectified` and
/// `rectified_focal_px` are as the options of that name.
#[pyfunction]
#[pyo3(signature = (*files, image=None, rectified=None, rectified_focal_px=None))]
pub fn read_calibration(
    files: Vec<Bound<'_, PyAny>>,
    image: Option<(u32, u32)>,
    rectified: Option<(u32, u32)>,
    rectified_focal_px: Option<f64>,
) -> PyResult<Rig> {
    if files.is_empty() {
        return Err(refuse(
            "no file of a calibration is given. Name one file with both cameras, or one for each",
        ));
    }
    let files = files.iter().map(|file| options::path("a file", file).map(PathBuf::from));
    let files = files.collect::<PyResult<Vec<_>>>()?;
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

/// The rig that was pickled.
#[pyfunction]
pub fn _rig(
    numbers: [f64; 4],
    size: Option<(usize, usize)>,
    raw: Option<pickled::Raw>,
) -> PyResult<Rig> {
    let [focal_px, center_u_px, center_v_px, baseline_m] = numbers;
    let rig = Rig::new(focal_px, center_u_px, center_v_px, baseline_m)?;
    let rectification = raw.map(|raw| pickled::rectification(&raw).map(Box::new)).transpose()?;
    Ok(Rig { size, rectification, ..rig })
}
