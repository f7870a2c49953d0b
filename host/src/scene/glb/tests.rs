use super::*;
use crate::scene::{FrameColumns, IndexedMesh, SceneFrame};

/// JSON and bytes of a scene.
fn parsed(scene: &Scene) -> (Value, Vec<u8>) {
    let mut file = Vec::new();
    write(&mut file, scene).unwrap();
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&file[..4], word(4), word(8)), (&b"glTF"[..], 2, file.len()));
    assert_eq!(&file[16..20], b"JSON");
    let json_end = 20 + word(12);
    let bytes = if json_end < file.len() { file[json_end + 8..].to_vec() } else { Vec::new() };
    (serde_json::from_slice(&file[20..json_end]).unwrap(), bytes)
}

fn triangle() -> IndexedMesh {
    IndexedMesh {
        positions_m: vec![[1.0, 2.0, 3.0], [5.0, 2.0, 3.0], [1.0, 4.0, 3.0]],
        colours: vec![[255, 0, 0]; 3],
        weights: vec![0; 3],
        triangles: vec![[0, 1, 2]],
    }
}

#[test]
fn an_object_moves_along_its_trajectory_and_its_mesh_is_to_scale() {
    // The object is known at frames 1 and 3 only.
    let pose = |x: f64| Transform::from_translation([x, 0.0, 0.0]);
    let frame = |frame: usize| SceneFrame {
        row: FrameColumns { frame, time_s: 100.0 + 0.1 * frame as f64, ..FrameColumns::default() },
        t_world_camera: pose(frame as f64),
        tracks: Vec::new(),
    };
    let scene = Scene {
        frames: (0..5).map(frame).collect(),
        static_map: triangle(),
        objects: vec![SceneObject {
            name: "7".to_owned(),
            id: 7,
            t_world_object: vec![(1, pose(10.0)), (3, pose(30.0))],
            mesh: triangle(),
        }],
        ..Scene::default()
    };
    let (json, bytes) = parsed(&scene);
    // The numbers behind an accessor.
    let floats = |accessor: &Value| -> Vec<f32> {
        let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let [from, len] =
            ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        bytes[from..from + len]
            .chunks_exact(4)
            .map(|value| f32::from_le_bytes(value.try_into().unwrap()))
            .collect()
    };
    let animation = &json["animations"][0];
    let channel = &animation["channels"][0];
    let node = &json["nodes"][channel["target"]["node"].as_u64().unwrap() as usize];
    assert_eq!(
        (&node["name"], &node["translation"]),
        (&json!("object 7"), &json!([30.0, 0.0, 0.0])),
        "where it was last seen"
    );
    // From the first frame on, in seconds.
    let times = floats(&animation["samplers"][0]["input"]);
    assert!(
        times.len() == 2 && (times[0] - 0.1).abs() < 1e-6 && (times[1] - 0.3).abs() < 1e-6,
        "{times:?}"
    );
    assert_eq!(floats(&animation["samplers"][0]["output"]), [10.0, 0.0, 0.0, 30.0, 0.0, 0.0]);
    let map =
        json["nodes"].as_array().unwrap().iter().find(|node| node["name"] == "static map").unwrap();
    // Readers without extensions see metres.
    assert!(map.get("scale").is_none() && json.get("extensionsRequired").is_none(), "{json}");
    let attributes = &json["meshes"][map["mesh"].as_u64().unwrap() as usize]["primitives"][0];
    let position = &attributes["attributes"]["POSITION"];
    assert_eq!(floats(position), [1.0, 2.0, 3.0, 5.0, 2.0, 3.0, 1.0, 4.0, 3.0]);
    let accessor = &json["accessors"][position.as_u64().unwrap() as usize];
    assert_eq!(
        (&accessor["min"], &accessor["max"], &accessor["componentType"]),
        (&json!([1.0, 2.0, 3.0]), &json!([5.0, 4.0, 3.0]), &json!(binary::F32))
    );
    assert!(floats(&attributes["attributes"]["NORMAL"]).chunks(3).all(|n| n == [0.0, 0.0, 1.0]));
    let root = json["nodes"].as_array().unwrap().last().unwrap();
    assert_eq!(
        // Half a turn about x: y up as glTF has it.
        (root["children"].as_array().unwrap().len(), &root["rotation"]),
        (3, &json!([1.0, 0.0, 0.0, 0.0])),
        "map, path, object"
    );
    assert_eq!(json["buffers"][0]["byteLength"], bytes.len());
}

#[test]
fn an_empty_scene_is_a_file_too() {
    let (json, bytes) = parsed(&Scene::default());
    assert!(
        bytes.is_empty()
            && json["nodes"].as_array().unwrap().len() == 1
            && json.get("meshes").is_none()
    );
}
