//! A camera that was covered, and maps on in a segment of its own.

use super::binary::{dynvox, output_text};
use super::resume::killed_at;
use super::same_run::assert_same;
use dynvox::formats::{PlyMesh, read_poses};
use std::fs;
use std::path::Path;
use std::process::Output;
use tempfile::TempDir;

/// Bounds of a map without colour, in which no camera is found again.
const CAPACITY: &str = "[capacity]
image_width = 320
image_height = 96
raw_width = 0
raw_height = 0
features = 1500
matches = 800
blocks = 3000
visible_blocks = 3000
history_frames = 200
detections = 0
mask_words = 0
tracks = 0
objects = 0
object_blocks = 0
crop_pixels = 0
planning_width = 0
planning_length = 0
planning_height = 0
planning_distance_3d = false
colour = false
";

/// Frames of the run; the camera is covered from the twelfth on, and sees again in the 24th.
const FRAMES: usize = 34;

/// Arguments of a run of a street in which the camera is covered, into `out`, with a pool of that
/// many blocks.
fn covered(root: &Path, out: &str, blocks: usize, more: &[&str]) -> Vec<String> {
    let bounds = format!("{blocks}.toml");
    let text = CAPACITY.replace("blocks = 3000", &format!("blocks = {blocks}"));
    fs::write(root.join(&bounds), text).unwrap();
    let frames = FRAMES.to_string();
    // Slow and without shake: the camera is to be lost by the cover alone.
    let settings = [
        "street.width=320",
        "street.height=96",
        "street.speed_m_s=3.0",
        "street.shake=0.0",
        "street.traffic.mode=none",
        "volume.voxel_size_m=0.1",
    ];
    let mut args = vec!["run", "--frames", &frames, "--capacity", &bounds, "--out", out];
    // Both cameras see black for eleven frames.
    args.extend(["--instances", "none", "--faults", "black@12..23"]);
    args.extend(settings.iter().flat_map(|setting| ["--set", setting]));
    args.extend(more);
    args.into_iter().map(str::to_owned).collect()
}

fn run(root: &Path, args: &[String]) -> Output {
    dynvox(root, &args.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Triangles of the mesh in each segment, as files show them.
fn triangles(folder: &Path) -> [usize; 2] {
    let mut counts = [0; 2];
    let mesh = PlyMesh::open(&folder.join("map.ply")).unwrap();
    mesh.triangles(|corners| {
        let heights = corners.map(|corner| corner.vertex.position_m[1]);
        let is_about = |y: f32| heights.iter().all(|height| (height - y).abs() < 30.0);
        assert!(is_about(0.0) || is_about(-100.0), "{heights:?}");
        counts[usize::from(is_about(-100.0))] += 1;
    })
    .unwrap();
    counts
}

#[dynvox_needs::long]
#[test]
fn files_show_each_segment_above_the_one_before() {
    let root = TempDir::new().unwrap();
    let root = root.path();
    let run = self::run(root, &covered(root, "pool", 3_000, &[]));
    let text = String::from_utf8_lossy(&run.stdout);
    assert!(run.status.success() && text.contains("segments of the map   2: the camera"), "{text}");
    let folder = root.join("pool");
    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["egomotion"]["segments"], 2);
    let table = fs::read_to_string(folder.join("frames.csv")).unwrap();
    let column = table.lines().next().unwrap().split(',').position(|name| name == "segment");
    let segments: Vec<&str> =
        table.lines().skip(1).map(|row| row.split(',').nth(column.unwrap()).unwrap()).collect();
    let began = segments.iter().position(|segment| *segment == "1").unwrap();
    assert!(segments.len() == FRAMES && began >= 24, "{segments:?}");
    assert!(segments[..began].iter().all(|segment| *segment == "0"));
    assert!(segments[began..].iter().all(|segment| *segment == "1"));
    // The second segment's first camera is its origin.
    let poses = read_poses(&folder.join("trajectory_kitti.txt")).unwrap().poses;
    assert_eq!(poses[began].translation_m, [0.0, -100.0, 0.0]);
    assert!(poses[began - 1].translation_m[1].abs() < 5.0);
    let counts = triangles(&folder);
    assert!(counts.iter().all(|count| *count > 10_000), "{counts:?}");
    // The same map by way of the file of blocks.
    let run = self::run(root, &covered(root, "file", 3_000, &["--keep-blocks"]));
    assert!(run.status.success(), "{}", output_text(&run));
    assert_eq!(triangles(&root.join("file")), counts);
    assert!(fs::read(root.join("file/map.blocks")).unwrap().starts_with(b"dynvoxB3"));
}

#[dynvox_needs::long]
#[test]
fn a_run_killed_in_the_second_segment_goes_on_in_it() {
    let root = TempDir::new().unwrap();
    let root = root.path();
    // So few blocks that those of the first segment must leave.
    let args = |out: &'static str, more: &[&'static str]| covered(root, out, 1_500, more);
    assert!(run(root, &args("whole", &[])).status.success());
    let killed = args("killed", &["--snapshot-every", "5"]);
    let killed: Vec<&str> = killed.iter().map(String::as_str).collect();
    killed_at(root, &killed, "frame 32/34");
    let resumed = dynvox(root, &["run", "--resume", "killed"]);
    assert!(resumed.status.success(), "{}", output_text(&resumed));
    assert_same(root, "whole", "killed");
    assert!(triangles(&root.join("whole")).iter().all(|count| *count > 10_000));
}
