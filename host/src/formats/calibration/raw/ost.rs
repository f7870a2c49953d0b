//! `ost.txt`, which ROS's `camera_calibration` writes beside its YAML: both cameras in one file,
//! each with name, matrix, distortion, rectification and projection.

use super::files::Files;
use super::format::CalibrationFormat;
use super::{Placement, StereoCalibration, lens, ros, tree::Node, tree::Tree};
use crate::formats::FormatError;
use crate::formats::calibration::hints::LengthUnit;
use nalgebra::Matrix3;
use serde_json::{Map, Value, json};

/// ROS's text file.
pub static FORMAT: CalibrationFormat = CalibrationFormat {
    name: "ROS oST",
    files: "`ost.txt` of `camera_calibration`, both cameras in one file or one file for each",
    unit: LengthUnit::METRE,
    matches: |files| {
        files.text().contains("camera matrix\n") && files.text().contains("projection\n")
    },
    read: |files| read(files).map(Into::into),
    example: &[(
        "ost.txt",
        "# oST version 5.0 parameters

[image]

width
752

height
480

[narrow_stereo/left]

camera matrix
458.6 0 367.2
0 457.2 248.3
0 0 1

distortion
-0.28 0.07 0.0002 0.00002 0

rectification
1 0 0
0 1 0
0 0 1

projection
400 0 370 0
0 400 250 0
0 0 1 0

# oST version 5.0 parameters

[image]

width
752

height
480

[narrow_stereo/right]

camera matrix
458.6 0 367.2
0 457.2 248.3
0 0 1

distortion
-0.28 0.07 0.0002 0.00002 0

rectification
1 0 0
0 1 0
0 0 1

projection
400 0 370 -44
0 400 250 0
0 0 1 0
",
    )],
};

/// Headings within a camera.
const HEADINGS: [&str; 6] =
    ["width", "height", "camera matrix", "distortion", "rectification", "projection"];

/// Reads two cameras.
fn read(files: &Files<'_>) -> Result<StereoCalibration, FormatError> {
    let text: String = files.all().iter().map(|(_, text)| format!("{text}\n")).collect();
    let tree = Tree::of_values(cameras_of(&text), &text, files.path());
    let root = tree.root();
    let (Some(left), Some(right)) = (root.get("0"), root.get("1")) else {
        return Err(root.refuse("it is of one camera", "Give the other camera's file, too"));
    };
    let rotation = |node: Node<'_>| -> Result<Matrix3<f64>, FormatError> {
        Ok(Matrix3::from_row_slice(&node.need("rectification")?.array::<9>()?))
    };
    let size = |node: Node<'_>| -> Result<[u32; 2], FormatError> {
        Ok([node.need("width")?.pixels()?, node.need("height")?.pixels()?])
    };
    let camera = |node: Node<'_>| {
        let [fx, _, cx, _, fy, cy, ..] = node.need("camera matrix")?.array::<9>()?;
        let model = lens::radial_tangential(node, &node.need("distortion")?.numbers()?)?;
        lens::camera(node, [fx, fy, cx, cy], model, size(node)?)
    };
    let p_right = right.need("projection")?;
    let p_left = left.need("projection")?.array()?;
    Ok(StereoCalibration {
        left: camera(left)?,
        right: camera(right)?,
        placement: Placement::Rectified {
            r_rectified_left: rotation(left)?,
            r_rectified_right: rotation(right)?,
            rig: ros::rectified_rig(p_right, &p_left, &p_right.array()?)?.rig,
            size: size(left)?,
        },
        format: FORMAT.name,
    })
}

/// The cameras by their number, each with the numbers below its headings. A camera begins with its
/// width.
fn cameras_of(text: &str) -> Value {
    let mut cameras: Vec<Map<String, Value>> = Vec::new();
    let mut heading: Option<&str> = None;
    for line in text.lines().map(str::trim) {
        if HEADINGS.contains(&line) {
            if line == "width" {
                cameras.push(Map::new());
            }
            heading = Some(line);
            continue;
        }
        let numbers: Option<Vec<f64>> =
            line.split_whitespace().map(|word| word.parse().ok()).collect();
        let (Some(heading), Some(numbers)) = (heading, numbers) else {
            heading = None;
            continue;
        };
        if let Some(camera) = cameras.last_mut() {
            let list = camera.entry(heading).or_insert_with(|| Value::Array(Vec::new()));
            if let Value::Array(list) = list {
                list.extend(numbers.into_iter().map(|number| json!(number)));
            }
        }
    }
    for camera in &mut cameras {
        for side in ["width", "height"] {
            if let Some(number) = camera.get(side).and_then(|list| list.get(0)).cloned() {
                camera.insert(side.to_owned(), number);
            }
        }
    }
    let numbered = cameras.into_iter().enumerate();
    Value::Object(numbered.map(|(at, camera)| (at.to_string(), Value::Object(camera))).collect())
}
