//! The list of recordings that a person writes.

use super::FleetError;
use super::manifest::{Given, rows_of, transform};
use crate::formats::bounds::SETTINGS_TEXT;
use crate::formats::{read_gnss, read_text_within};
use dynvox_core::geometry::Transform;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A list of recordings, as an example.
pub const RECORDINGS_EXAMPLE: &str = "\
arguments = [\"--memory\", \"256MiB\"]   # of `dynvox run`, for all

[[recording]]
name = \"monday\"
arguments = [\"recordings/monday\", \"--instances\", \"none\"]

[[recording]]
name = \"tuesday\"
arguments = [\"recordings/tuesday\"]
t_world_camera = [1, 0, 0, 5.2, 0, 1, 0, 0, 0, 0, 1, -3.1]   # its first camera in the world, a \
row of KITTI
part_frames = 100   # in parts, which bend where other recordings and fixes want it
epoch = 1   # where it contradicts recordings of epoch 0, a rule decides
# or where it lies by a receiver of satellites, a line of latitude, longitude, altitude for each \
frame: gnss = \"gnss.txt\"
";

/// The recordings to map.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recordings {
    /// Arguments of `dynvox run` for all of them.
    #[serde(default)]
    pub arguments: Vec<String>,
    /// Latitude and longitude, degrees, and altitude, m, of the world's origin; by default the
    /// first fix of the first recording with `gnss`.
    #[serde(default)]
    pub origin: Option<[f64; 3]>,
    /// One by one.
    #[serde(rename = "recording")]
    pub recordings: Vec<Recording>,
}

/// A recording.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recording {
    /// Name of the recording in tables.
    pub name: String,
    /// Arguments of `dynvox run`.
    pub arguments: Vec<String>,
    /// Pose of the first camera, camera to world; the world's origin if absent.
    #[serde(default)]
    pub t_world_camera: Option<[f64; 12]>,
    /// True if the poses of `--egomotion file:POSES` are in the world: the first of them is the
    /// first camera's.
    #[serde(default)]
    pub poses_in_world: bool,
    /// Fixes of a receiver of satellites: a file with a line a frame of the data set, or a
    /// recording of KITTI raw.
    #[serde(default)]
    pub gnss: Option<PathBuf>,
    /// The receiver's antenna, or the inertial system that gives the fixes, in the camera's axes,
    /// m: x right, y down, z ahead.
    #[serde(default)]
    pub antenna_m: [f64; 3],
    /// Frames of each of its maps, which overlap and can be moved apart; one rigid map if absent.
    #[serde(default)]
    pub part_frames: Option<usize>,
    /// The epoch it belongs to, such as 20261122: maps of different epochs are not averaged where
    /// they contradict one another.
    #[serde(default)]
    pub epoch: u32,
}

impl Recordings {
    /// Reads a list.
    ///
    /// # Errors
    /// The file cannot be read, or is no list of recordings.
    pub fn read(path: &Path) -> Result<Self, FleetError> {
        let text = read_text_within(path, &SETTINGS_TEXT)?;
        toml::from_str(&text).map_err(|error| {
            // TOML's messages have several lines with a picture of the place.
            let why = error.message().replace('\n', " ");
            FleetError::content(
                path,
                format!("is no list of recordings: {why}. An example:\n\n{RECORDINGS_EXAMPLE}"),
            )
        })
    }

    /// The world's origin, where a recording has fixes.
    pub(super) fn origin(&self) -> Result<Option<[f64; 3]>, FleetError> {
        // Only where no origin is given: it comes first.
        let Some(gnss) = self
            .recordings
            .iter()
            .find_map(|of| of.gnss.as_ref())
            .filter(|_| self.origin.is_none())
        else {
            return Ok(self.origin);
        };
        // Rows without a fix are skipped.
        let fixes = read_gnss(gnss).map_err(FleetError::Format)?;
        let first = fixes
            .first()
            .ok_or_else(|| FleetError::content(gnss, "has no fix. Give a file that has"))?;
        Ok(Some(first.geodetic))
    }
}

impl Recording {
    /// Returns the given pose; `first_pose` is the first of the recording's file of poses, and
    /// `follows` the id of the part before. The error says why it is missing.
    pub(super) fn given(
        &self,
        origin: Option<[f64; 3]>,
        first_pose: Option<&Transform>,
        follows: Option<String>,
    ) -> Result<Given, String> {
        let Self { name, t_world_camera, poses_in_world, gnss, antenna_m, .. } = self;
        // Exactly one of the three ways, or none for the identity.
        match (t_world_camera, poses_in_world, gnss, origin) {
            (None, false, Some(file), Some(origin)) => {
                Ok(Given::Gnss { file: file.clone(), antenna_m: *antenna_m, origin, follows })
            }
            (None, true, None, _) => {
                first_pose.map(|pose| Given::TWorldCamera(rows_of(pose))).ok_or_else(|| {
                    format!(
                        "has poses_in_world for {name}, whose poses are not given. Give \
                         `--egomotion`, `file:POSES` among its arguments"
                    )
                })
            }
            (given, false, None, _) => {
                if let Some(before) = follows {
                    return Ok(Given::Follows(before));
                }
                let rows = given.unwrap_or_else(|| rows_of(&Transform::IDENTITY));
                transform(&rows).ok_or_else(|| {
                    format!(
                        "has no rigid motion as t_world_camera of \
                    {name}"
                    )
                })?;
                Ok(Given::TWorldCamera(rows))
            }
            _ => Err(format!(
                "says more than once where {name} lies. Keep one of t_world_camera, \
                              poses_in_world and gnss"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example(text: &str) -> Result<Recordings, FleetError> {
        let root = tempfile::TempDir::new().unwrap();
        let path = root.path().join("recordings.toml");
        std::fs::write(&path, text).unwrap();
        Recordings::read(&path)
    }

    #[test]
    fn wrong_lists_and_motions_are_refused() {
        assert!(example("[[drives]]\n").unwrap_err().to_string().contains("[[recording]]"));
        let given = |list: &str| {
            example(list).unwrap().recordings[0].given(Some([49.0, 8.0, 0.0]), None, None)
        };
        let recording = "[[recording]]\nname = \"tuesday\"\narguments = []\n";
        // A rotation matrix with a 2 is none.
        let turned = "t_world_camera = [2, 0, 0, 5.2, 0, 1, 0, 0, 0, 0, 1, -3.1]\n";
        assert_eq!(
            given(&format!("{recording}{turned}")).unwrap_err(),
            "has no rigid motion as t_world_camera of tuesday"
        );
        let twice =
            given(&format!("{recording}poses_in_world = true\ngnss = \"here.txt\"\n")).unwrap_err();
        assert!(twice.contains("more than once where tuesday lies"), "{twice}");
        let without = given(&format!("{recording}poses_in_world = true\n")).unwrap_err();
        assert!(without.contains("Give `--egomotion`"), "{without}");
    }

    #[test]
    fn a_recording_lies_where_its_first_pose_or_its_fixes_say() {
        let pose = Transform::new([0.0, 0.3, 0.0], [80.0, 0.0, -7.0]);
        let given = |lines: &str| {
            let list =
                example(&format!("[[recording]]\nname = \"tuesday\"\narguments = []\n{lines}\n"))
                    .unwrap();
            list.recordings[0].given(Some([49.0, 8.0, 110.0]), Some(&pose), None).unwrap()
        };
        assert_eq!(given("poses_in_world = true"), Given::TWorldCamera(rows_of(&pose)));
        // Without anything said, the recording begins at the world's origin.
        assert_eq!(given(""), Given::TWorldCamera(rows_of(&Transform::IDENTITY)));
        let gnss = Given::Gnss {
            file: "fixes".into(),
            antenna_m: [0.0, -1.0, 0.5],
            origin: [49.0, 8.0, 110.0],
            follows: None,
        };
        assert_eq!(given("gnss = \"fixes\"\nantenna_m = [0, -1, 0.5]"), gnss);
    }

    #[test]
    fn the_world_begins_at_the_first_fix_unless_it_is_given() {
        let root = tempfile::TempDir::new().unwrap();
        let fixes = root.path().join("fixes.txt");
        // The first row has no fix.
        std::fs::write(&fixes, "-\n49 8 110\n48 8 110\n").unwrap();
        let recording =
            format!("[[recording]]\nname = \"tuesday\"\narguments = []\ngnss = {fixes:?}\n");
        assert_eq!(example(&recording).unwrap().origin().unwrap(), Some([49.0, 8.0, 110.0]));
        assert_eq!(
            example(&format!("origin = [1, 2, 3]\n{recording}")).unwrap().origin().unwrap(),
            Some([1.0, 2.0, 3.0])
        );
        std::fs::write(&fixes, "-\n").unwrap();
        assert!(
            example(&recording).unwrap().origin().unwrap_err().to_string().contains("has no fix")
        );
    }
}
