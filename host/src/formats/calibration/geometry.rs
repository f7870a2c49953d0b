//! The cameras of a recording, from whichever files say it.

use super::raw::{CalibrationFiles, CalibrationRead, Cameras};
use super::{CalibrationHints, LensFamily, RectifiedSize, StereoCalibration, other_size};
use crate::formats::FormatError;
use dynvox_core::geometry::StereoRig;
use dynvox_core::rectify::Rectification;
use std::path::{Path, PathBuf};

/// Largest distance of a principal point from the middle of an image, as a share of its side, that
/// is no cause for doubt.
const CENTRAL: f64 = 0.2;
/// Distance from the middle, as a share of the side, at which both coordinates of a principal point
/// tell that the images had another size.
const OFF_CENTER: f64 = 0.15;
/// Largest difference of the two shares where images were only scaled.
const SAME_SCALE: f64 = 0.1;
/// Share by which rows agree better under another lens for it to be taken instead of the guess.
const BETTER: f64 = 0.8;

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
    /// Files, which are read when the size of the images is known.
    Files(Box<CalibrationFiles>),
}

/// Cameras for images of a size, and what is to be said about them.
#[derive(Clone, Debug)]
pub struct SettledCameras {
    /// The cameras, rectified or raw.
    pub cameras: CameraGeometry,
    /// Sentences: what was understood, and what was guessed.
    pub notes: Vec<String>,
}

/// Function that measures how far rows differ where pairs are rectified by a calibration, px;
/// `None` where nothing can be told.
pub type RowDifference<'f> = &'f dyn Fn(&StereoCalibration) -> Option<f64>;

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
    /// Reads a calibration of either kind. What only the size of the images tells is read when the
    /// cameras are settled.
    ///
    /// # Errors
    /// Names the file, the fault and the next action.
    pub fn read(paths: &[PathBuf], hints: CalibrationHints) -> Result<Self, FormatError> {
        let files = CalibrationFiles::read(paths, hints)?;
        match files.cameras(None) {
            Err(error) if !files.lacks_size() => Err(error),
            _ => Ok(Self::Files(Box::new(files))),
        }
    }

    /// Tells whether the cameras may have taken images of a size.
    pub fn suits(&self, size: (usize, usize)) -> bool {
        let central = |[u, v]: [f64; 2]| {
            let off = |center_px: f64, side: usize| (center_px / side as f64 - 0.5).abs();
            off(u, size.0) <= CENTRAL && off(v, size.1) <= CENTRAL
        };
        let raw = |calibration: &StereoCalibration| central(calibration.left.lens.center_px());
        match self {
            Self::Rectified(rig) => central([rig.center_u_px, rig.center_v_px]),
            Self::Raw { calibration, .. } => raw(calibration),
            Self::Files(files) => {
                files.cameras(Some(sides(size))).is_ok_and(|read| match &read.cameras {
                    Cameras::Rectified(cameras) => {
                        central([cameras.rig.center_u_px, cameras.rig.center_v_px])
                    }
                    Cameras::Raw(calibration) => raw(calibration),
                })
            }
        }
    }

    /// The cameras for images of a size. `rows` decides between lenses that files do not tell
    /// apart.
    ///
    /// # Errors
    /// The calibration is for images of another size, or cannot be used.
    pub fn settled(
        self,
        size: (usize, usize),
        rows: Option<RowDifference<'_>>,
    ) -> Result<SettledCameras, FormatError> {
        let Self::Files(files) = self else {
            return Ok(SettledCameras { cameras: self, notes: Vec::new() });
        };
        let size = sides(size);
        let mut read = files.cameras(Some(size))?;
        let by_rows = read.guessed_lens.zip(rows);
        if let Some((note, other)) =
            by_rows.and_then(|(guess, rows)| by_images(&files, &read, guess, size, rows))
        {
            read = other.unwrap_or(read);
            read.guesses = vec![note];
        }
        let mut notes = vec![read.sentence()];
        notes.append(&mut read.guesses.clone());
        let path = read.path.clone();
        let cameras = match &read.cameras {
            Cameras::Rectified(cameras) => {
                if let Some(known) = cameras.size.filter(|known| *known != size) {
                    return Err(other_size(&path, known, size));
                }
                central(&path, [cameras.rig.center_u_px, cameras.rig.center_v_px], size)?;
                if cameras.offset_px == 0.0 {
                    Self::Rectified(cameras.rig)
                } else {
                    Self::Raw { calibration: Box::new(read.raw(Some(size))?), path }
                }
            }
            Cameras::Raw(calibration) => {
                calibration.fits(&path, size)?;
                central(&path, calibration.left.lens.center_px(), size)?;
                Self::Raw { calibration: Box::new(*calibration), path }
            }
        };
        Ok(SettledCameras { cameras, notes })
    }

    /// Answers of a person; none where the cameras are not of files.
    pub fn hints(&self) -> CalibrationHints {
        match self {
            Self::Files(files) => files.hints(),
            _ => CalibrationHints::default(),
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
            Self::Files(_) => self.clone().settled(size, None)?.cameras.fitted(size, rectified),
            Self::Raw { calibration, path } => {
                calibration.fits(path, sides(size))?;
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

fn sides((width, height): (usize, usize)) -> [u32; 2] {
    [width, height].map(|side| u32::try_from(side).unwrap_or(u32::MAX))
}

/// Refuses a principal point whose both coordinates say that the images had another size.
fn central(path: &Path, [u, v]: [f64; 2], [width, height]: [u32; 2]) -> Result<(), FormatError> {
    let [share_u, share_v] = [u / f64::from(width), v / f64::from(height)];
    let off = |share: f64| (share - 0.5).abs() > OFF_CENTER;
    if !(off(share_u) && off(share_v) && (share_u - share_v).abs() < SAME_SCALE) {
        return Ok(());
    }
    let scale = 1.0 / (share_u + share_v);
    Err(FormatError::content(
        path,
        format!(
            "its principal point ({u:.1}, {v:.1}) px is that of images of about {:.0} x {:.0} px, \
             but these are {width} x {height} px",
            2.0 * u,
            2.0 * v
        ),
        format!(
            "Give the calibration of these images; if they were only scaled, multiply its focal \
             length and principal point by {scale:.4}"
        ),
    ))
}

/// The lens by which rows agree better, as a note and, if it is not the guessed one, the cameras.
fn by_images(
    files: &CalibrationFiles,
    read: &CalibrationRead,
    guess: LensFamily,
    size: [u32; 2],
    rows: RowDifference<'_>,
) -> Option<(String, Option<CalibrationRead>)> {
    let guessed_px = rows(&read.raw(Some(size)).ok()?)?;
    let other = files.of_family(guess.other()).cameras(Some(size)).ok()?;
    let other_px = rows(&other.raw(Some(size)).ok()?);
    let better = other_px.is_some_and(|other_px| other_px < BETTER * guessed_px);
    let (family, px, against) = match (better, other_px) {
        (true, Some(other_px)) => (guess.other(), other_px, Some(guessed_px)),
        (_, other_px) => (guess, guessed_px, other_px),
    };
    let against = against.map_or("none match".to_owned(), |px| format!("{px:.2} px"));
    let note = format!(
        "guess: {} lenses (rows agree to {px:.2} px, by {} ones {against}); --lens-model {} says \
         otherwise",
        family.name(),
        family.other().name(),
        family.other().name()
    );
    Some((note, better.then_some(other)))
}
