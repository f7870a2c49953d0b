//! KITTI's projection matrices, with and without labels.
//!
//! KITTI's rectified camera k projects with `P_k = K [I | t_k]`, so the two cameras of a pair share
//! `K` and their baseline is `(P_left[0,3] - P_right[0,3]) / focal`.

use super::{RectifiedCameras, checked, unusable};
use crate::formats::bounds::CALIBRATION_TEXT;
use crate::formats::{FormatError, read_text_within};
use dynvox_core::geometry::StereoRig;
use nalgebra::{Matrix3, Matrix3x4, Vector3};
use std::path::Path;

/// A 3 x 4 projection matrix, row by row.
pub type Projection = [f64; 12];

/// The projection matrices of a KITTI calibration file, by camera number.
#[derive(Debug)]
pub struct KittiCalibration {
    cameras: [Option<Projection>; 4],
    /// `Tr` (also `Tr_velo_cam`, `Tr_velo_to_cam`): LiDAR to camera 0.
    lidar: Option<Projection>,
    /// `R0_rect` (also `R_rect`): what rectification turns camera 0 by.
    rectifying: Option<[f64; 9]>,
    path: std::path::PathBuf,
}

impl KittiCalibration {
    /// Reads lines `P0: 12 numbers`, or bare lines of 12 numbers for P0, P1, ... in order;
    /// `P_rect_00:` is another name of P0, `Tr:` and `R0_rect:` have several. Other lines are
    /// passed over.
    pub fn read(path: &Path) -> Result<Self, FormatError> {
        Self::parse(&read_text_within(path, &CALIBRATION_TEXT)?, path)
    }

    pub(super) fn parse(text: &str, path: &Path) -> Result<Self, FormatError> {
        let mut cameras = [None; 4];
        let (mut lidar, mut rectifying) = (None, None);
        let mut bare = 0;
        for (number, line) in text.lines().enumerate().map(|(at, line)| (at + 1, line.trim())) {
            let Some(first) = line.split_whitespace().next() else { continue };
            let slot = match first.trim_end_matches(':') {
                // A scan is optional: where these lines are damaged it is missed when it is asked
                // for.
                "Tr" | "Tr_velo_cam" | "Tr_velo_to_cam" => {
                    lidar = numbers(line);
                    continue;
                }
                "R_rect" | "R0_rect" | "R_rect_00" => {
                    rectifying = numbers(line);
                    continue;
                }
                // DrivingStereo numbers its two cameras 101 and 103.
                "P0" | "P_rect_00" | "P_rect_101" => 0,
                "P1" | "P_rect_01" | "P_rect_103" => 1,
                "P2" | "P_rect_02" => 2,
                "P3" | "P_rect_03" => 3,
                other if other.parse::<f64>().is_ok() => {
                    bare += 1;
                    bare - 1
                }
                _ => continue,
            };
            let values = line.split_whitespace().filter(|word| !word.starts_with('P'));
            let values: Option<Vec<f64>> = values
                .map(|word| word.parse().ok().filter(|value: &f64| value.is_finite()))
                .collect();
            let row = values.and_then(|values| Projection::try_from(values).ok()).ok_or_else(|| {
                let action = "Compare it with a calib.txt of the benchmark: one line per camera, \
                              `P0: ` and 12 numbers";
                unusable(path, format!("line {number} is not a projection matrix of 12 \
                                        numbers"), action)
            })?;
            if let Some(camera) = cameras.get_mut(slot) {
                *camera = Some(row);
            }
        }
        Ok(Self { cameras, lidar, rectifying, path: path.to_path_buf() })
    }

    /// The rig of the pair `left`, `right` (0, 1 grey; 2, 3 colour).
    pub fn rig(&self, left: usize, right: usize) -> Result<StereoRig, FormatError> {
        let cameras = self.cameras(left, right)?;
        if cameras.offset_px != 0.0 {
            return Err(self.differ(left, right));
        }
        checked(cameras.rig, &self.path)
    }

    /// The rectified cameras of a pair, whose principal points may lie apart along the rows. What
    /// the rig says is not checked.
    pub fn cameras(&self, left: usize, right: usize) -> Result<RectifiedCameras, FormatError> {
        let [p_left, p_right] = [self.camera(left)?, self.camera(right)?];
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-3 * (1.0 + a.abs());
        let shared =
            [0, 5, 6].iter().all(|&at| near(p_left[at], p_right[at])) && near(p_left[0], p_left[5]);
        if !shared {
            return Err(self.differ(left, right));
        }
        let rig = StereoRig {
            focal_px: p_left[0],
            center_u_px: p_left[2],
            center_v_px: p_left[6],
            baseline_m: (p_left[3] - p_right[3]) / p_left[0],
        };
        let offset_px = p_right[2] - p_left[2];
        let offset_px = if near(p_left[2], p_right[2]) { 0.0 } else { offset_px };
        Ok(RectifiedCameras { rig, offset_px, size: None })
    }

    fn differ(&self, left: usize, right: usize) -> FormatError {
        unusable(
            &self.path,
            format!("P{left} and P{right} differ in focal length or principal point"),
            "The images must be rectified to one pinhole camera: use the benchmark's rectified \
             images and their calibration",
        )
    }

    /// Returns the position of camera 0 in camera `camera`: `t` of `P = K [I | t]`, m.
    pub fn offset_m(&self, camera: usize) -> Result<Vector3<f64>, FormatError> {
        let p = self.camera(camera)?;
        let z = p[11];
        Ok(Vector3::new((p[3] - p[2] * z) / p[0], (p[7] - p[6] * z) / p[5], z))
    }

    /// LiDAR to rectified camera 0: `R0 * Tr`; `None` where the file does not say.
    pub fn t_camera_lidar(&self) -> Option<Matrix3x4<f64>> {
        let rectifying =
            self.rectifying.map_or_else(Matrix3::identity, |rows| Matrix3::from_row_slice(&rows));
        Some(rectifying * Matrix3x4::from_row_slice(&self.lidar?))
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Projection of camera `camera`.
    pub fn camera(&self, camera: usize) -> Result<Projection, FormatError> {
        self.cameras.get(camera).copied().flatten().ok_or_else(|| {
            let action = format!(
                "Add the line `P{camera}: ` with the 12 numbers of that camera's projection matrix"
            );
            unusable(&self.path, format!("it has no P{camera}"), action)
        })
    }
}

/// The numbers of a line after its label, if there are `N`, all finite.
fn numbers<const N: usize>(line: &str) -> Option<[f64; N]> {
    let values = line
        .split_whitespace()
        .skip(1)
        .map(|word| word.parse().ok().filter(|value: &f64| value.is_finite()));
    values.collect::<Option<Vec<f64>>>()?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREY: &str = "718 0 607 0 0 718 185 0 0 0 1 0\n718 0 607 -386.1 0 718 185 0 0 0 1 0\n";

    #[test]
    fn reads_lines_with_and_without_labels_alike() {
        let path = Path::new("calib.txt");
        let labelled: String = GREY
            .lines()
            .zip(["P0:", "P1:"])
            .map(|(line, label)| format!("{label} {line}\n"))
            .collect::<String>()
            + "Tr: 1 2 3\nR_rect 1 0\n";
        let a = KittiCalibration::parse(GREY, path).unwrap().rig(0, 1).unwrap();
        let b = KittiCalibration::parse(&labelled, path).unwrap().rig(0, 1).unwrap();
        assert_eq!(a, b);
        assert!((a.baseline_m - 386.1 / 718.0).abs() < 1e-12);
    }

    #[test]
    fn names_the_camera_that_is_missing_and_the_baseline_that_is_not_positive() {
        let path = Path::new("calib.txt");
        let one = KittiCalibration::parse(GREY.lines().next().unwrap(), path).unwrap();
        assert!(one.rig(0, 1).unwrap_err().to_string().contains("no P1"));
        let two = KittiCalibration::parse(GREY, path).unwrap();
        assert!(two.rig(2, 3).unwrap_err().to_string().contains("no P2"));
        let message = two.rig(1, 0).unwrap_err().to_string();
        assert!(
            message.contains("baseline is -0.5") && message.contains("exchange the two cameras"),
            "{message}"
        );
        let apart = GREY.replacen("718 0 607 -386.1", "728 0 607 -386.1", 1);
        let apart = KittiCalibration::parse(&apart, path).unwrap().rig(0, 1).unwrap_err();
        assert!(apart.to_string().contains("P0 and P1 differ in focal length"), "{apart}");
        let short = KittiCalibration::parse("P0: 1 2 3\n", path).unwrap_err().to_string();
        assert!(short.contains("line 1"), "{short}");
    }

    #[test]
    fn a_camera_beside_the_first_knows_its_place() {
        let text =
            "P0: 700 0 600 0 0 700 180 0 0 0 1 0\nP2: 700 0 600 43.4 0 700 180 0.5 0 0 1 0.0025\n";
        let offset = KittiCalibration::parse(text, Path::new("c")).unwrap().offset_m(2).unwrap();
        assert!(
            (offset - Vector3::new((43.4 - 1.5) / 700.0, (0.5 - 0.45) / 700.0, 0.0025)).norm()
                < 1e-12
        );
    }
}
