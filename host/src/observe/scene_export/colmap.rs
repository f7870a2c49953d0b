//! COLMAP's text model. A pose maps world coordinates to the camera's.

use super::scene::ExportedScene;
use crate::owned;
use std::fmt::Write;
use std::io;
use std::path::Path;

/// Folder of the model.
const MODEL: &str = "sparse/0";

/// Writes `cameras.txt`, `images.txt` and `points3D.txt`.
///
/// # Errors
/// The disk refuses.
pub fn write(folder: &Path, scene: &ExportedScene) -> io::Result<()> {
    let model = folder.join(MODEL);
    owned::create_folder(&model)?;
    let ((width, height), f, [u, v]) = (scene.size, scene.rig.focal_px, scene.center_px());
    let cameras = format!(
        "# CAMERA_ID MODEL WIDTH HEIGHT fx fy cx cy\n1 PINHOLE {width} {height} {f} {f} {u} {v}\n"
    );
    owned::write(&model.join("cameras.txt"), cameras.as_bytes())?;
    // Each image has a second line, for matched points: it is empty.
    let mut images = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n".to_owned();
    for (id, (name, t_world_camera)) in (1..).zip(&scene.frames) {
        let t_camera_world = t_world_camera.inverse();
        let ([i, j, k, w], [x, y, z]) = (t_camera_world.rotation, t_camera_world.translation_m);
        // Writing to a string cannot fail.
        let _ = writeln!(images, "{id} {w} {i} {j} {k} {x} {y} {z} 1 {name}\n");
    }
    owned::write(&model.join("images.txt"), images.as_bytes())?;
    let mut points = "# POINT3D_ID X Y Z R G B ERROR TRACK[]\n".to_owned();
    for (id, ([x, y, z], [red, green, blue])) in (1..).zip(&scene.points) {
        let _ = writeln!(points, "{id} {x} {y} {z} {red} {green} {blue} 0");
    }
    owned::write(&model.join("points3D.txt"), points.as_bytes())
}
