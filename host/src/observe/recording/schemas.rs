//! Topics of a recording, and what their messages look like.

use serde_json::{Value, json};

/// A topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// The left camera in the world.
    Transform,
    /// Pose of a frame of reference.
    Pose,
    /// Projection of the left picture.
    Calibration,
    /// The left picture.
    Left,
    /// Disparity in colours.
    Disparity,
    /// Boxes of reconstructed objects.
    Objects,
    /// Figures of the frame.
    Figures,
    /// Points of the map that the camera sees.
    Map,
    /// The planner's window from above, where the run has one.
    Planning,
    /// All poses, at the end.
    Trajectory,
}

/// All topics, in the order of the enumeration.
pub const TOPICS: [Topic; 10] = [
    Topic::Transform,
    Topic::Pose,
    Topic::Calibration,
    Topic::Left,
    Topic::Disparity,
    Topic::Objects,
    Topic::Figures,
    Topic::Map,
    Topic::Planning,
    Topic::Trajectory,
];

impl Topic {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Transform => "/tf",
            Self::Pose => "/camera/pose",
            Self::Calibration => "/camera/left/calibration",
            Self::Left => "/camera/left/image",
            Self::Disparity => "/camera/disparity",
            Self::Objects => "/objects",
            Self::Figures => "/figures",
            Self::Map => "/map/seen",
            Self::Planning => "/planning/grid",
            Self::Trajectory => "/trajectory",
        }
    }

    pub const fn schema(self) -> &'static str {
        match self {
            Self::Transform => "foxglove.FrameTransform",
            Self::Pose => "foxglove.PoseInFrame",
            Self::Calibration => "foxglove.CameraCalibration",
            Self::Left | Self::Disparity => "foxglove.CompressedImage",
            Self::Objects => "foxglove.SceneUpdate",
            Self::Figures => "dynvox.FrameFigures",
            Self::Map => "foxglove.PointCloud",
            Self::Planning => "foxglove.Grid",
            Self::Trajectory => "foxglove.PosesInFrame",
        }
    }

    /// The schema as JSON schema.
    pub fn json_schema(self) -> Value {
        let properties = match self {
            Self::Transform => {
                json!({ "parent_frame_id": text(), "child_frame_id": text(), "translation": vector(), "rotation": quaternion() })
            }
            Self::Pose => json!({ "frame_id": text(), "pose": pose() }),
            Self::Calibration => json!({
                "frame_id": text(), "width": integer(), "height": integer(), "distortion_model": text(),
                "D": array(&number()), "K": array(&number()), "R": array(&number()), "P": array(&number()),
            }),
            Self::Left | Self::Disparity => {
                json!({ "frame_id": text(), "data": bytes(), "format": text() })
            }
            Self::Objects => {
                json!({ "deletions": array(&object(&json!({ "type": integer(), "id": text() }))), "entities": array(&entity()) })
            }
            Self::Figures => json!({
                "frame": integer(), "step_ms": number(), "severity": text(), "motion": text(), "matches": integer(), "inliers": integer(),
                "blocks_used": integer(), "tracks": integer(), "dynamic": integer(),
            }),
            Self::Map => json!({
                "frame_id": text(), "pose": pose(), "point_stride": integer(), "data": bytes(), "fields": fields(),
            }),
            Self::Planning => json!({
                "frame_id": text(), "pose": pose(), "column_count": integer(),
                "cell_size": object(&json!({ "x": number(), "y": number() })),
                "row_stride": integer(), "cell_stride": integer(), "data": bytes(), "fields": fields(),
            }),
            Self::Trajectory => json!({ "frame_id": text(), "poses": array(&pose()) }),
        };
        let mut schema = object(&properties);
        // The scene of Foxglove has times in its entities, and none of its own.
        if self != Self::Objects {
            schema["properties"]["timestamp"] = time();
        }
        schema["title"] = self.schema().into();
        schema
    }
}

fn object(properties: &Value) -> Value {
    json!({ "type": "object", "properties": properties })
}

fn array(items: &Value) -> Value {
    json!({ "type": "array", "items": items })
}

fn text() -> Value {
    json!({ "type": "string" })
}

fn integer() -> Value {
    json!({ "type": "integer" })
}

fn number() -> Value {
    json!({ "type": "number" })
}

fn bytes() -> Value {
    json!({ "type": "string", "contentEncoding": "base64" })
}

fn time() -> Value {
    object(&json!({ "sec": integer(), "nsec": integer() }))
}

fn vector() -> Value {
    object(&json!({ "x": number(), "y": number(), "z": number() }))
}

fn quaternion() -> Value {
    object(&json!({ "x": number(), "y": number(), "z": number(), "w": number() }))
}

fn pose() -> Value {
    object(&json!({ "position": vector(), "orientation": quaternion() }))
}

/// Describes the fields of a point or a cell.
fn fields() -> Value {
    array(&object(&json!({ "name": text(), "offset": integer(), "type": integer() })))
}

fn entity() -> Value {
    let colour = object(&json!({ "r": number(), "g": number(), "b": number(), "a": number() }));
    object(&json!({
        "timestamp": time(), "frame_id": text(), "id": text(), "lifetime": time(), "frame_locked": { "type": "boolean" },
        "metadata": array(&object(&json!({ "key": text(), "value": text() }))),
        "cubes": array(&object(&json!({ "pose": pose(), "size": vector(), "color": colour }))),
    }))
}
