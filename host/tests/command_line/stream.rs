//! `dynvox run -`: the street's frames through a pipe are the street's frames from a folder.

use super::binary::{dynvox, names, output_text};
use image::GrayImage;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

const FRAMES: usize = 6;
const SMALL: [&str; 4] = ["--set", "street.width=160", "--set", "street.height=64"];
/// Settings of a coarse map, for tests that do not look at the map.
const COARSE: [&str; 6] =
    ["--profile", "tiny", "--instances", "none", "--set", "volume.voxel_size_m=0.2"];

/// A written street, and its run from the folder.
fn street() -> TempDir {
    let root = TempDir::new().unwrap();
    let written =
        dynvox(root.path(), &[&["synth", "--out", "street", "--frames", "6"], &SMALL[..]].concat());
    assert!(written.status.success(), "{}", output_text(&written));
    let run = dynvox(
        root.path(),
        &[&["run", "street", "--images", "grey", "--quiet", "--out", "folder"], &COARSE[..]]
            .concat(),
    );
    assert!(run.status.success(), "{}", output_text(&run));
    root
}

fn picture(root: &Path, side: usize, frame: usize) -> GrayImage {
    image::open(root.join(format!("street/sequences/00/image_{side}/{frame:06}.png")))
        .unwrap()
        .into_luma8()
}

fn pgm(image: GrayImage) -> Vec<u8> {
    let header = format!("P5\n{} {}\n255\n", image.width(), image.height());
    [header.as_bytes(), image.as_raw()].concat()
}

/// Left and right image of every frame in turn.
fn in_turn(root: &Path) -> Vec<u8> {
    (0..FRAMES)
        .flat_map(|frame| [0, 1].map(|side| pgm(picture(root, side, frame))).concat())
        .collect()
}

/// Both images of every frame in one, above one another or side by side.
fn stacked(root: &Path, top_bottom: bool) -> Vec<u8> {
    let both = |frame| {
        let [left, right] = [0, 1].map(|side| picture(root, side, frame));
        let (width, height) = left.dimensions();
        let (columns, rows) = if top_bottom { (width, 2 * height) } else { (2 * width, height) };
        pgm(GrayImage::from_fn(columns, rows, |u, v| {
            if u < width && v < height {
                *left.get_pixel(u, v)
            } else {
                *right.get_pixel(u % width, v % height)
            }
        }))
    };
    (0..FRAMES).flat_map(both).collect()
}

/// Runs on the bytes of a stream.
fn piped(root: &Path, bytes: &[u8], out: &str, more: &[&str]) -> Output {
    let base = ["run", "-", "--calibration", "street/sequences/00/calib.txt", "--out", out];
    let mut run = Command::new(env!("CARGO_BIN_EXE_dynvox"))
        .args([&base[..], &COARSE, more].concat())
        .current_dir(root)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A run that is refused reads no further.
    let _ = run.stdin.take().unwrap().write_all(bytes);
    run.wait_with_output().unwrap()
}

fn summary(root: &Path, out: &str) -> serde_json::Value {
    serde_json::from_slice(&fs::read(root.join(out).join("summary.json")).unwrap()).unwrap()
}

#[test]
fn a_piped_street_has_the_folders_digests_in_any_arrangement() {
    let root = street();
    let root = root.path();
    let folder = summary(root, "folder")["digest"].clone();
    for (out, bytes, how) in [
        // Left and right in turn, beside each other, and one above the other.
        ("in-turn", in_turn(root), None),
        ("side-by-side", stacked(root, false), Some("--side-by-side")),
        ("top-bottom", stacked(root, true), Some("--top-bottom")),
    ] {
        let more: Vec<&str> = ["--rate", "10"].into_iter().chain(how).collect();
        let run = piped(root, &bytes, out, &more);
        assert!(run.status.success(), "{out}: {}", output_text(&run));
        let of = summary(root, out);
        assert_eq!(
            (&of["digest"], &of["frames"], &of["dataset"]),
            (&folder, &FRAMES.into(), &"stream".into()),
            "{out}"
        );
        // Nothing was dropped: the writer waits for the mapper.
        assert_eq!((&of["input"]["dropped"], of["incomplete"].is_null()), (&0.into(), true));
    }
    let tum = |out: &str| fs::read_to_string(root.join(out).join("trajectory_tum.txt")).unwrap();
    assert_eq!(tum("in-turn"), tum("folder"));
    // Of the frames 0 to 5 the second and the fourth.
    let run = piped(
        root,
        &in_turn(root),
        "half",
        &["--stride", "2", "--frames", "2", "--start", "1", "--rate", "10"],
    );
    assert!(run.status.success(), "{}", output_text(&run));
    let csv = fs::read_to_string(root.join("half/frames.csv")).unwrap();
    assert_eq!(
        csv.lines().skip(1).map(|line| line.split(',').next().unwrap()).collect::<Vec<_>>(),
        ["1", "3"]
    );
}

#[test]
fn a_camera_faster_than_the_mapper_loses_frames_that_are_counted() {
    let root = street();
    let run = piped(
        root.path(),
        &in_turn(root.path()).repeat(20),
        "result",
        &["--when-late", "drop", "--quiet"],
    );
    assert!(run.status.success(), "{}", output_text(&run));
    let of = summary(root.path(), "result");
    let [frames, dropped] =
        [&of["frames"], &of["input"]["dropped"]].map(|count| count.as_u64().unwrap());
    assert!(dropped > 0, "a pipe is faster than a mapper: {frames} frames");
    assert_eq!(frames + dropped, 20 * FRAMES as u64);
}

#[cfg(target_os = "linux")]
#[dynvox_needs::long]
#[test]
fn memory_does_not_grow_with_the_stream() {
    const ROUNDS: usize = 200;
    let root = street();
    let one_thread = ["--quiet", "--threads", "1", "--set", "volume.prune_lag=5"];
    let run = piped(root.path(), &in_turn(root.path()).repeat(ROUNDS), "result", &one_thread);
    assert!(run.status.success(), "{}", output_text(&run));
    let csv = fs::read_to_string(root.path().join("result/frames.csv")).unwrap();
    let mut lines = csv.lines();
    let column = lines.next().unwrap().split(',').position(|name| name == "rss_bytes").unwrap();
    let resident: Vec<i64> =
        lines.map(|line| line.split(',').nth(column).unwrap().parse().unwrap()).collect();
    assert_eq!(resident.len(), ROUNDS * FRAMES);
    // A row kept in memory would be 2 KiB, 1.6 MiB in all; charts and histograms fill up to their
    // bounds. The stream's end, which is read a few frames ahead, takes 384 KiB once: no growth.
    let (from, to) = (resident.len() / 3, resident.len() - 2 * FRAMES);
    let grown = resident[to] - resident[from];
    assert!(grown < 1 << 20, "{grown} bytes in {} frames", to - from);
}

#[test]
fn a_stream_that_stops_inside_an_image_is_an_incomplete_run() {
    let root = street();
    let bytes = in_turn(root.path());
    // The last image ends early, and with it the sixth pair.
    let run = piped(root.path(), &bytes[..bytes.len() - 5_000], "result", &["--quiet"]);
    assert_eq!(run.status.code(), Some(4), "{}", output_text(&run));
    assert!(
        output_text(&run)
            .contains("image 11 of the stream cannot be used: the stream stopped inside it"),
        "{}",
        output_text(&run)
    );
    let of = summary(root.path(), "result");
    assert_eq!((&of["frames"], &of["incomplete"]["cause"]), (&5.into(), &"input".into()), "{of}");
    // How many frames would have come is not known of a stream.
    assert!(
        of["incomplete"]["frames_left"].is_null() && root.path().join("result/map.ply").is_file()
    );
}

#[test]
fn what_a_stream_cannot_do_is_refused_with_a_sentence() {
    let root = street();
    let refused = |bytes: &[u8], more: &[&str], sentence: &str| {
        let run = piped(root.path(), bytes, "result", more);
        assert_eq!(run.status.code(), Some(1), "{more:?}");
        assert!(output_text(&run).contains(sentence), "{more:?}: {}", output_text(&run));
        // A refusal leaves no folder.
        assert_eq!(names(root.path()), ["folder", "street"]);
    };
    refused(b"", &[], "standard input ended without an image");
    refused(b"\x89PNG", &[], "binary PGM (P5) and PPM (P6) are read");
    refused(b"", &["--snapshot-every", "5"], "--snapshot-every needs a recording");
    refused(b"", &["--evaluate", "lidar"], "--evaluate needs a recording");
    refused(b"", &["--egomotion", "file:poses.txt"], "--egomotion file needs a recording");
    refused(b"", &["--depth", "exact"], "--depth needs a recording");
    // A stream has no calibration beside it.
    let run = dynvox(root.path(), &["run", "-", "--out", "result"]);
    assert!(output_text(&run).contains("Give one with --calibration"), "{}", output_text(&run));
    let run = dynvox(root.path(), &["run", "street", "--rate", "30", "--out", "result"]);
    assert!(
        output_text(&run).contains("--rate and --when-late are for a stream"),
        "{}",
        output_text(&run)
    );
}

#[cfg(unix)]
#[test]
fn a_signal_is_the_usual_end_of_a_stream() {
    let root = street();
    let mut run = Command::new(env!("CARGO_BIN_EXE_dynvox"))
        .args(
            [
                &["run", "-", "--calibration", "street/sequences/00/calib.txt", "--out", "result"],
                &COARSE[..],
            ]
            .concat(),
        )
        .current_dir(root.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut camera = run.stdin.take().unwrap();
    camera.write_all(&in_turn(root.path())).unwrap();
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(run.stderr.take().unwrap()))
        .map(Result::unwrap);
    assert!(lines.any(|line| line.starts_with("frame 1 ")), "it is under way");
    // The camera stays open and silent.
    Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap();
    let status = run.wait().unwrap();
    assert!(status.success(), "{status} {:?}", lines.collect::<Vec<_>>());
    let of = summary(root.path(), "result");
    assert!(
        (1..=FRAMES as u64).contains(&of["frames"].as_u64().unwrap()) && of["incomplete"].is_null(),
        "{of}"
    );
    drop(camera);
}
