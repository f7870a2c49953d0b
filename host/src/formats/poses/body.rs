//! How a recording's left camera is mounted on the body whose poses its ground truth has.

use crate::formats::rows::numbers_of;
use crate::formats::{FormatError, read_text};
use dynvox_core::geometry::Transform;
use std::path::{Path, PathBuf};

/// File of the left camera in EuRoC's layout, from the folder of the ground truth.
const SENSOR: [&str; 3] = ["../cam0/sensor.yaml", "cam0/sensor.yaml", "mav0/cam0/sensor.yaml"];
/// Key of the camera's pose on the body, and of its numbers below it.
const KEYS: [&str; 2] = ["T_BS", "data"];

/// The file and `t_body_camera` of the recording that a file of poses belongs to; `None` where
/// there is no such file.
///
/// # Errors
/// The file cannot be read, or its `T_BS` is not sixteen numbers of a rigid motion.
pub(super) fn t_body_camera(poses: &Path) -> Result<Option<(PathBuf, Transform)>, FormatError> {
    let folder = poses.parent().unwrap_or(Path::new("."));
    let Some(file) = SENSOR.iter().map(|name| folder.join(name)).find(|file| file.is_file()) else {
        return Ok(None);
    };
    let text = read_text(&file)?;
    let pose = below(&text).and_then(|numbers| super::row::parse(&numbers).ok());
    match pose {
        Some((_, t_body_camera)) => Ok(Some((file, t_body_camera))),
        None => Err(FormatError::content(
            &file,
            "T_BS is not the sixteen numbers of a rigid motion",
            "Fetch the recording's sensor.yaml anew",
        )),
    }
}

/// The list of sixteen numbers below the keys, as one row.
fn below(text: &str) -> Option<String> {
    let [outer, inner] = KEYS;
    let (_, rest) = text.split_once(outer)?;
    let (_, rest) = rest.split_once(inner)?;
    let (list, _) = rest.split_once('[')?.1.split_once(']')?;
    let row = list.replace(',', " ").split_whitespace().collect::<Vec<_>>().join(" ");
    (numbers_of(&row)?.len() == 16).then_some(row)
}

#[cfg(test)]
mod tests {
    use crate::formats::read_poses;
    use dynvox_core::geometry::Transform;

    #[test]
    fn ground_truth_of_the_body_becomes_that_of_the_camera() {
        let root = tempfile::TempDir::new().unwrap();
        let folder = |name: &str| {
            let folder = root.path().join("mav0").join(name);
            std::fs::create_dir_all(&folder).unwrap();
            folder
        };
        let truth = folder("state_groundtruth_estimate0").join("data.csv");
        let row =
            |at: u64| format!("{},{},0,0,1,0,0,0", 1_403_636_580_838_555_648 + at * 5_000_000, at);
        let rest = ",0,0,0,0,0,0,0,0,0";
        let text =
            format!("#timestamp, p_RS_R_x [m], ...\r\n{}{rest}\r\n{}{rest}\r\n", row(0), row(1));
        std::fs::write(&truth, text).unwrap();
        let read = read_poses(&truth).unwrap();
        assert_eq!(read.poses[1].translation_m, [1.0, 0.0, 0.0]);
        assert!(read.notes.iter().any(|note| note.contains("no cam0/sensor.yaml")));
        let times_s = read.times_s.unwrap();
        assert!((times_s[1] - times_s[0] - 0.005).abs() < 1e-6 && times_s[0] > 1.4e9);
        // The camera stands 2 cm to the side, turned by a quarter about z.
        let sensor = folder("cam0").join("sensor.yaml");
        let yaml = "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, \
                    -0.02,\n    1.0, 0.0, 0.0, 0.01,\n    0, 0, 1, 0, 0, 0, 0, 1]\n";
        std::fs::write(&sensor, yaml).unwrap();
        let camera = read_poses(&truth).unwrap().poses[1];
        assert_eq!(camera.translation_m, [0.98, 0.01, 0.0]);
        assert!(
            (camera.inverse()
                * Transform::new([0.0, 0.0, std::f64::consts::FRAC_PI_2], [0.98, 0.01, 0.0]))
            .angle_rad()
                < 1e-7
        );
        std::fs::write(&sensor, "T_BS:\n  data: [1, 0]\n").unwrap();
        assert!(read_poses(&truth).unwrap_err().to_string().contains("sixteen numbers"));
    }
}
