//! Messages of a recording. Frames of reference: `world` is the first camera's, in which the camera
//! drives; `left` is the left camera's; `closed` is the world after all loops and fixes.

use crate::formats::shown_pose;
use crate::observe::{FrameRow, PlanningLayers, pictures, state_name};
use base64::{Engine, engine::general_purpose::STANDARD};
use dynvox_core::geometry::{MapSegment, StereoRig, Transform};
use dynvox_core::view::Raycaster;
use dynvox_core::volume::{BLOCK_SIDE, Volume};
use dynvox_core::{Mapper, Severity};
use serde_json::{Value, json};

const WORLD: &str = "world";
const LEFT: &str = "left";
const CLOSED: &str = "closed";
/// Every so many pixels of a raycast are points.
pub const POINT_EVERY: usize = 3;
/// Bytes of a point: three floats, four bytes of colour.
const POINT_BYTES: usize = 16;
/// Foxglove's numbers of the types of a point's or a cell's fields.
const FLOAT32: u32 = 7;
const UINT8: u32 = 1;
const INT8: u32 = 2;
/// Bytes of a cell of the planner's window: two floats, a byte and three without a meaning.
const CELL_BYTES: usize = 12;

/// Time of a message, ns.
#[derive(Clone, Copy)]
pub struct Stamp(pub u64);

impl Stamp {
    fn json(self) -> Value {
        json!({ "sec": self.0 / 1_000_000_000, "nsec": self.0 % 1_000_000_000 })
    }
}

fn vector([x, y, z]: [f64; 3]) -> Value {
    json!({ "x": x, "y": y, "z": z })
}

fn pose_of(pose: &Transform) -> Value {
    let [x, y, z, w] = pose.rotation;
    json!({ "position": vector(pose.translation_m), "orientation": { "x": x, "y": y, "z": z, "w": w } })
}

/// Makes the transform of the left camera.
pub fn camera(stamp: Stamp, t_world_camera: &Transform) -> Value {
    transform(stamp, [WORLD, LEFT], t_world_camera)
}

/// Makes the transform of the world as driven.
pub fn driven_world(stamp: Stamp, t_closed_driven: &Transform) -> Value {
    transform(stamp, [CLOSED, WORLD], t_closed_driven)
}

fn transform(stamp: Stamp, [parent, child]: [&str; 2], t_parent_child: &Transform) -> Value {
    let pose = pose_of(t_parent_child);
    json!({
        "timestamp": stamp.json(), "parent_frame_id": parent, "child_frame_id": child,
        "translation": pose["position"], "rotation": pose["orientation"],
    })
}

/// Makes the pose of the left camera.
pub fn pose(stamp: Stamp, t_world_camera: &Transform) -> Value {
    json!({ "timestamp": stamp.json(), "frame_id": WORLD, "pose": pose_of(t_world_camera) })
}

/// All poses.
pub fn trajectory<'a>(stamp: Stamp, poses: impl Iterator<Item = &'a Transform>) -> Value {
    json!({ "timestamp": stamp.json(), "frame_id": WORLD, "poses": poses.map(pose_of).collect::<Vec<_>>() })
}

/// A JPEG file.
pub fn image(stamp: Stamp, jpeg: &[u8]) -> Value {
    json!({ "timestamp": stamp.json(), "frame_id": LEFT, "format": "jpeg", "data": STANDARD.encode(jpeg) })
}

/// Projection of a picture of the left camera, which may be smaller than the images that were
/// matched and `full_width` px wide.
pub fn calibration(stamp: Stamp, rig: &StereoRig, full_width: usize, size: (u32, u32)) -> Value {
    let (width, height) = size;
    let share = f64::from(width) / full_width as f64;
    let [f, u, v] = [rig.focal_px, rig.center_u_px, rig.center_v_px].map(|px| px * share);
    json!({
        "timestamp": stamp.json(), "frame_id": LEFT, "width": width, "height": height, "distortion_model": "", "D": [],
        "K": [f, 0.0, u, 0.0, f, v, 0.0, 0.0, 1.0], "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [f, 0.0, u, 0.0, 0.0, f, v, 0.0, 0.0, 0.0, 1.0, 0.0],
    })
}

/// The box of each object in a segment of the map, in the colour of its state. Every message
/// replaces those before.
pub fn objects(stamp: Stamp, segment: MapSegment, mapper: &Mapper<'_>) -> Value {
    let entity = |(summary, object): (
        &dynvox_core::objects::ObjectSummary,
        &dynvox_core::objects::Object<'_>,
    )| {
        // An object without a block has no box.
        let t_world_object = shown_pose(segment, &summary.t_world_object);
        let [low, high] = box_of(object.volume())?;
        let middle =
            Transform::from_translation([0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis])));
        let [r, g, b] =
            pictures::state_colour(summary.state).map(|channel| f64::from(channel) / 255.0);
        let metadata = [
            ("class", summary.class.name().to_owned()),
            ("state", state_name(summary.state).to_owned()),
        ];
        Some(json!({
            "timestamp": stamp.json(), "frame_id": WORLD, "id": format!("{}-{}", summary.id, summary.segment_id),
            "lifetime": { "sec": 0, "nsec": 0 }, "frame_locked": true,
            "metadata": metadata.map(|(key, value)| json!({ "key": key, "value": value })),
            "cubes": [{
                "pose": pose_of(&(t_world_object * middle)), "size": vector([0, 1, 2].map(|axis| high[axis] - low[axis])),
                "color": { "r": r, "g": g, "b": b, "a": 0.4 },
            }],
        }))
    };
    let entities: Vec<Value> = mapper.objects().filter_map(entity).collect();
    // 1: all entities of before.
    json!({ "deletions": [{ "timestamp": stamp.json(), "type": 1, "id": "" }], "entities": entities })
}

/// The box around a volume's blocks, m; `None` of an empty one.
fn box_of(volume: &Volume<'_>) -> Option<[[f64; 3]; 2]> {
    let side_m = f64::from(volume.config().voxel_size_m) * BLOCK_SIDE as f64;
    let coords = volume
        .pool()
        .live()
        .filter_map(|slot| volume.blocks().coord(slot))
        .map(|at| [at.x, at.y, at.z].map(f64::from));
    let bounds =
        // A block reaches one step beyond its coordinate.
        coords.map(|at| [at, at.map(|steps| steps + 1.0)]).reduce(|[low, high], [from, to]| {
            [
                [0, 1, 2].map(|axis| low[axis].min(from[axis])),
                [0, 1, 2].map(|axis| high[axis].max(to[axis])),
            ]
        })?;
    Some(bounds.map(|corner| corner.map(|steps| steps * side_m)))
}

/// Figures of a frame.
pub fn figures(stamp: Stamp, row: &FrameRow) -> Value {
    let (matches, inliers, _) = row.matches();
    let severity: Severity = row.severity();
    json!({
        "timestamp": stamp.json(), "frame": row.frame, "step_ms": row.step_ms, "severity": severity.name(), "motion": row.motion(),
        "matches": matches, "inliers": inliers, "blocks_used": row.report.blocks.used,
        "tracks": row.track_states.iter().sum::<u32>(), "dynamic": row.track_states[2],
    })
}

/// Makes coloured points in the camera's frame from every [`POINT_EVERY`]-th pixel of a raycast;
/// `None` before the first raycast.
pub fn cloud(stamp: Stamp, seen: &Raycaster<'_>, rig: &StereoRig) -> Option<Value> {
    let (depth_m, colour) = (seen.depth_m()?, seen.colour()?);
    let mut data = Vec::new();
    for v in 0..depth_m.height() {
        for u in 0..depth_m.width() {
            let z = depth_m.get(u, v).unwrap_or_default();
            if z > 0.0 {
                let from_center = |at: usize, center_px: f64| {
                    ((at * POINT_EVERY) as f32 - center_px as f32) / rig.focal_px as f32
                };
                let (x, y) =
                    (from_center(u, rig.center_u_px) * z, from_center(v, rig.center_v_px) * z);
                data.extend([x, y, z].iter().flat_map(|value| value.to_le_bytes()));
                data.extend(colour.get(u, v).unwrap_or_default());
                // Opaque.
                data.push(255);
            }
        }
    }
    let fields = [
        ("x", 0, FLOAT32),
        ("y", 4, FLOAT32),
        ("z", 8, FLOAT32),
        ("red", 12, UINT8),
        ("green", 13, UINT8),
        ("blue", 14, UINT8),
        ("alpha", 15, UINT8),
    ];
    Some(json!({
        "timestamp": stamp.json(), "frame_id": LEFT, "pose": pose_of(&Transform::IDENTITY), "point_stride": POINT_BYTES,
        "fields": fields.map(field), "data": STANDARD.encode(data),
    }))
}

/// The planner's window from above: distance to obstacles, height of the ground, occupancy.
pub fn planning(stamp: Stamp, layers: &PlanningLayers) -> Value {
    let [columns, _] = layers.size;
    let mut data = Vec::with_capacity(CELL_BYTES * layers.occupancy.len());
    for ((distance_m, height_m), occupancy) in
        layers.distance_m.iter().zip(&layers.height_m).zip(&layers.occupancy)
    {
        data.extend([distance_m, height_m].into_iter().flat_map(|value| value.to_le_bytes()));
        // Three bytes of padding, so that each cell is 12 bytes.
        data.extend([occupancy.to_le_bytes()[0], 0, 0, 0]);
    }
    let fields = [("distance_m", 0, FLOAT32), ("height_m", 4, FLOAT32), ("occupancy", 8, INT8)];
    json!({
        "timestamp": stamp.json(), "frame_id": WORLD, "pose": pose_of(&layers.t_world_corner), "column_count": columns,
        "cell_size": { "x": layers.cell_m, "y": layers.cell_m }, "row_stride": columns * CELL_BYTES, "cell_stride": CELL_BYTES,
        "fields": fields.map(field), "data": STANDARD.encode(data),
    })
}

/// Describes the position and type of one value in a point or a cell.
fn field(field: (&str, usize, u32)) -> Value {
    let (name, offset, kind) = field;
    json!({ "name": name, "offset": offset, "type": kind })
}
