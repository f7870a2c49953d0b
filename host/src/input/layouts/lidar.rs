//! Files of LiDAR scans beside the images.
//!
//! A scan is a file of `f32` quadruples, little endian: x, y, z in the sensor's axes in metres, and
//! reflectance. `Tr` carries them to the unrectified camera 0, `R0` turns them into the rectified
//! one; odometry's calibration has `R0` multiplied in.

use crate::formats::bounds::MAX_SCAN_BYTES;
use crate::formats::calibration::{KittiCalibration, Projection};
use crate::formats::{FormatError, read_bytes_within};
use crate::input::source::{InputError, LidarScan};
use nalgebra::{Matrix3x4, Vector4};
use std::path::PathBuf;

/// Bytes of a point in a file.
const POINT_BYTES: usize = 16;

/// A folder of scans, `NNNNNN.bin` by the images' names.
#[derive(Debug)]
pub struct LidarFiles {
    pub folder: PathBuf,
    /// Sensor to rectified camera 0; `None` where the calibration does not tell.
    pub t_camera_lidar: Option<Matrix3x4<f64>>,
    pub cameras: [Projection; 2],
    /// The calibration, to name it.
    pub calibration: PathBuf,
}

impl LidarFiles {
    /// The scans in `folder`, if there is such a folder.
    pub fn at(
        folder: PathBuf,
        calibration: &KittiCalibration,
        [left, right]: [usize; 2],
    ) -> Result<Option<Self>, InputError> {
        if !folder.is_dir() {
            return Ok(None);
        }
        Ok(Some(Self {
            folder,
            t_camera_lidar: calibration.t_camera_lidar(),
            cameras: [calibration.camera(left)?, calibration.camera(right)?],
            calibration: calibration.path().to_path_buf(),
        }))
    }

    /// Returns true if there is a scan of that name.
    pub fn has(&self, stem: &str) -> bool {
        self.path(stem).is_file()
    }

    fn path(&self, stem: &str) -> PathBuf {
        self.folder.join(format!("{stem}.bin"))
    }

    /// Reads the scan of that name; `None` where there is no file.
    pub fn read(&self, stem: &str) -> Result<Option<LidarScan>, InputError> {
        let path = self.path(stem);
        if !path.is_file() {
            return Ok(None);
        }
        let to_camera = self.t_camera_lidar.ok_or_else(|| {
            FormatError::content(
                &self.calibration,
                "it does not say where the LiDAR is",
                "Add the line `Tr: ` with the 12 numbers that carry LiDAR points to camera 0 (the benchmark's calibration archive has it), \
                     or run without --evaluate",
            )
        })?;
        let bytes = read_bytes_within(&path, "a LiDAR scan", MAX_SCAN_BYTES)?;
        let (points, rest) = bytes.as_chunks::<POINT_BYTES>();
        if !rest.is_empty() {
            let reason = format!(
                "its {} bytes are not a whole number of points of {POINT_BYTES} bytes",
                bytes.len()
            );
            return Err(FormatError::content(
                &path,
                reason,
                "Fetch the scan anew, or remove it: frames without one are not evaluated",
            )
            .into());
        }
        let number = |point: &[u8; POINT_BYTES], at: usize| {
            f64::from(f32::from_le_bytes([
                point[4 * at],
                point[4 * at + 1],
                point[4 * at + 2],
                point[4 * at + 3],
            ]))
        };
        let points_m = points.iter().map(|point| {
            let homogeneous =
                Vector4::new(number(point, 0), number(point, 1), number(point, 2), 1.0);
            (to_camera * homogeneous).into()
        });
        Ok(Some(LidarScan { points_m: points_m.collect(), cameras: self.cameras }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectification_turns_points_and_scaling_keeps_their_pixels() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("calib.txt");
        // The sensor looks along x; rectification turns by a right angle about z, so that an
        // omitted turn is obvious.
        let text = "P0: 700 0 600 0 0 700 180 0 0 0 1 0\nP1: 700 0 600 -350 0 700 180 0 0 0 1 0\n\
                    R0_rect: 0 -1 0 1 0 0 0 0 1\nTr_velo_to_cam: 0 -1 0 0 0 0 -1 0 1 0 0 -0.25\n";
        std::fs::write(&path, text).unwrap();
        let calibration = KittiCalibration::read(&path).unwrap();
        let scans = folder.path().join("velodyne");
        std::fs::create_dir(&scans).unwrap();
        let point: Vec<u8> =
            [10.25f32, -2.0, 1.0, 0.5].iter().flat_map(|value| value.to_le_bytes()).collect();
        std::fs::write(scans.join("000003.bin"), &point).unwrap();
        std::fs::write(scans.join("000004.bin"), &point[..15]).unwrap();
        let files = LidarFiles::at(scans, &calibration, [0, 1]).unwrap().unwrap();
        let scan = files.read("000003").unwrap().unwrap();
        // Camera 0 sees it at (2, -1, 10) before it is rectified.
        assert_eq!(scan.points_m, [[1.0, 2.0, 10.0]]);
        assert!(
            files.read("000002").unwrap().is_none() && files.has("000004") && !files.has("000002")
        );
        assert!(files.read("000004").unwrap_err().to_string().contains("whole number of points"));
        let half = scan.scaled(0.5);
        // Pixel 670 is the centre of an area that ends up around 334.75.
        let column = (half.cameras[0][0] * 1.0 + half.cameras[0][2] * 10.0) / 10.0;
        assert!((column - (670.5 * 0.5 - 0.5)).abs() < 1e-9, "{column}");
        let disparity = column
            - (half.cameras[1][0] * 1.0 + half.cameras[1][2] * 10.0 + half.cameras[1][3]) / 10.0;
        assert!((disparity - 17.5).abs() < 1e-9);
    }

    #[test]
    fn a_calibration_without_the_sensor_says_what_to_add() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("calib.txt");
        std::fs::write(
            &path,
            "P0: 700 0 600 0 0 700 180 0 0 0 1 0\nP1: 700 0 600 -350 0 700 180 0 0 0 1 0\n",
        )
        .unwrap();
        std::fs::write(folder.path().join("000000.bin"), []).unwrap();
        let calibration = KittiCalibration::read(&path).unwrap();
        let files =
            LidarFiles::at(folder.path().to_path_buf(), &calibration, [0, 1]).unwrap().unwrap();
        let message = files.read("000000").unwrap_err().to_string();
        assert!(message.contains("where the LiDAR is") && message.contains("`Tr: `"), "{message}");
    }
}
