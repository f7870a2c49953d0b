//! Requests are stored and come back, and two ways to ask for the same are equal.

use super::*;
use crate::input::masks::MaskChoice;
use serde_json::json;
use std::num::NonZeroUsize;

/// A request in which every part is unlike its default.
fn unlike_the_default() -> Request {
    let options: Options = serde_json::from_value(json!({
        "path": "rig", "sequence": "06", "dataset": "kitti-360", "images": "colour", "bits": 12,
        "bayer": "rggb",
        "topics": "/left,/right", "top_bottom": true, "calibration": ["left.yaml", "right.yaml"],
        "faults": "freeze:right@20..,noise=0.1@5,seed=3", "start": 3, "frames": 40, "stride": 2,
        "scale": [0.3, "room"], "skip_bad_frames": true, "force": true, "depth": "disparity:depth",
        "depth_scale": "sgbm", "export": ["colmap", "scene"],
        "instances": "onnx:a.onnx,b.onnx", "instances_every": 3, "egomotion": "file:poses.txt",
        "fixes": "survey.csv",
        "memory": "48MiB", "planning": "200x100x20", "planning_3d": true,
        "set": { "volume.voxel_size_m": 0.1, "street.seed": 7, "volume.observation_weight": "depth" },
        "dynamic": false, "fuse_every": 2, "stream_mib": 9, "keep_blocks": true,
        "evaluate": "lidar", "evaluation_delay": 5, "map_objects": "all", "axes": "enu",
        "mcap": true, "mavlink": "udp:127.0.0.1:14550", "mavlink_points": true,
        "save_disparity": "seen", "save_map_disparity": "shown", "strict": true,
    }))
    .unwrap();
    let limits = Limits { threads: Some(3), rss_mib: Some(700), strict: true };
    let asked = options.request().unwrap();
    Request { limits, storage: Storage { snapshot_every: Some(9), ..asked.storage }, ..asked }
}

#[test]
fn a_request_comes_back_from_json_and_from_a_snapshot() {
    for request in [Request::default(), unlike_the_default()] {
        let text = serde_json::to_string(&request).unwrap();
        assert_eq!(serde_json::from_str::<Request>(&text).unwrap(), request, "{text}");
        let mut bytes = Vec::new();
        ciborium::into_writer(&request, &mut bytes).unwrap();
        assert_eq!(ciborium::from_reader::<Request, _>(&bytes[..]).unwrap(), request, "{text}");
    }
}

#[test]
fn only_settings_unlike_the_default_are_stored() {
    let mut request = Request::default();
    request.settings.volume.voxel_size_m = 0.1;
    let stored = serde_json::to_value(&request).unwrap();
    assert_eq!(stored["settings"], json!({ "volume": { "voxel_size_m": 0.1 } }));
    assert_eq!(request.words(), "settings.volume.voxel_size_m=0.1");
}

#[test]
fn no_option_is_the_default_and_every_part_has_one() {
    assert_eq!(Options::default().request().unwrap(), Request::default());
    let [asked, default] =
        [unlike_the_default(), Request::default()].map(|of| serde_json::to_value(of).unwrap());
    for (part, value) in asked.as_object().unwrap() {
        assert_ne!(*value, default[part], "{part}");
    }
}

#[test]
fn paths_are_absolute() {
    let request = unlike_the_default();
    let here = std::env::current_dir().unwrap();
    assert_eq!(request.input.source, Source::Recording(here.join("rig")));
    assert_eq!(request.poses, Poses::File(here.join("poses.txt")));
    assert_eq!(request.fixes, Some(here.join("survey.csv")));
    let networks = MaskChoice::Networks(vec![here.join("a.onnx"), here.join("b.onnx")]);
    assert_eq!(
        (request.masks.source, request.masks.every),
        (networks, NonZeroUsize::new(3).unwrap())
    );
    assert_eq!(request.exports.disparity, Some(here.join("seen")));
    assert_eq!(request.exports.map_disparity, Some(here.join("shown")));
    assert_eq!(request.exports.scene.unwrap().folder, here.join("scene"));
}

#[test]
fn unknown_keys_of_stored_requests_and_of_options_are_named() {
    let refusal = |text: &str| serde_json::from_str::<Request>(text).unwrap_err().to_string();
    assert!(refusal(r#"{"inputs": {}}"#).contains("inputs"));
    assert!(refusal(r#"{"frames": {"first": 3}}"#).contains("first"));
    let setting = refusal(r#"{"settings": {"volume": {"voxel_sise_m": 0.1}}}"#);
    assert!(setting.contains("`volume.voxel_sise_m`"), "{setting}");
    let option = serde_json::from_value::<Options>(json!({ "frame": 3 })).unwrap_err().to_string();
    assert!(option.contains("unknown field `frame`") && option.contains("`frames`"), "{option}");
}

#[test]
fn parts_that_contradict_one_another_are_refused() {
    let refused = |change: fn(&mut Request)| {
        let mut request = Request::default();
        change(&mut request);
        request.resolve().unwrap_err().to_string()
    };
    let both = refused(|request| {
        request.storage.snapshot_every = Some(3);
        request.exports.record = true;
    });
    assert!(both.contains("cannot have a recording as MCAP"), "{both}");
    assert!(refused(|request| request.limits.threads = Some(0)).contains("at least 1"));
    assert!(refused(|request| request.frames.start = 9_999).contains("leaves none of the"));
}

#[test]
fn a_mapper_alone_takes_bounds_and_settings_only() {
    let mut request = Request::default();
    request.bounds.memory = Memory::Profile("tiny".to_owned());
    request.settings.volume.voxel_size_m = 0.1;
    assert!(request.check_mapper().is_ok() && request.check_frames_only().is_ok());
    request.input.sequence = Some("06".to_owned());
    let refused = request.check_mapper().unwrap_err().to_string();
    assert_eq!(refused, "a mapper alone has no input.sequence. Leave it out");
    request.evaluation.delay = 3;
    let refused = request.check_frames_only().unwrap_err().to_string();
    assert!(refused.contains("has no evaluation.delay"), "{refused}");
}
