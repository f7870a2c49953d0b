//! Which topics are the two cameras.

use super::container::Topic;
use super::recording::Recording;
use crate::formats::bounds::MAX_BAG_TOPICS;
use crate::input::data_set::Topics;
use crate::input::source::InputError;

/// Names of a camera's side in topics, left and right.
const SIDES: [[&str; 2]; 7] = [
    ["left", "right"],
    ["infra1", "infra2"],
    ["cam0", "cam1"],
    ["cam_0", "cam_1"],
    ["camera0", "camera1"],
    ["image_0", "image_1"],
    ["Left", "Right"],
];

/// The topics of the left and the right camera: as given, else the only two image topics whose
/// names differ in the side alone. Rectified ones are preferred, then those that are not
/// compressed.
///
/// # Errors
/// A topic is not there, or there is no such pair.
pub fn choose(recording: &Recording, given: Option<&Topics>) -> Result<[String; 2], InputError> {
    let images: Vec<Topic> =
        recording.topics().iter().filter(|topic| topic.is_image()).cloned().collect();
    if images.len() > MAX_BAG_TOPICS {
        let (found, most) = (images.len(), MAX_BAG_TOPICS);
        return Err(InputError::bag(
            recording.path(),
            format!(
                "it has {found} topics with images; at most {most} are read. Keep those of the two \
                 cameras: `mcap filter`"
            ),
        ));
    }
    let names = images.iter().map(|topic| topic.name.as_str()).collect::<Vec<_>>().join(", ");
    if let Some(Topics(sides)) = given {
        return match sides.iter().find(|side| images.iter().all(|topic| topic.name != **side)) {
            None => Ok(sides.clone()),
            Some(side) => Err(InputError::bag(
                recording.path(),
                format!("it has no images at {side}. Its image topics are {names}"),
            )),
        };
    }
    let mut pairs: Vec<[&Topic; 2]> = Vec::new();
    for left in &images {
        let partner = |[l, r]: &[&str; 2]| {
            let name = left.name.contains(l).then(|| left.name.replace(l, r))?;
            images.iter().find(|right| right.name == name && right.kind == left.kind)
        };
        pairs.extend(SIDES.iter().find_map(partner).map(|right| [left, right]));
    }
    let rank = |[left, _]: &[&Topic; 2]| {
        let debug = left.name.contains("depth") || left.name.contains("debug");
        (
            debug,
            !left.name.contains("rect"),
            left.kind.ends_with("CompressedImage"),
            left.name.contains("color"),
            left.name.len(),
        )
    };
    let best = pairs.iter().min_by_key(|pair| rank(pair));
    best.map(|pair| pair.map(|topic| topic.name.clone())).ok_or_else(|| {
        let found = if names.is_empty() {
            "it has no image topics of ROS".to_owned()
        } else {
            format!("its image topics are {names}")
        };
        InputError::bag(
            recording.path(),
            format!("the two cameras cannot be told: {found}. Name them with --topics LEFT,RIGHT"),
        )
    })
}

/// The topic of a camera's calibration: `camera_info` beside its images.
pub fn info_of(recording: &Recording, image_topic: &str) -> Option<String> {
    let infos: Vec<&Topic> =
        recording.topics().iter().filter(|topic| topic.kind == "sensor_msgs/CameraInfo").collect();
    // From the images' own name space upwards.
    let mut space = image_topic;
    while let Some((parent, _)) = space.rsplit_once('/') {
        let name = format!("{parent}/camera_info");
        if infos.iter().any(|topic| topic.name == name) {
            return Some(name);
        }
        space = parent;
    }
    None
}
