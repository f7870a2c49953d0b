//! Labels of KITTI's tracking benchmark: boxes in space, in the rectified camera's frame, made into
//! objects of the world by the camera's poses.
//!
//! A row is
//! `frame track type truncated occluded alpha x1 y1 x2 y2 height width length x y z rotation_y`.
//! The place is the middle of the box's foot; `rotation_y` turns the car's axis, which lies along
//! x, about y. Here z is forward, so a quarter turn is added.

use crate::formats::read_text;
use crate::input::source::{InputError, ObjectsTruth, TrueObject};
use dynvox_core::geometry::Transform;
use dynvox_core::masks::PixelBox;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::path::Path;

/// Slower than this a labelled object is static: labels of parked cars wander, m/s.
const STATIC_M_S: f64 = 1.5;
/// Frames before and after over which a label's speed is taken.
const AROUND: usize = 3;

/// Reads a file of labels; `t_world_camera` has a pose of the left camera for each frame, on the
/// labels' scale. Labels are in camera 0: `zero_m` is where it stands as seen from the left camera.
///
/// # Errors
/// The file cannot be read, or a line is not a label.
pub fn read_labels(
    path: &Path,
    t_world_camera: &[Transform],
    zero_m: Vector3<f64>,
    interval_s: f64,
) -> Result<Vec<ObjectsTruth>, InputError> {
    let text = read_text(path)?;
    let mut frames: Vec<ObjectsTruth> = t_world_camera
        .iter()
        .map(|pose| ObjectsTruth {
            t_world_camera: *pose,
            objects: Vec::new(),
            unlabelled: Vec::new(),
        })
        .collect();
    for (at, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let wrong = || InputError::Table {
            path: path.to_path_buf(),
            reason: format!("line {} is not a label of the tracking benchmark", at + 1),
            action: "Fetch the labels anew, or move them away: they are optional".into(),
        };
        let (frame, object) = label(line).ok_or_else(wrong)?;
        let Some(truth) = frames.get_mut(frame) else { continue };
        match object {
            Labelled::Object(object) => {
                let t_world_object = truth.t_world_camera
                    * Transform::from_translation(zero_m.into())
                    * object.t_world_object;
                truth.objects.push(TrueObject { t_world_object, ..object });
            }
            Labelled::Nothing(pixels) => truth.unlabelled.push(pixels),
        }
    }
    give_speeds(&mut frames, interval_s);
    Ok(frames)
}

/// Contents of a row.
enum Labelled {
    /// An object, its position still in camera 0.
    Object(TrueObject),
    /// A region without labels.
    Nothing(PixelBox),
}

/// Frame and object of a row.
fn label(line: &str) -> Option<(usize, Labelled)> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let (frame, kind) = (words.first()?.parse().ok()?, *words.get(2)?);
    let numbers: Option<Vec<f64>> =
        words.get(6..17)?.iter().map(|word| word.parse().ok()).collect();
    let [x1, y1, x2, y2, height, width, length, x, y, z, turn] = numbers?[..] else { return None };
    let pixels = PixelBox {
        left: x1 as i32,
        top: y1 as i32,
        width: (x2 - x1) as i32 + 1,
        height: (y2 - y1) as i32 + 1,
    };
    if kind == "DontCare" {
        return Some((frame, Labelled::Nothing(pixels)));
    }
    let object = TrueObject {
        id: words.get(1)?.parse().ok()?,
        instance: 0,
        pixels,
        t_world_object: Transform::new([0.0, turn + std::f64::consts::FRAC_PI_2, 0.0], [x, y, z]),
        dimensions_m: [width, height, length],
        moving: false,
        speed_m_s: 0.0,
    };
    Some((frame, Labelled::Object(object)))
}

/// Each object's speed, from where it is some frames before and after.
fn give_speeds(frames: &mut [ObjectsTruth], interval_s: f64) {
    let mut ways = BTreeMap::<u32, Vec<(usize, Vector3<f64>)>>::new();
    for (frame, truth) in frames.iter().enumerate() {
        for object in &truth.objects {
            ways.entry(object.id)
                .or_default()
                .push((frame, Vector3::from(object.t_world_object.translation_m)));
        }
    }
    for (frame, truth) in frames.iter_mut().enumerate() {
        for object in &mut truth.objects {
            let near = || {
                ways.get(&object.id)
                    .into_iter()
                    .flatten()
                    .filter(|(at, _)| at.abs_diff(frame) <= AROUND)
            };
            if let (Some((first, from)), Some((last, to))) = (near().next(), near().next_back())
                && last > first
            {
                object.speed_m_s = (to - from).norm() / ((last - first) as f64 * interval_s);
                object.moving = object.speed_m_s > STATIC_M_S;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_car_that_keeps_its_distance_is_as_fast_as_the_camera() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("0000.txt");
        let row = |frame: u32| {
            format!(
                "{frame} 7 Car 0 0 0 10.0 20.0 30.0 50.0 1.5 1.6 4.0 2.0 1.6 {} -1.57\n",
                20.0 + 0.2 * f64::from(frame)
            )
        };
        let text: String = (0..5)
            .map(|frame| {
                row(frame)
                    + &format!(
                        "{frame} -1 DontCare -1 -1 -10 0 0 9 9 -1 -1 -1 -1000 -1000 -1000 -10\n"
                    )
            })
            .collect();
        std::fs::write(&path, text).unwrap();
        let poses: Vec<Transform> =
            (0..5).map(|frame| Transform::from_translation([0.0, 0.0, f64::from(frame)])).collect();
        let truth = read_labels(&path, &poses, Vector3::new(0.06, 0.0, 0.003), 0.1).unwrap();
        assert_eq!(truth.len(), 5);
        let car = &truth[2].objects[..];
        assert!(
            car.len() == 1
                && car[0].id == 7
                && car[0].moving
                && (car[0].speed_m_s - 12.0).abs() < 1e-9,
            "{car:?}"
        );
        assert!(
            (car[0].t_world_object.rotate(Vector3::z()) - Vector3::z()).norm() < 1e-3,
            "its z points forward"
        );
        let position = Vector3::from(car[0].t_world_object.translation_m)
            - Vector3::from(poses[2].translation_m);
        assert!(
            (position - Vector3::new(2.06, 1.6, 20.403)).norm() < 1e-9,
            "seen from the left camera, not from camera 0: {position}"
        );
        assert_eq!(truth[2].unlabelled, [PixelBox { left: 0, top: 0, width: 10, height: 10 }]);
        std::fs::write(&path, "0 7 Car 0 0\n").unwrap();
        assert!(
            read_labels(&path, &poses, Vector3::new(0.06, 0.0, 0.003), 0.1)
                .unwrap_err()
                .to_string()
                .contains("line 1 is not a label")
        );
    }
}
