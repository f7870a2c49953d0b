//! A street recorded as an MCAP file is the street of the folder.

use super::binary::{dynvox, names, output_text};
use mcap::records::MessageHeader;
use std::collections::BTreeMap;
use std::fs;
use std::io::BufWriter;
use std::path::Path;
use tempfile::TempDir;

const FRAMES: usize = 5;
const NS: u64 = 100_000_000;

/// A message in CDR.
#[derive(Default)]
struct Cdr(Vec<u8>);

impl Cdr {
    fn with_header(ns: u64) -> Self {
        let mut cdr = Self(vec![0, 1, 0, 0]);
        cdr.u32((ns / 1_000_000_000) as u32);
        cdr.u32((ns % 1_000_000_000) as u32);
        cdr.text("camera");
        cdr
    }

    fn align(&mut self, to: usize) {
        while !(self.0.len() - 4).is_multiple_of(to) {
            self.0.push(0);
        }
    }

    fn u32(&mut self, value: u32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.u32(bytes.len() as u32);
        self.0.extend(bytes);
    }

    fn text(&mut self, text: &str) {
        self.bytes(format!("{text}\0").as_bytes());
    }

    fn f64s(&mut self, values: &[f64]) {
        for value in values {
            self.align(8);
            self.0.extend(value.to_le_bytes());
        }
    }
}

fn picture(root: &Path, side: usize, frame: usize) -> image::GrayImage {
    image::open(root.join(format!("street/sequences/00/image_{side}/{frame:06}.png")))
        .unwrap()
        .into_luma8()
}

/// Both encodings of a picture: raw, or its PNG file.
fn message(root: &Path, side: usize, frame: usize, compressed: bool) -> Vec<u8> {
    // A header with the frame's time, then the message's own fields.
    let mut cdr = Cdr::with_header(frame as u64 * NS);
    if compressed {
        cdr.text("png");
        cdr.bytes(
            &fs::read(root.join(format!("street/sequences/00/image_{side}/{frame:06}.png")))
                .unwrap(),
        );
        return cdr.0;
    }
    let picture = picture(root, side, frame);
    cdr.u32(picture.height());
    cdr.u32(picture.width());
    cdr.text("mono8");
    // Little-endian.
    cdr.0.push(0);
    cdr.u32(picture.width());
    cdr.bytes(picture.as_raw());
    cdr.0
}

/// The rig of the street as `CameraInfo`.
fn info(root: &Path, side: usize) -> Vec<u8> {
    let calib = fs::read_to_string(root.join("street/sequences/00/calib.txt")).unwrap();
    let line = calib.lines().find(|line| line.starts_with(&format!("P{side}:"))).unwrap();
    let p: Vec<f64> = line.split_whitespace().skip(1).map(|word| word.parse().unwrap()).collect();
    let mut cdr = Cdr::with_header(0);
    cdr.u32(96);
    cdr.u32(320);
    cdr.text("plumb_bob");
    cdr.u32(5);
    cdr.f64s(&[0.0; 5]);
    cdr.f64s(&[p[0], p[1], p[2], p[4], p[5], p[6], p[8], p[9], p[10]]);
    cdr.f64s(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    cdr.f64s(&p);
    cdr.0
}

/// Writes the street as a recording.
fn record(root: &Path, name: &str, compressed: bool) {
    let file = BufWriter::new(fs::File::create(root.join(name)).unwrap());
    // Several chunks.
    let mut writer = mcap::WriteOptions::new().chunk_size(Some(100_000)).create(file).unwrap();
    let kind = if compressed { "sensor_msgs/msg/CompressedImage" } else { "sensor_msgs/msg/Image" };
    let images = writer.add_schema(kind, "ros2msg", b"").unwrap();
    let infos = writer.add_schema("sensor_msgs/msg/CameraInfo", "ros2msg", b"").unwrap();
    let ending = if compressed { "image_rect/compressed" } else { "image_rect" };
    let channels = ["left", "right"].map(|side| {
        let mut add = |schema, topic: String| {
            writer.add_channel(schema, &topic, "cdr", &BTreeMap::new()).unwrap()
        };
        [
            add(images, format!("/stereo/{side}/{ending}")),
            add(infos, format!("/stereo/{side}/camera_info")),
        ]
    });
    for frame in 0..FRAMES {
        for (side, [image, calibration]) in channels.iter().enumerate() {
            // Recorded later than taken, the right camera later than the left one.
            let log_time = frame as u64 * NS + 7_000_000 * (side as u64 + 1);
            let header = |channel_id| MessageHeader {
                channel_id,
                sequence: frame as u32,
                log_time,
                publish_time: log_time,
            };
            writer.write_to_known_channel(&header(*calibration), &info(root, side)).unwrap();
            writer
                .write_to_known_channel(&header(*image), &message(root, side, frame, compressed))
                .unwrap();
        }
    }
    writer.finish().unwrap();
}

#[test]
fn a_recorded_street_has_the_folders_digests_and_broken_ones_a_sentence() {
    let root = TempDir::new().unwrap();
    let root = root.path();
    let size = ["--set", "street.width=320", "--set", "street.height=96"];
    assert!(
        dynvox(root, &[&["synth", "--out", "street", "--frames", "5"], &size[..]].concat())
            .status
            .success()
    );
    let coarse = ["--profile", "tiny", "--instances", "none", "--set", "volume.voxel_size_m=0.2"];
    let digest = |path: &str, out: &str, more: &[&str]| {
        let run =
            dynvox(root, &[&["run", path, "--json", "--out", out], &coarse[..], more].concat());
        assert!(run.status.success(), "{path}: {}", output_text(&run));
        serde_json::from_slice::<serde_json::Value>(&run.stdout).unwrap()["digest"].clone()
    };
    // The same digests from raw and compressed messages, with topics found and topics named.
    let folder = digest("street", "folder", &["--images", "grey"]);
    record(root, "raw.mcap", false);
    record(root, "compressed.mcap", true);
    assert_eq!(digest("raw.mcap", "raw", &[]), folder);
    assert_eq!(digest("compressed.mcap", "compressed", &[]), folder);
    let named = [
        "--topics",
        "/stereo/left/image_rect,/stereo/right/image_rect",
        "--calibration",
        "street/sequences/00/calib.txt",
    ];
    assert_eq!(digest("raw.mcap", "named", &named), folder);
    let inspected = dynvox(root, &["inspect", "raw.mcap"]);
    let text = String::from_utf8_lossy(&inspected.stdout).into_owned();
    assert!(
        inspected.status.success()
            && text.contains("5 stereo pairs of 320 x 96 px")
            && text.contains("dynvox run raw.mcap"),
        "{text}"
    );

    // Recordings that are cut off or of another format.
    let whole = fs::read(root.join("raw.mcap")).unwrap();
    fs::write(root.join("cut.mcap"), &whole[..whole.len() / 2]).unwrap();
    fs::write(root.join("old.db3"), "SQLite").unwrap();
    fs::write(root.join("old.bag"), "#ROSBAG").unwrap();
    let before = names(root);
    for (path, more, sentence) in [
        ("cut.mcap", &[][..], "Repair it with `mcap recover cut.mcap -o repaired.mcap`"),
        ("old.db3", &[], "`rosbags-convert --src old.db3 --dst old-mcap --dst-storage mcap`"),
        ("old.bag", &[], "`rosbags-convert --src old.bag --dst old-mcap --dst-storage mcap`"),
        (
            "raw.mcap",
            &["--topics", "/a,/b"],
            "it has no images at /a. Its image topics are /stereo/left/image_rect, ",
        ),
    ] {
        let run = dynvox(root, &[&["run", path, "--out", "result"], more].concat());
        assert_eq!(run.status.code(), Some(1), "{path}");
        let refusal = output_text(&run).replace(&format!("{}/", root.display()), "");
        assert!(refusal.contains(sentence), "{path}: {refusal}");
    }
    // No refused run leaves a folder.
    assert_eq!(names(root), before);
}
