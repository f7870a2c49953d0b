//! Readers of recordings, meshes and plans, handed a file with any content.

use super::files::Folder;
use dynvox::fleet::{MANIFEST_FILE, Manifest, RECORDINGS_EXAMPLE, Recordings};
use dynvox::formats::{Axes, PlyMesh, PlyWriter};
use dynvox::input::{OpenOptions, open};
use dynvox_core::view::Vertex;
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use std::collections::BTreeMap;
use std::io::Cursor;

/// Triangles read of a mesh at most.
const TRIANGLES: usize = 1 << 16;

/// `sensor_msgs/Image` or `CameraInfo` in CDR, without its content.
fn message(content: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0];
    bytes.extend(b"cam\0");
    content(&mut bytes);
    bytes
}

/// A recording of one pair of two cameras, packed or not.
fn recording(compression: Option<Compression>) -> Vec<u8> {
    let image = message(|bytes| {
        bytes.extend([32u32, 48, 6].iter().flat_map(|word| word.to_le_bytes()));
        bytes.extend(b"mono8\0\0\0");
        bytes.extend([48u32, 48 * 32].iter().flat_map(|word| word.to_le_bytes()));
        bytes.extend((0..48 * 32).map(|at| (at * 37 % 251) as u8));
    });
    let info = |shift: f64| {
        message(|bytes| {
            bytes.extend([32u32, 48, 1, 0, 0, 0].iter().flat_map(|word| word.to_le_bytes()));
            let camera = [40.0, 0.0, 24.0, 0.0, 40.0, 16.0, 0.0, 0.0, 1.0];
            let turn = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
            let projection = [40.0, 0.0, 24.0, shift, 0.0, 40.0, 16.0, 0.0, 0.0, 0.0, 1.0, 0.0];
            let numbers = camera.iter().chain(&turn).chain(&projection);
            bytes.extend(numbers.flat_map(|number: &f64| number.to_le_bytes()));
        })
    };
    let mut writer = WriteOptions::new()
        .compression(compression)
        .create(Cursor::new(Vec::new()))
        .expect("a recording in memory");
    for (side, shift) in [("left", 0.0), ("right", -20.0)] {
        let messages =
            [("Image", "image_rect", image.clone()), ("CameraInfo", "camera_info", info(shift))];
        for (kind, topic, message) in messages {
            let schema = writer
                .add_schema(&format!("sensor_msgs/msg/{kind}"), "ros2msg", b"")
                .expect("a schema");
            let channel_id = writer
                .add_channel(schema, &format!("/{side}/{topic}"), "cdr", &BTreeMap::new())
                .expect("a channel");
            let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
            writer.write_to_known_channel(&header, &message).expect("a message");
        }
    }
    writer.finish().expect("an index");
    writer.into_inner().into_inner()
}

pub fn bags() -> Vec<Vec<u8>> {
    vec![recording(None), recording(Some(Compression::Zstd))]
}

pub fn bag(bytes: &[u8]) -> bool {
    let folder = Folder::new();
    let path = folder.file("recording.mcap", bytes);
    open(&path, &OpenOptions::default()).is_ok_and(|source| source.frame(0).is_ok())
}

pub fn meshes() -> Vec<Vec<u8>> {
    vec![super::files::written("map.ply", |path| {
        let mut ply = PlyWriter::begin_in(path, "a test", Axes::Camera).expect("a file");
        let corner = |x: f32| Vertex { position_m: [x, 0.0, 1.0], ..Vertex::default() };
        for x in [0.0, 1.0] {
            ply.triangle([corner(x), corner(x + 1.0), corner(x + 2.0)]);
        }
        ply.finish().expect("the file can be written");
    })]
}

pub fn mesh(bytes: &[u8]) -> bool {
    let folder = Folder::new();
    let path = folder.file("map.ply", bytes);
    let Ok(mesh) = PlyMesh::open(&path) else { return false };
    let mut count = 0;
    mesh.triangles(|_| count += 1).is_ok() && count <= TRIANGLES
}

pub fn plans() -> Vec<Vec<u8>> {
    let small: &[u8] = b"\0[[recording]]\nname = \"a\"\narguments = [\"a\"]\n";
    let files: &[u8] =
        b"\x02rosbag2_bagfile_information:\n  version: 5\n  compression_mode: ''\n  \
                         relative_file_paths:\n    - a_0.mcap\n";
    vec![small.to_vec(), [b"\0", RECORDINGS_EXAMPLE.as_bytes()].concat(), files.to_vec()]
}

/// A list of recordings, of jobs or of a recording's files, by the first byte.
pub fn plan(bytes: &[u8]) -> bool {
    let Some((kind, content)) = bytes.split_first() else { return false };
    let folder = Folder::new();
    match kind % 3 {
        0 => return Recordings::read(&folder.file("list.toml", content)).is_ok(),
        2 => {
            folder.file("a_0.mcap", &recording(None));
            folder.file("metadata.yaml", content);
            return open(folder.path(), &OpenOptions::default()).is_ok();
        }
        _ => {}
    }
    folder.file(MANIFEST_FILE, content);
    Manifest::read(folder.path()).is_ok()
}
