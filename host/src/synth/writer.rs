//! A synthetic world as a KITTI odometry folder with all its truth beside it.
//!
//! Everything goes into a sibling folder first, which takes the asked-for name when it is complete:
//! what stands under that name is whole.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use dynvox_core::geometry::Transform;
use image::ExtendedColorType::{L8, L16, Rgb8};
use image::ImageEncoder;
use image::codecs::png::PngEncoder;
use rayon::prelude::*;

use super::error::SynthError;
use super::frame::SynthFrame;
use super::world::World;
use crate::formats::calibration::{to_kalibr, to_toml};
use crate::owned::{self, DraftFolder, create_folder};

/// The calibration of raw images, in dynvox's own format.
const CALIBRATION_FILE: &str = "calibration.toml";

/// Writes the configured number of frames to `folder` in KITTI's odometry layout, as sequence 00:
///
/// - `sequences/00/image_{0,1}` grey and `image_{2,3}` colour pairs, `times.txt`, `calib.txt`
///   (`P0`..`P3`, `Tr` from LiDAR to camera), `velodyne/NNNNNN.bin`;
/// - `sequences/00/depth` (1/256 m) and `disp` (1/256 px) as 16-bit PNG, 0 where it is missing or
///   does not fit;
/// - `sequences/00/instances/NNNNNN.png` (k = the frame's instance k) and `.txt`
///   (`id class score x1 y1 x2 y2`);
/// - `sequences/00/objects.csv`: every car near the camera at every frame, `instance` being its
///   value in the masks;
/// - `poses/00.txt`;
/// - where images are raw, their calibration as `sequences/00/calibration.toml`, and as
///   `camchain.yaml` for lenses that Kalibr has. Depth, masks, poses and `calib.txt` are then of
///   the rectified pair.
///
/// `progress` receives (frames written, frames in all). Colour and grey cameras share one position,
/// so `P2` equals `P0` and `P3` equals `P1`.
///
/// # Errors
/// `folder` exists and is not empty, or a file cannot be written; nothing half-written stays
/// behind.
pub fn write_kitti(
    world: &dyn World,
    folder: &Path,
    mut progress: impl FnMut(u32, u32),
) -> Result<(), SynthError> {
    if fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) || folder.is_file() {
        return Err(SynthError::NotEmpty(folder.to_path_buf()));
    }
    let draft = DraftFolder::begin(folder).map_err(at(folder))?;
    write_all(world, draft.path(), &mut progress)?;
    draft.rename(folder).map_err(at(folder))
}

fn at(path: &Path) -> impl FnOnce(std::io::Error) -> SynthError {
    let path = path.to_path_buf();
    move |source| SynthError::Write { path, source }
}

fn write_all(
    world: &dyn World,
    folder: &Path,
    progress: &mut impl FnMut(u32, u32),
) -> Result<(), SynthError> {
    let sequence = folder.join("sequences/00");
    for name in
        ["image_0", "image_1", "image_2", "image_3", "depth", "disp", "velodyne", "instances"]
    {
        let path = sequence.join(name);
        create_folder(&path).map_err(at(&path))?;
    }
    create_folder(&folder.join("poses")).map_err(at(folder))?;
    let count = world.frames();
    // Tables are collected and written last: an interrupted run leaves no table that looks
    // complete.
    let (mut times, mut poses) = (String::new(), String::new());
    let mut objects = String::from("frame,id,instance,class");
    for k in 0..12 {
        let _ = write!(objects, ",t_world_object_{k}");
    }
    objects.push_str(",width_m,height_m,length_m,moving,speed_m_s\n");
    for index in 0..count {
        // Images and scan of one frame at the same time.
        let (frame, scan) = rayon::join(|| world.frame(index), || world.lidar(index));
        write_frame(world, &sequence, &frame, &scan)?;
        // Writing to a String cannot fail.
        let _ = writeln!(times, "{:.6e}", frame.time_s);
        let _ = writeln!(poses, "{}", row(&frame.t_world_camera, " "));
        for (number, object) in frame.objects.iter().enumerate() {
            let [width, height, length] = object.dimensions_m;
            let pose = row(&object.t_world_object, ",");
            let (id, instance, class) = (object.id, number + 1, object.class);
            let moving = u8::from(object.moving);
            let _ = writeln!(
                objects,
                "{index},{id},{instance},{class},{pose},{width:.4},{height:.4},{length:.4},{moving},{:.4}",
                object.speed_m_s
            );
        }
        progress(index + 1, count);
    }
    write(&sequence.join("times.txt"), times.as_bytes())?;
    write(&sequence.join("objects.csv"), objects.as_bytes())?;
    write(&sequence.join("calib.txt"), calibration(world).as_bytes())?;
    // Raw cameras come with their calibration, in this program's format and in Kalibr's.
    if let Some(calibration) = world.calibration() {
        write(&sequence.join(CALIBRATION_FILE), to_toml(calibration).as_bytes())?;
        if let Some(text) = to_kalibr(calibration) {
            write(&sequence.join("camchain.yaml"), text.as_bytes())?;
        }
    }
    write(&folder.join("poses/00.txt"), poses.as_bytes())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), SynthError> {
    owned::write(path, bytes).map_err(at(path))
}

/// The upper three rows of a motion, row by row.
fn row(motion: &Transform, separator: &str) -> String {
    let texts: Vec<String> =
        motion.matrix_3x4().as_flattened().iter().map(|value| format!("{value:.12e}")).collect();
    texts.join(separator)
}

fn calibration(world: &dyn World) -> String {
    let rig = world.rig();
    let mut text = String::new();
    for (name, shift) in [("P0", 0.0), ("P1", 1.0), ("P2", 0.0), ("P3", 1.0)] {
        let (f, u, v) = (rig.focal_px, rig.center_u_px, rig.center_v_px);
        let offset = -shift * rig.focal_baseline_px_m();
        let values = [f, 0.0, u, offset, 0.0, f, v, 0.0, 0.0, 0.0, 1.0, 0.0]
            .map(|value| format!("{value:.12e}"));
        let _ = writeln!(text, "{name}: {}", values.join(" "));
    }
    let _ = writeln!(text, "Tr: {}", row(&world.t_camera_lidar(), " "));
    text
}

fn write_frame(
    world: &dyn World,
    sequence: &Path,
    frame: &SynthFrame,
    scan: &[[f32; 4]],
) -> Result<(), SynthError> {
    let focal_baseline = world.rig().focal_baseline_px_m() as f32;
    // KITTI's convention: 256ths, 0 for nothing, so that 256 m and more do not fit.
    let fixed = |value: f32| {
        if value > 0.0 && value * 256.0 < 65_535.0 { (value * 256.0 + 0.5) as u16 } else { 0 }
    };
    let sixteen = |of: &dyn Fn(f32) -> f32| -> Vec<u8> {
        frame.depth_m.iter().flat_map(|&z| fixed(of(z)).to_ne_bytes()).collect()
    };
    let (images, truth) = (frame.image_size, [frame.width, frame.height]);
    let pictures = [
        ("image_0", frame.left_grey.clone(), L8, images),
        ("image_1", frame.right_grey.clone(), L8, images),
        ("image_2", frame.left_rgb.concat(), Rgb8, images),
        ("image_3", frame.right_rgb.concat(), Rgb8, images),
        ("depth", sixteen(&|z| z), L16, truth),
        ("disp", sixteen(&|z| if z > 0.0 { focal_baseline / z } else { 0.0 }), L16, truth),
        ("instances", frame.instances.clone(), L8, truth),
    ];
    let index = frame.index;
    // Encoding PNG takes longest: all images of a frame at the same time.
    pictures.par_iter().try_for_each(|(name, bytes, colour, [width, height])| {
        let path = sequence.join(name).join(format!("{index:06}.png"));
        let mut png = Vec::new();
        PngEncoder::new(&mut png)
            .write_image(bytes, *width as u32, *height as u32, *colour)
            .map_err(|error| at(&path)(std::io::Error::other(error)))?;
        write(&path, &png)
    })?;
    write(&sequence.join(format!("instances/{index:06}.txt")), instance_list(frame).as_bytes())?;
    let points: Vec<u8> = scan.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    write(&sequence.join(format!("velodyne/{index:06}.bin")), &points)
}

/// `id class score x1 y1 x2 y2` of every instance with a pixel.
fn instance_list(frame: &SynthFrame) -> String {
    let mut boxes = vec![(usize::MAX, usize::MAX, 0, 0); frame.objects.len()];
    for (pixel, &instance) in frame.instances.iter().enumerate() {
        if let Some(b) =
            usize::from(instance).checked_sub(1).and_then(|number| boxes.get_mut(number))
        {
            let (u, v) = (pixel % frame.width, pixel / frame.width);
            *b = (b.0.min(u), b.1.min(v), b.2.max(u + 1), b.3.max(v + 1));
        }
    }
    // An instance without a pixel is not listed.
    let mut text = String::from("# id class score x1 y1 x2 y2\n");
    for (number, (object, b)) in frame.objects.iter().zip(&boxes).enumerate() {
        if b.0 != usize::MAX {
            let _ = writeln!(
                text,
                "{} {} 1.00 {}.0 {}.0 {}.0 {}.0",
                number + 1,
                object.class,
                b.0,
                b.1,
                b.2,
                b.3
            );
        }
    }
    text
}
