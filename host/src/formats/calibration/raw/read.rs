//! Reading files by the first format that matches them.

use super::files::Files;
use super::format::Cameras;
use super::{CALIBRATION_FORMATS, CalibrationFormat, Placement, RectifiedCameras};
use super::{StereoCalibration, check, ros};
use crate::formats::bounds::CALIBRATION_TEXT;
use crate::formats::calibration::hints::{CalibrationHints, LensFamily};
use crate::formats::{FormatError, read_bytes_within};
use std::path::{Path, PathBuf};

/// Most files of one calibration.
const MAX_FILES: usize = 4;

/// The files of a calibration, as text, with what a person says of them.
#[derive(Clone, Debug)]
pub struct CalibrationFiles {
    files: Vec<(PathBuf, String)>,
    hints: CalibrationHints,
    /// True if images come rectified by the projection matrices.
    rectified: bool,
}

/// A calibration as it was read.
#[derive(Clone, Debug)]
pub struct CalibrationRead {
    /// The cameras, in metres and pixels.
    pub cameras: Cameras,
    /// Name of the format.
    pub format: &'static str,
    /// The first file, to name it.
    pub path: PathBuf,
    /// Sentences about what was guessed.
    pub guesses: Vec<String>,
    /// Lens that was guessed, if one was.
    pub guessed_lens: Option<LensFamily>,
}

impl CalibrationFiles {
    /// Reads one to four files.
    ///
    /// # Errors
    /// A file cannot be read, or there are too few or too many.
    pub fn read(paths: &[PathBuf], hints: CalibrationHints) -> Result<Self, FormatError> {
        if !(1..=MAX_FILES).contains(&paths.len()) {
            let first = paths.first().map_or(Path::new(""), PathBuf::as_path);
            let reason = format!("a calibration is 1 to {MAX_FILES} files");
            let action =
                "Give one file with both cameras, or --calibration LEFT --calibration RIGHT";
            return Err(FormatError::content(first, reason, action));
        }
        let file = |path: &PathBuf| Ok((path.clone(), text_of(path)?));
        let files = paths.iter().map(file).collect::<Result<_, FormatError>>()?;
        Ok(Self { files, hints, rectified: false })
    }

    /// Takes a left and a right `CameraInfo`, as the texts `camera_calibration` writes. `path`
    /// names their source in errors. `rectified` says that the images are.
    pub fn from_camera_infos(
        path: &Path,
        texts: &[String; 2],
        rectified: bool,
        hints: CalibrationHints,
    ) -> Self {
        let files = texts.iter().map(|text| (path.to_path_buf(), text.clone())).collect();
        Self { files, hints, rectified }
    }

    /// Answers of a person to what the files leave open.
    pub fn hints(&self) -> CalibrationHints {
        self.hints
    }

    /// Path of the first file.
    pub fn path(&self) -> &Path {
        self.files.first().map_or(Path::new(""), |(path, _)| path)
    }

    /// The files read as if their lenses were of a family.
    pub(in crate::formats::calibration) fn of_family(&self, family: LensFamily) -> Self {
        let hints = CalibrationHints { lens_model: Some(family), ..self.hints };
        Self { hints, ..self.clone() }
    }

    /// The cameras, checked. `image_size` is the images' where it is known.
    ///
    /// # Errors
    /// Names the file, the fault and the next action.
    pub fn cameras(&self, image_size: Option<[u32; 2]>) -> Result<CalibrationRead, FormatError> {
        self.attempt(image_size).0
    }

    /// Tells whether only the size of the images is missing to read the cameras.
    pub(in crate::formats::calibration) fn lacks_size(&self) -> bool {
        self.attempt(None).1
    }

    /// Tells whether the files are of a known format.
    pub(in crate::formats::calibration) fn is_known(&self) -> bool {
        let files = Files::new(&self.files, self.hints, None);
        CALIBRATION_FORMATS.iter().any(|format| (format.matches)(&files))
    }

    /// The cameras, and whether a reader asked in vain for the size of the images.
    fn attempt(
        &self,
        image_size: Option<[u32; 2]>,
    ) -> (Result<CalibrationRead, FormatError>, bool) {
        let files = Files::new(&self.files, self.hints, image_size);
        let cameras = self.in_metres(&files);
        let (path, (guesses, lacks_size, guessed_lens)) =
            (self.path().to_path_buf(), files.noted());
        let read = cameras.map(|(cameras, format)| CalibrationRead {
            cameras,
            format,
            path,
            guesses,
            guessed_lens,
        });
        (read, lacks_size)
    }

    /// The cameras in metres, left first, and the name of their format.
    fn in_metres(&self, files: &Files<'_>) -> Result<(Cameras, &'static str), FormatError> {
        let format = CALIBRATION_FORMATS.iter().find(|format| (format.matches)(files));
        let format = format.ok_or_else(|| files.refuse(&known_formats()))?;
        let read = if self.rectified { ros::read_rectified } else { format.read };
        let unit = self.hints.unit.unwrap_or(format.unit);
        let mut cameras = read(files)?.scaled(unit);
        if self.hints.swap.is_some_and(|swap| swap.calibration()) {
            cameras = cameras.exchanged();
        } else if files.right_comes_first() && check::is_exchanged(&cameras) {
            files.guess("the right camera's file comes first: exchanged".to_owned());
            cameras = cameras.exchanged();
        }
        if self.hints.vertical {
            cameras = cameras.vertical();
        }
        check::checked(cameras, files.path(), &self.hints)
            .map(|cameras| (simplified(cameras), format.name))
    }
}

/// Names and files of all formats.
fn known_formats() -> String {
    let known = |format: &&CalibrationFormat| {
        format!("{} ({})", format.name, format.files.replace('`', ""))
    };
    CALIBRATION_FORMATS.iter().map(known).collect::<Vec<_>>().join("; ")
}

/// The text of a file, which may be of Windows' making.
fn text_of(path: &Path) -> Result<String, FormatError> {
    let bound = &CALIBRATION_TEXT;
    let bytes = read_bytes_within(path, bound.what, bound.bytes)?;
    let too_long = |reason| FormatError::content(path, reason, "Check that it is the right file");
    bound.check_lines(&bytes).map_err(too_long)?;
    String::from_utf8(bytes).map_err(|_| {
        FormatError::content(
            path,
            "it is no text",
            "Write matrices as YAML or JSON, not as NumPy's or MATLAB's own files: \
             cv2.FileStorage(\"stereo.yml\", cv2.FILE_STORAGE_WRITE).write(\"K1\", K1), then D1, \
             K2, D2, R, T",
        )
    })
}

/// Raw cameras without distortion that are turned nowhere have rectified images.
fn simplified(cameras: Cameras) -> Cameras {
    let Cameras::Raw(calibration) = cameras else { return cameras };
    let Placement::Rectified { r_rectified_left, r_rectified_right, rig, size } =
        calibration.placement
    else {
        return cameras;
    };
    let straight = [r_rectified_left, r_rectified_right]
        .iter()
        .all(|r| (r - nalgebra::Matrix3::identity()).abs().max() < 1e-9);
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * (1.0 + b.abs());
    let same = |camera: &dynvox_core::rectify::RawCamera| {
        let ([fx, fy], [_, cy]) = (camera.lens.focal_px(), camera.lens.center_px());
        *camera.lens.model() == dynvox_core::rectify::LensModel::IDEAL
            && [camera.width, camera.height] == size
            && near(fx, rig.focal_px)
            && near(fy, rig.focal_px)
            && near(cy, rig.center_v_px)
    };
    let [left_u, right_u] =
        [&calibration.left, &calibration.right].map(|camera| camera.lens.center_px()[0]);
    if straight
        && same(&calibration.left)
        && same(&calibration.right)
        && near(left_u, rig.center_u_px)
        && near(right_u, rig.center_u_px)
    {
        return Cameras::Rectified(RectifiedCameras { rig, offset_px: 0.0, size: Some(size) });
    }
    cameras
}

impl CalibrationRead {
    /// The cameras as raw ones; rectified ones take the size of the images where the files do not
    /// say it.
    ///
    /// # Errors
    /// The size is not known, or the rig is none.
    pub fn raw(&self, image_size: Option<[u32; 2]>) -> Result<StereoCalibration, FormatError> {
        let cameras = match &self.cameras {
            Cameras::Raw(calibration) => return Ok(*calibration),
            Cameras::Rectified(cameras) => cameras,
        };
        let size = cameras.size.or(image_size).ok_or_else(|| {
            FormatError::content(
                &self.path,
                "it does not say the size of the images",
                "Give --image WxH",
            )
        })?;
        StereoCalibration::from_rectified(cameras, size, self.format).map_err(|problem| {
            FormatError::content(&self.path, problem.to_string(), "Check the calibration's numbers")
        })
    }

    /// One line of what was understood.
    pub fn sentence(&self) -> String {
        let (path, format) = (self.path.display(), self.format);
        match &self.cameras {
            Cameras::Rectified(RectifiedCameras { rig, offset_px, size }) => {
                let size = size.map_or(String::new(), |[w, h]| format!("{w} x {h}, "));
                let offset = match *offset_px {
                    0.0 => String::new(),
                    offset_px => format!(
                        "principal points {offset_px:.3} px apart, which is added to disparities, "
                    ),
                };
                format!(
                    "rectified, {size}focal length {:.2} px, baseline {:.4} m, {offset}from \
                     {path} ({format})",
                    rig.focal_px, rig.baseline_m
                )
            }
            Cameras::Raw(calibration) => {
                let [left, right] = [&calibration.left, &calibration.right];
                let model = |camera: &dynvox_core::rectify::RawCamera| {
                    camera.lens.model().name().replace('_', "-")
                };
                let models = match (model(left), model(right)) {
                    (left, right) if left == right => left,
                    (left, right) => format!("{left} and {right}"),
                };
                format!(
                    "raw, {models}, {} x {}, baseline {:.4} m, from {path} ({format})",
                    left.width,
                    left.height,
                    calibration.baseline_m()
                )
            }
        }
    }
}
