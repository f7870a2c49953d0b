//! Recordings as recorders leave them: split, without times, with `CameraInfo` of other images.

use super::{align, image, text};
use crate::input::source::FrameSource;
use crate::input::{OpenOptions, open};
use dynvox_core::random::Random;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const NS: u64 = 100_000_000;
const SIZE: [u32; 2] = [96, 64];
const DISPARITY_PX: u32 = 6;

/// Messages of a pair of cameras, as they are to be recorded.
struct Rig {
    topic: &'static str,
    encoding: &'static str,
    /// Size that `CameraInfo` says.
    size: [u32; 2],
    distortion: [f64; 5],
    right_projection: [f64; 12],
    /// Header of frame `n`, ns.
    header_ns: fn(u64) -> u64,
    /// Factor of the pixels of frame `n`.
    gain: fn(u64) -> u16,
    /// Topics of inertial samples with their turn rate and acceleration, 20 a frame.
    units: &'static [(&'static str, f64, f64)],
}

const P: [f64; 12] = [60.0, 0.0, 47.5, 0.0, 0.0, 60.0, 31.5, 0.0, 0.0, 0.0, 1.0, 0.0];

impl Default for Rig {
    fn default() -> Self {
        let mut right_projection = P;
        right_projection[3] = -12.0;
        Self {
            topic: "image_rect",
            encoding: "mono8",
            size: SIZE,
            distortion: [0.0; 5],
            right_projection,
            header_ns: |frame| (frame + 1) * NS,
            gain: |_| 1,
            units: &[],
        }
    }
}

/// `sensor_msgs/Imu` at a time.
fn inertial(time_ns: u64, turn: f64, force: f64) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(((time_ns / 1_000_000_000) as u32).to_le_bytes());
    bytes.extend(((time_ns % 1_000_000_000) as u32).to_le_bytes());
    text(&mut bytes, "imu");
    align(&mut bytes, 8);
    // Orientation and covariance; turn rates; theirs; accelerations; theirs.
    let numbers = (0..37).map(|at| match at {
        13 => turn,
        27 => force,
        _ => 0.0,
    });
    bytes.extend(numbers.flat_map(f64::to_le_bytes));
    bytes
}

/// A texture that two cameras see at one distance.
fn texture(side: u32) -> Vec<u8> {
    let mut random = Random::new(7);
    let width = SIZE[0] + DISPARITY_PX;
    let noise: Vec<u8> = (0..width * SIZE[1]).map(|_| random.below(200) as u8 + 20).collect();
    (0..SIZE[1])
        .flat_map(|v| (0..SIZE[0]).map(move |u| (v * width + u + side * DISPARITY_PX) as usize))
        .map(|at| noise[at])
        .collect()
}

impl Rig {
    fn image(&self, side: u32, frame: u64) -> Vec<u8> {
        let pixels = texture(side);
        let [width, height] = SIZE;
        let gain = (self.gain)(frame);
        let (step, data) = if self.encoding == "mono16" {
            let samples = pixels.iter().map(|pixel| u16::from(*pixel) * gain);
            (2 * width, samples.flat_map(u16::to_le_bytes).collect())
        } else {
            (width, pixels)
        };
        let mut message = image(width, height, self.encoding, step, &data);
        self.stamp(&mut message, frame);
        message
    }

    fn stamp(&self, message: &mut [u8], frame: u64) {
        let ns = (self.header_ns)(frame);
        message[4..8].copy_from_slice(&((ns / 1_000_000_000) as u32).to_le_bytes());
        message[8..12].copy_from_slice(&((ns % 1_000_000_000) as u32).to_le_bytes());
    }

    fn info(&self, side: usize) -> Vec<u8> {
        let mut bytes = vec![0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
        text(&mut bytes, "cam");
        align(&mut bytes, 4);
        bytes.extend([self.size[1], self.size[0]].iter().flat_map(|side| side.to_le_bytes()));
        text(&mut bytes, "plumb_bob");
        align(&mut bytes, 4);
        bytes.extend(5u32.to_le_bytes());
        align(&mut bytes, 8);
        let projection = if side == 0 { P } else { self.right_projection };
        let camera = [P[0], 0.0, P[2], 0.0, P[5], P[6], 0.0, 0.0, 1.0];
        let turn = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let numbers = self.distortion.iter().chain(&camera).chain(&turn).chain(&projection);
        bytes.extend(numbers.flat_map(|number| number.to_le_bytes()));
        bytes
    }

    /// Records frames into a file.
    fn record(&self, path: &Path, frames: std::ops::Range<u64>, options: WriteOptions) {
        let file = std::io::BufWriter::new(fs::File::create(path).unwrap());
        let mut writer = options.create(file).unwrap();
        let kinds = ["sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"]
            .map(|kind| writer.add_schema(kind, "ros2msg", b"").unwrap());
        let channels = ["left", "right"].map(|side| {
            [(kinds[0], self.topic), (kinds[1], "camera_info")].map(|(kind, topic)| {
                writer.add_channel(kind, &format!("/{side}/{topic}"), "cdr", &BTreeMap::new())
            })
        });
        for frame in frames {
            for (side, channels) in channels.iter().enumerate() {
                let log_time = frame * NS + 5_000_000 + side as u64;
                let messages = [self.image(side as u32, frame), self.info(side)];
                for (channel, message) in channels.iter().zip(messages) {
                    let header = MessageHeader {
                        channel_id: *channel.as_ref().unwrap(),
                        sequence: 0,
                        log_time,
                        publish_time: log_time,
                    };
                    writer.write_to_known_channel(&header, &message).unwrap();
                }
            }
        }
        let kind = writer.add_schema("sensor_msgs/msg/Imu", "ros2msg", b"").unwrap();
        for (topic, turn, force) in self.units {
            let channel = writer.add_channel(kind, topic, "cdr", &BTreeMap::new()).unwrap();
            for at in 0..140u64 {
                let time_ns = NS + at * 5_000_000;
                let message = inertial(time_ns, turn * at as f64, *force);
                let header = MessageHeader {
                    channel_id: channel,
                    sequence: 0,
                    log_time: time_ns,
                    publish_time: time_ns,
                };
                writer.write_to_known_channel(&header, &message).unwrap();
            }
        }
        writer.finish().unwrap();
    }

    /// Records six frames into a folder and opens them.
    fn open_in(&self, folder: &TempDir) -> Result<Box<dyn FrameSource>, String> {
        let path = folder.path().join("a.mcap");
        self.record(&path, 0..6, WriteOptions::new());
        open(&path, &OpenOptions::default()).map_err(|error| error.to_string())
    }

    fn notes(&self) -> String {
        let folder = TempDir::new().unwrap();
        self.open_in(&folder).unwrap_or_else(|error| panic!("{error}")).info().notes.join("\n")
    }

    fn refusal(&self) -> String {
        let folder = TempDir::new().unwrap();
        self.open_in(&folder).err().unwrap_or_else(|| panic!("opened"))
    }
}

#[test]
fn all_files_of_a_split_recording_are_mapped_in_order() {
    let folder = TempDir::new().unwrap();
    let rig = Rig::default();
    for (number, from) in [(9, 0), (10, 2), (11, 4)] {
        let path = folder.path().join(format!("drive_{number}.mcap"));
        rig.record(&path, from..from + 2, WriteOptions::new());
    }
    let opened = |path: &Path| open(path, &OpenOptions::default()).unwrap();
    let whole = opened(folder.path());
    let stamps: Vec<_> = (0..whole.len()).map(|at| whole.stamp_ns(at).unwrap() / NS).collect();
    assert_eq!(stamps, [1, 2, 3, 4, 5, 6]);
    assert!(whole.info().notes.iter().any(|note| note.starts_with("3 files of one recording")));
    assert!(whole.frame(5).is_ok());
    let part = opened(&folder.path().join("drive_10.mcap"));
    assert_eq!(part.len(), 2);
    let note = part.info().notes.iter().find(|note| note.contains("one of 3 files"));
    assert!(note.is_some(), "{:?}", part.info().notes);
}

#[test]
fn headers_without_times_are_said_and_nothing_is_lost() {
    let folder = TempDir::new().unwrap();
    for header_ns in [(|_| 0) as fn(u64) -> u64, |_| 5 * NS] {
        let source = Rig { header_ns, ..Rig::default() }.open_in(&folder).unwrap();
        assert_eq!(source.len(), 6);
        assert_eq!(source.stamp_ns(1), Some(NS + 5_000_000));
        let notes = source.info().notes.join("\n");
        assert!(notes.contains("times of recording are taken"), "{notes}");
        assert!((0..6).all(|frame| source.frame(frame).is_ok()));
    }
    let twice = Rig { header_ns: |frame| (frame.min(4) + 1) * NS, ..Rig::default() };
    assert!(twice.notes().contains("1 left and 1 right images repeat"), "{}", twice.notes());
}

#[test]
fn the_content_of_camera_info_tells_raw_images_and_never_a_name() {
    let distortion = [-0.3, 0.1, 0.0, 0.0, 0.0];
    let topic = "direct/image_raw";
    let notes = Rig { topic, distortion, ..Rig::default() }.notes();
    assert!(notes.contains("raw, radial-tangential, 96 x 64"), "{notes}");
    let plain = Rig { topic, ..Rig::default() }.notes();
    assert!(plain.contains("\nrectified, 96 x 64"), "{plain}");
    // A program that rectifies publishes the raw camera's info: the rows tell.
    let notes = Rig { topic: "image_rect", distortion, ..Rig::default() }.notes();
    assert!(notes.contains("taken as rectified") && notes.contains("\nrectified"), "{notes}");
}

#[test]
fn camera_info_is_checked_as_files_are() {
    let projection = |entry: usize, value: f64| {
        let mut right_projection = Rig::default().right_projection;
        right_projection[entry] = value;
        Rig { right_projection, ..Rig::default() }.refusal()
    };
    let other_size = Rig { size: [192, 128], ..Rig::default() }.refusal();
    assert!(other_size.contains("it is for images of 192 x 128 px, but these are 96 x 64"));
    let center = projection(2, 55.5);
    assert!(center.contains("principal points of the two projection matrices"), "{center}");
    let focal = projection(0, 70.0);
    assert!(focal.contains("focal length"), "{focal}");
    let exchanged = projection(3, 12.0);
    assert!(exchanged.contains("--swap"), "{exchanged}");
    let blank = projection(0, 0.0);
    assert!(blank.contains("is 0") && blank.contains("--calibration FILE"), "{blank}");
    let mut above = P;
    above[7] = -12.0;
    let vertical = Rig { right_projection: above, ..Rig::default() }.refusal();
    assert!(vertical.contains("the second camera stands"), "{vertical}");
}

#[test]
fn the_bits_of_deep_images_are_told_by_several_of_them() {
    let rig =
        Rig { encoding: "mono16", gain: |frame| 1 + 15 * frame.min(1) as u16, ..Rig::default() };
    let folder = TempDir::new().unwrap();
    let source = rig.open_in(&folder).unwrap();
    let notes = source.info().notes.join("\n");
    assert!(notes.contains("12 bits are taken as significant"), "{notes}");
    let bright = source.frame(3).unwrap();
    assert_eq!(bright.left.pixels(), texture(0), "16 times the texture, of 12 bits");
}

#[test]
fn a_file_without_chunks_or_end_is_refused_with_a_command() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.mcap");
    let refusal = |path: &Path| open(path, &OpenOptions::default()).err().unwrap().to_string();
    Rig::default().record(&path, 0..2, WriteOptions::new().use_chunks(false));
    let unchunked = refusal(&path);
    assert!(unchunked.contains("not in chunks") && unchunked.contains("mcap recover"));
    Rig::default().record(&path, 0..2, WriteOptions::new());
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() - 9]).unwrap();
    let cut = refusal(&path);
    assert!(cut.contains("cut off") && cut.contains("mcap recover"), "{cut}");
}

#[test]
fn inertial_messages_become_a_unit_where_its_mounting_is_given() {
    let folder = TempDir::new().unwrap();
    let mounting = folder.path().join("mount.txt");
    fs::write(&mounting, "0 -1 0 0.05 0 0 -1 0 1 0 0 0\n").unwrap();
    let given = OpenOptions { inertial_calibration: vec![mounting], ..OpenOptions::default() };
    for units in [&[("/imu", 0.01, 9.8)][..], &[("/cam/accel", 0.0, 9.8), ("/cam/gyro", 0.01, 0.0)]]
    {
        let rig = Rig { units, ..Rig::default() };
        let path = folder.path().join("a.mcap");
        rig.record(&path, 0..6, WriteOptions::new());
        let source = open(&path, &given).unwrap();
        let unit = source.info().inertial.clone().unwrap();
        assert!((unit.rate_hz - 200.0).abs() < 1e-6);
        let of_frame = unit.between(Some(2 * NS), 3 * NS);
        assert_eq!((of_frame.len(), of_frame[0].time_ns), (20, 205_000_000));
        assert!((of_frame[0].turn_rate[0] - 0.21).abs() < 1e-9, "{:?}", of_frame[0]);
        assert_eq!(of_frame[0].force, [0.0, 0.0, 9.8]);
        // Without a mounting the unit is said, and not used.
        let source = rig.open_in(&folder).unwrap();
        assert!(source.info().inertial.is_none());
        let notes = source.info().notes.join("\n");
        assert!(notes.contains("nothing says how the inertial unit is mounted"), "{notes}");
    }
    let silent = Rig { units: &[("/imu", 0.01, 0.0)], ..Rig::default() };
    let source = silent.open_in(&folder).unwrap();
    assert!(source.info().own_unit.is_none(), "a gyroscope alone is no unit");
}
