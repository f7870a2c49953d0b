//! Exports of a run for other programs: meshes, glTF, recordings; completions and the manual.

use super::binary::{dynvox, names, output_text, rig};
use base64::{Engine, engine::general_purpose::STANDARD};
use dynvox::Request;
use dynvox::formats::{PlyMesh, read_numbered, read_poses};
use dynvox::input::masks::MaskChoice;
use dynvox::request::Memory;
use dynvox::run::stereo_frame;
use dynvox_core::geometry::Transform;
use dynvox_core::{Mapper, Serial, StereoFrame};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A street with traffic whose masks are exact, so that there are objects.
const STREET: [&str; 12] = [
    "run",
    "--quiet",
    "--profile",
    "tiny",
    "--instances",
    "exact",
    "--set",
    "street.width=320",
    "--set",
    "street.height=96",
    "--set",
    "street.frames=16",
];

/// The run of [`STREET`].
fn street() -> Request {
    let mut request = Request::default();
    request.bounds.memory = Memory::Profile("tiny".to_owned());
    request.masks.source = MaskChoice::Exact;
    let street = request.settings.street_mut();
    (street.width, street.height, street.frames) = (320, 96, 16);
    request
}

fn run(root: &Path, args: &[&str]) {
    let done = dynvox(root, args);
    assert!(done.status.success(), "{}", output_text(&done));
}

/// Triangles of a mesh by object, and its greatest and least coordinates.
fn triangles(path: &Path) -> (BTreeMap<u32, u64>, [[f32; 3]; 2]) {
    let (mut counts, mut bounds) = (BTreeMap::new(), [[f32::MAX; 3], [f32::MIN; 3]]);
    PlyMesh::open(path)
        .unwrap()
        .triangles(|corners| {
            *counts.entry(corners[0].object).or_default() += 1;
            for (corner, axis) in
                corners.iter().flat_map(|corner| (0..3).map(move |axis| (corner, axis)))
            {
                bounds[0][axis] = bounds[0][axis].min(corner.vertex.position_m[axis]);
                bounds[1][axis] = bounds[1][axis].max(corner.vertex.position_m[axis]);
            }
        })
        .unwrap();
    (counts, bounds)
}

#[dynvox_needs::long]
#[test]
fn a_map_has_its_objects_where_they_were_last_seen() {
    let root = TempDir::new().unwrap();
    run(root.path(), &[&STREET[..], &["--out", "last"]].concat());
    let last = root.path().join("last");
    let (map, bounds) = triangles(&last.join("map.ply"));
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(last.join("summary.json")).unwrap()).unwrap();
    assert!(map.len() > 1, "objects: {map:?}");
    // The summary counts what the mesh holds.
    assert_eq!(summary["map"]["triangles"], map[&0]);
    assert_eq!(summary["map"]["object_triangles"], map.values().sum::<u64>() - map[&0]);
    let files = names(&last.join("objects"));
    let objects: Vec<&str> =
        files.iter().filter_map(|name| name.strip_suffix("_world.ply")).collect();
    assert!(!objects.is_empty() && files.len() == 4 * objects.len(), "{files:?}");
    for name in objects {
        let in_folder = |ending: &str| last.join("objects").join(format!("{name}{ending}"));
        let (own, own_bounds) = triangles(&in_folder(".ply"));
        let (world, world_bounds) = triangles(&in_folder("_world.ply"));
        assert_eq!(own, world);
        let (by_frame, by_time) = (
            read_numbered(&in_folder("_kitti.txt")).unwrap(),
            read_poses(&in_folder("_tum.txt")).unwrap(),
        );
        // Poses by frame and by time describe the same path.
        assert!(by_frame.len() == by_time.poses.len() && by_time.times_s.is_some());
        let moved = by_frame
            .last()
            .unwrap()
            .1
            .transform_point(own_bounds.map(|corner| corner.map(f64::from))[0]);
        let reach: f32 = (0..3).map(|axis| own_bounds[1][axis] - own_bounds[0][axis]).sum();
        // Once as the object is built, once where it was last seen.
        assert!(
            (0..3).all(|axis| (moved[axis] as f32 - world_bounds[0][axis]).abs() <= reach),
            "{name}: {moved:?} {world_bounds:?}"
        );
        assert!(
            (0..3).all(|axis| world_bounds[0][axis] >= bounds[0][axis]
                && world_bounds[1][axis] <= bounds[1][axis]),
            "{name}"
        );
    }
    assert_eq!(&fs::read(last.join("map.glb")).unwrap()[..4], b"glTF");
    // Without objects the mesh is the static map only, in the axes asked for.
    run(
        root.path(),
        &[&STREET[..], &["--out", "none", "--map-objects", "none", "--axes", "enu"]].concat(),
    );
    let (none, none_bounds) = triangles(&root.path().join("none/map.ply"));
    assert_eq!(none, BTreeMap::from([(0, map[&0])]));
    assert!(
        none_bounds[1][1] < 5.0,
        "y down as readers turn it: the ground is not far below {none_bounds:?}"
    );
    let header = fs::read(root.path().join("none/map.ply")).unwrap();
    assert!(String::from_utf8_lossy(&header[..300]).contains("x right, y forward, z up"));
}

/// Cells of a grid, m: a point of the map has another one in its own cell or in a neighbour.
const CELL_M: f64 = 0.15;

fn cell(position_m: [f64; 3]) -> [i64; 3] {
    position_m.map(|metres| (metres / CELL_M).floor() as i64)
}

/// Cells with a vertex, by object.
type ObjectCells = BTreeMap<u32, BTreeSet<[i64; 3]>>;

fn ply_objects(path: &Path) -> ObjectCells {
    let mut cells = ObjectCells::new();
    let add = |corners: [dynvox::formats::PlyVertex; 3]| {
        for corner in corners.iter().filter(|corner| corner.object > 0) {
            cells
                .entry(corner.object)
                .or_default()
                .insert(cell(corner.vertex.position_m.map(f64::from)));
        }
    };
    PlyMesh::open(path).unwrap().triangles(add).unwrap();
    cells
}

/// Objects as their nodes stand without the animation, in the axes of the root's children: those of
/// the first camera.
fn glb_objects(path: &Path) -> ObjectCells {
    let file = fs::read(path).unwrap();
    // The header gives the length of the JSON; the binary part follows it.
    let json_end = 20 + u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    let (json, bytes): (serde_json::Value, &[u8]) =
        (serde_json::from_slice(&file[20..json_end]).unwrap(), &file[json_end + 8..]);
    let at = |value: &serde_json::Value| value.as_u64().unwrap() as usize;
    let numbers = |value: &serde_json::Value| {
        value.as_array().unwrap().iter().map(|one| one.as_f64().unwrap()).collect::<Vec<_>>()
    };
    let mut cells = ObjectCells::new();
    for node in json["nodes"].as_array().unwrap() {
        let Some(name) = node["name"]
            .as_str()
            .unwrap()
            .strip_prefix("object ")
            .filter(|name| !name.ends_with("mesh"))
        else {
            continue;
        };
        let pose = Transform {
            translation_m: numbers(&node["translation"]).try_into().unwrap(),
            rotation: numbers(&node["rotation"]).try_into().unwrap(),
        };
        let mesh = &json["nodes"][at(&node["children"][0])];
        let accessor = &json["accessors"]
            [at(&json["meshes"][at(&mesh["mesh"])]["primitives"][0]["attributes"]["POSITION"])];
        let view = &json["bufferViews"][at(&accessor["bufferView"])];
        let vertices = bytes[at(&view["byteOffset"])..]
            .chunks_exact(at(&view["byteStride"]))
            .take(at(&accessor["count"]));
        let object = cells.entry(name.split('-').next().unwrap().parse().unwrap()).or_default();
        for vertex in vertices {
            let metres = |axis: usize| {
                f64::from(f32::from_le_bytes(vertex[4 * axis..4 * axis + 4].try_into().unwrap()))
            };
            object.insert(cell(pose.transform_point([0, 1, 2].map(metres))));
        }
    }
    cells
}

#[dynvox_needs::long]
#[test]
fn cars_stand_in_both_maps_where_the_raycast_of_the_last_frame_shows_them() {
    let root = TempDir::new().unwrap();
    run(root.path(), &[&STREET[..], &["--out", "result"]].concat());
    // The same run once more, up to a look through the last camera.
    let plan = street().resolve().unwrap();
    let mut slab = vec![0; plan.capacity.bytes() + dynvox_core::memory::SLAB_ALIGN];
    let mut mapper = Mapper::new(&plan.capacity, &plan.config, &mut slab).unwrap();
    for &frame in plan.frames.listed() {
        let images = plan.dataset.frame(frame).unwrap();
        let detections: Vec<_> = images.masks.instances.iter().map(|of| of.detection()).collect();
        let frame = StereoFrame {
            time_ns: plan.dataset.stamp_ns(frame),
            ..stereo_frame(&images, &detections).unwrap()
        };
        mapper.step(&frame, &Serial).unwrap();
    }
    let (pose, rig) = (*mapper.t_world_camera(), plan.config.rig);
    let ids: Vec<u32> = mapper.posed_objects().map(|posed| posed.summary.id).collect();
    let seen = mapper.raycast_composed(&pose, &Serial).unwrap();
    let (depth_m, layer) = (seen.depth_m().unwrap(), seen.layer().unwrap());
    let maps = [("map.ply", ply_objects as fn(&Path) -> ObjectCells), ("map.glb", glb_objects)]
        .map(|(name, read)| {
            let cells = read(&root.path().join("result").join(name));
            (name, cells)
        });
    // Pixels of each object, and how many of them show a point that each of the maps has.
    let mut shown = BTreeMap::<u32, [usize; 3]>::new();
    for (u, v) in (0..depth_m.height()).flat_map(|v| (0..depth_m.width()).map(move |u| (u, v))) {
        let Some(id) =
            layer.get(u, v).and_then(|layer| ids.get(usize::from(layer).checked_sub(1)?))
        else {
            continue;
        };
        let z = f64::from(depth_m.get(u, v).unwrap());
        let [x, y] = [
            (u as f64 - rig.center_u_px) / rig.focal_px * z,
            (v as f64 - rig.center_v_px) / rig.focal_px * z,
        ];
        let at = cell(pose.transform_point([x, y, z]));
        let near = |of: &BTreeSet<[i64; 3]>| {
            (0..27).any(|code| {
                of.contains(&[at[0] + code % 3 - 1, at[1] + code / 3 % 3 - 1, at[2] + code / 9 - 1])
            })
        };
        let [pixels, found @ ..] = shown.entry(*id).or_default();
        *pixels += 1;
        for (found, (_, cells)) in found.iter_mut().zip(&maps) {
            *found += usize::from(cells.get(id).is_some_and(near));
        }
    }
    assert!(shown.values().any(|[pixels, ..]| *pixels > 100), "a car is in sight: {shown:?}");
    for (id, [pixels, found @ ..]) in &shown {
        for (found, (name, _)) in found.iter().zip(&maps) {
            assert!(
                found * 100 >= pixels * 95,
                "object {id}: {found} of {pixels} pixels show a point of its mesh in {name}"
            );
        }
    }
}

#[test]
fn a_recording_has_every_frame_of_every_topic() {
    let root = TempDir::new().unwrap();
    rig(root.path(), 12);
    let window = [
        "--planning",
        "100x100x16",
        "--set",
        "planning.level=true",
        "--set",
        "planning.camera_height_m=1.2",
    ];
    run(
        root.path(),
        &[
            &["run", "rig", "--profile", "tiny", "--quiet", "--out", "result", "--mcap"][..],
            &window,
        ]
        .concat(),
    );
    let bytes = fs::read(root.path().join("result/run.mcap")).unwrap();
    let (mut counts, mut times) = (BTreeMap::<String, usize>::new(), Vec::new());
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let json: serde_json::Value = serde_json::from_slice(&message.data).unwrap();
        let schema: serde_json::Value =
            serde_json::from_slice(&message.channel.schema.as_ref().unwrap().data).unwrap();
        // Every key that a message has must be in its schema.
        for key in json.as_object().unwrap().keys() {
            assert!(
                !schema["properties"][key].is_null(),
                "{} is in the schema of {}",
                key,
                message.channel.topic
            );
        }
        // The planner's grid, cell by cell.
        if message.channel.topic == "/planning/grid" {
            let number = |key: &str| json[key].as_u64().unwrap();
            assert_eq!(
                [number("column_count"), number("row_stride"), number("cell_stride")],
                [100, 1_200, 12]
            );
            let data = STANDARD.decode(json["data"].as_str().unwrap()).unwrap();
            let states: BTreeSet<i8> = data.chunks(12).map(|cell| cell[8] as i8).collect();
            assert!(data.len() == 100 * 100 * 12 && states == [-1, 0, 100].into(), "{states:?}");
        }
        *counts.entry(message.channel.topic.clone()).or_default() += 1;
        times.push(message.log_time);
    }
    assert!(times.is_sorted());
    // Every frame of every topic; clouds and grids only every tenth.
    let expected = [
        ("/camera/disparity", 12),
        ("/camera/left/calibration", 12),
        ("/camera/left/image", 12),
        ("/camera/pose", 12),
        ("/figures", 12),
        ("/map/seen", 2),
        ("/objects", 12),
        ("/planning/grid", 2),
        ("/tf", 12),
        ("/trajectory", 1),
    ];
    assert_eq!(counts, expected.map(|(topic, count)| (topic.to_owned(), count)).into());
    // Recordings cannot be continued from a snapshot.
    let refused = dynvox(root.path(), &["run", "rig", "--mcap", "--snapshot-every", "4"]);
    assert_eq!(refused.status.code(), Some(2), "{}", output_text(&refused));
}

#[test]
fn completions_and_the_manual_know_every_command() {
    // What a package of a distribution installs.
    let root = TempDir::new().unwrap();
    let text = |args: &[&str]| String::from_utf8(dynvox(root.path(), args).stdout).unwrap();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = text(&["completions", shell]);
        assert!(["run", "view", "map-objects"].iter().all(|word| script.contains(word)), "{shell}");
    }
    assert!(text(&["man"]).contains(".TH dynvox 1"));
    run(root.path(), &["man", "--out", "man"]);
    let pages = names(&root.path().join("man"));
    assert!(
        ["dynvox.1", "dynvox-run.1", "dynvox-view.1"]
            .iter()
            .all(|page| pages.iter().any(|name| name == page)),
        "{pages:?}"
    );
    // Options come in groups, in an order that helps to find them.
    let help = text(&["run", "--help"]);
    assert!(
        ["Input:", "Frames:", "Mapping:", "Limits:", "Evaluation:", "Results:"]
            .iter()
            .all(|group| help.contains(group)),
        "{help}"
    );
}

/// Counts of a window's cells that are occupied, unknown and free, in a run that is the same
/// without it.
fn window(input: &[&str], columns: u32, rows: u32) -> [usize; 3] {
    let root = TempDir::new().unwrap();
    rig(root.path(), 4);
    run(
        root.path(),
        &[input, &["--planning", &format!("{columns}x{rows}x16"), "--out", "with"]].concat(),
    );
    run(root.path(), &[input, &["--out", "without"]].concat());
    assert!(!root.path().join("without/planning").exists());
    // The digests with and without a window.
    let digests = |name: &str| {
        fs::read_to_string(root.path().join(name).join("summary.json"))
            .unwrap()
            .lines()
            .find(|line| line.contains("\"digest\""))
            .map(str::to_owned)
    };
    assert_eq!(digests("with"), digests("without"), "a window changes nothing else");
    let folder = root.path().join("with/planning");
    assert_eq!(
        names(&folder),
        [
            "distance.png",
            "height.png",
            "map.pgm",
            "map.yaml",
            "map_raw.pgm",
            "map_raw.yaml",
            "map_scale.png",
            "map_scale.yaml",
            "window.json",
            "window.png",
        ]
    );
    let (pgm, header) =
        (fs::read(folder.join("map.pgm")).unwrap(), format!("P5\n{columns} {rows}\n255\n"));
    let (head, pixels) = pgm.split_at(header.len());
    assert_eq!((head, pixels.len()), (header.as_bytes(), (columns * rows) as usize));
    // The three grey levels of the format.
    let counts = [0, 205, 254].map(|grey| pixels.iter().filter(|pixel| **pixel == grey).count());
    let window: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("window.json")).unwrap()).unwrap();
    assert_eq!(counts.iter().sum::<usize>(), pixels.len());
    assert_eq!(window["report"]["obstacles"], counts[0]);
    let yaml = fs::read_to_string(folder.join("map.yaml")).unwrap();
    let origin = window["origin_m"][0].as_f64().unwrap();
    assert!(
        yaml.contains("image: map.pgm")
            && yaml.contains(&format!("origin: [{origin}, "))
            && yaml.contains("mode: trinary")
            && yaml.contains("free_thresh: 0.196\n"),
        "{yaml}"
    );
    // Pictures of the same size, which agree cell by cell.
    let picture = |name: &str| image::open(folder.join(name)).unwrap().into_luma16();
    let (heights, distances) = (picture("height.png"), picture("distance.png"));
    assert_eq!((heights.dimensions(), distances.dimensions()), ((columns, rows), (columns, rows)));
    let ground = heights.pixels().filter(|height| height.0[0] != u16::MAX).count();
    assert_eq!(window["report"]["ground"], ground);
    for (pixel, distance) in pixels.iter().zip(distances.pixels()) {
        assert_eq!(
            *pixel == 0,
            distance.0[0] < 32_768,
            "a distance is below 0 inside obstacles alone"
        );
    }
    counts
}

#[test]
fn a_window_for_planners_is_a_map_for_nav2_with_heights_and_distances() {
    let [occupied, unknown, free] = window(
        &["run", "rig", "--profile", "tiny", "--quiet", "--set", "volume.voxel_size_m=0.1"],
        80,
        60,
    );
    assert!(
        occupied > 5 && free > 50 && unknown > 100,
        "a wall ahead: {occupied} occupied, {unknown} unknown, {free} free"
    );
}

#[dynvox_needs::long]
#[test]
fn a_window_of_a_street_shows_its_obstacles() {
    let [occupied, unknown, free] = window(&STREET, 80, 60);
    assert!(
        occupied > 20 && free > 100 && unknown > 100,
        "{occupied} occupied, {unknown} unknown, {free} free"
    );
}

#[test]
fn a_window_that_cannot_be_is_refused_with_a_sentence() {
    let root = TempDir::new().unwrap();
    let refused = dynvox(root.path(), &["run", "--planning", "80x60", "--out", "a"]);
    assert!(
        output_text(&refused).contains("write 200x200x20") && names(root.path()).is_empty(),
        "{}",
        output_text(&refused)
    );
}

#[test]
fn what_the_map_shows_is_saved_as_disparities_that_a_run_takes() {
    let root = TempDir::new().unwrap();
    // Exact depth, so that errors are those of the map.
    let street = [&STREET[..], &["--frames", "6", "--depth", "exact"]].concat();
    run(root.path(), &[&street[..], &["--out", "one", "--save-map-disparity", "seen"]].concat());
    assert_eq!(
        names(&root.path().join("seen")),
        (0..6).map(|frame| format!("{frame:06}.png")).collect::<Vec<_>>()
    );
    let again = [
        &STREET[..],
        &["--frames", "6", "--depth", "disparity:seen", "--evaluate", "exact", "--json"],
    ]
    .concat();
    let again = dynvox(root.path(), &again);
    let summary: serde_json::Value = serde_json::from_slice(&again.stdout).unwrap();
    let input = &summary["lidar"]["static"]["input"];
    let share = |key: &str| input[key].as_f64().unwrap();
    assert!(share("accuracy_alone") > 0.97 && share("completeness") > 0.4, "{input}");
    // The folder of pictures exists from the first run.
    let refused = dynvox(
        root.path(),
        &[&street[..], &["--out", "two", "--save-map-disparity", "seen"]].concat(),
    );
    assert!(output_text(&refused).contains("seen exists"), "{}", output_text(&refused));
    assert!(!root.path().join("two").exists(), "nothing half-written stays");
}

#[test]
fn every_disparity_is_saved_with_its_confidence() {
    let root = TempDir::new().unwrap();
    let street = [&STREET[..], &["--frames", "2"]].concat();
    run(root.path(), &[&street[..], &["--out", "one", "--save-disparity", "plain"]].concat());
    assert_eq!(names(&root.path().join("plain")), ["000000.png", "000001.png"]);
    let asked = ["--out", "two", "--save-disparity", "both", "--set", "stereo.min_confidence=1"];
    run(root.path(), &[&street[..], &asked].concat());
    let both = root.path().join("both");
    assert_eq!(names(&both), ["000000.png", "000001.png", "confidence"]);
    let read = |path: &Path| image::open(path).unwrap();
    let disparity = read(&both.join("000001.png")).into_luma16();
    let confidence = read(&both.join("confidence/000001.png")).into_luma8();
    assert_eq!(disparity.dimensions(), confidence.dimensions());
    let known = disparity.pixels().filter(|pixel| pixel.0[0] > 0).count();
    assert!(2 * known > disparity.pixels().len(), "{known} pixels");
    let agree = |(disparity, confidence): (&u16, &u8)| (*disparity > 0) == (*confidence > 0);
    assert!(disparity.as_raw().iter().zip(confidence.as_raw()).all(agree));
}
