//! Nerfstudio's `transforms.json`. Its cameras look along -z with y up, as OpenGL's.

use super::scene::ExportedScene;
use super::{IMAGES, MASKS};
use crate::owned;
use serde_json::json;
use std::fmt::Write;
use std::io;
use std::path::Path;

/// Name of the file of points.
const POINTS: &str = "points.ply";

/// Writes `transforms.json` and `points.ply`.
///
/// # Errors
/// The disk refuses.
pub fn write(folder: &Path, scene: &ExportedScene) -> io::Result<()> {
    let frames: Vec<_> = scene
        .frames
        .iter()
        .map(|(name, pose)| {
            // y and z of the camera are turned round, those of the world are not.
            let [x, y, z] = pose.matrix_3x4().map(|[a, b, c, at]| [a, -b, -c, at]);
            json!({
                "file_path": format!("{IMAGES}/{name}"),
                "mask_path": format!("{MASKS}/{name}"),
                "transform_matrix": [x, y, z, [0.0, 0.0, 0.0, 1.0]],
            })
        })
        .collect();
    let [u, v] = scene.center_px();
    let transforms = json!({
        "camera_model": "OPENCV", "w": scene.size.0, "h": scene.size.1,
        "fl_x": scene.rig.focal_px, "fl_y": scene.rig.focal_px, "cx": u, "cy": v,
        "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0,
        "ply_file_path": POINTS, "frames": frames,
    });
    owned::write(&folder.join("transforms.json"), &serde_json::to_vec_pretty(&transforms)?)?;
    let mut points = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
         end_header\n",
        scene.points.len()
    );
    for ([x, y, z], [red, green, blue]) in &scene.points {
        // Writing to a string cannot fail.
        let _ = writeln!(points, "{x} {y} {z} {red} {green} {blue}");
    }
    owned::write(&folder.join(POINTS), points.as_bytes())
}
