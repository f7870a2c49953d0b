//! MCAP files.

use super::pictures::png;
use super::{Bomb, Call, above};
use dynvox_core::random::Random;
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Cursor};
use std::path::Path;

const SIDES: &str = "at most 8,192 px a side are read";

pub const KINDS: &[Bomb] = &[
    Bomb { name: "MCAP image of rows 0 bytes apart", bound: SIDES, make: step_0 },
    Bomb { name: "MCAP image of many rows 0 bytes apart", bound: "(step)", make: rows_at_0 },
    Bomb { name: "MCAP image of large sides", bound: SIDES, make: sides },
    Bomb { name: "MCAP image without its data", bound: "fewer bytes", make: no_data },
    Bomb { name: "MCAP compressed image of large sides", bound: SIDES, make: compressed },
    Bomb { name: "MCAP chunk that unpacks to much", bound: "of a chunk", make: long_chunk },
    Bomb {
        name: "MCAP chunks that unpack to much",
        bound: "its chunks unpack",
        make: many_chunks,
    },
    Bomb { name: "MCAP of many topics", bound: "at most 256 are read", make: topics },
    Bomb { name: "MCAP whose end is a hole", bound: "mcap recover", make: hole },
    Bomb {
        name: "list of a recording's files with nested aliases",
        bound: "no list of a recording's files",
        make: list_aliases,
    },
    Bomb {
        name: "recording of many files",
        bound: "at most 1,000 are read",
        make: many_files,
    },
    Bomb { name: "MCAP with a long index", bound: "mcap recover", make: index },
    Bomb {
        name: "MCAP whose index has a long text",
        bound: "ends beyond its record",
        make: long_text,
    },
    Bomb {
        name: "MCAP whose channels have many entries",
        bound: "more than the 100,000 entries",
        make: entries,
    },
];

/// `sensor_msgs/Image` in CDR.
fn image(size: [u32; 2], step: u32, data: &[u8]) -> Vec<u8> {
    let [width, height] = size;
    let mut bytes = vec![0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
    let text = |bytes: &mut Vec<u8>, text: &str| {
        bytes.extend((text.len() as u32 + 1).to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes.push(0);
    };
    text(&mut bytes, "cam");
    bytes.extend([height, width].iter().flat_map(|side| side.to_le_bytes()));
    // Five letters, a zero, the order of bytes: then a number is aligned again.
    text(&mut bytes, "mono8");
    bytes.push(0);
    bytes.push(0);
    bytes.extend(step.to_le_bytes());
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes
}

/// A recording of two cameras, with some of each message.
fn recording(root: &Path, kind: &str, messages: usize, message: &[u8]) {
    let file = BufWriter::new(File::create(root.join("m.mcap")).unwrap());
    let options =
        // Compressed, since a bomb is small on disk.
        WriteOptions::new().compression(Some(Compression::Zstd)).chunk_size(Some(1 << 20));
    let mut writer = options.create(file).unwrap();
    let schema = writer.add_schema(kind, "ros2msg", b"").unwrap();
    let channels = ["/left/image_rect", "/right/image_rect"]
        .map(|topic| writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap());
    for at in 0..messages {
        for channel_id in channels {
            // Zero is no time.
            let log_time = at as u64 + 1;
            let header =
                MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, message).unwrap();
        }
    }
    writer.finish().unwrap();
}

fn call(random: &mut Random) -> Call {
    Call::new(if random.below(2) == 0 { &["inspect", "m.mcap"] } else { &["run", "m.mcap"] })
}

fn of_image(root: &Path, random: &mut Random, message: &[u8]) -> Call {
    recording(root, "sensor_msgs/msg/Image", 2, message);
    call(random)
}

fn step_0(root: &Path, random: &mut Random) -> Call {
    let rows = 4_000_000_000 + random.below(200_000_000);
    of_image(root, random, &image([1, rows], 0, &[7]))
}

fn rows_at_0(root: &Path, random: &mut Random) -> Call {
    let size = [1_000 + random.below(7_000), 1_000 + random.below(7_000)];
    let step = random.below(size[0]);
    of_image(root, random, &image(size, step, &[7; 10_000]))
}

fn sides(root: &Path, random: &mut Random) -> Call {
    let size = [above(8_193, random), above(8_193, random)];
    of_image(root, random, &image(size, size[0], &[7]))
}

fn no_data(root: &Path, random: &mut Random) -> Call {
    let size = [8_192 - random.below(99), 8_192 - random.below(99)];
    of_image(root, random, &image(size, size[0], &[7; 1_000]))
}

fn compressed(root: &Path, random: &mut Random) -> Call {
    let size = [above(8_193, random), above(8_193, random)];
    let file = png(size, [8, 0, 0, 0, 0], &[(b"IDAT", vec![0; 1_000])]);
    let mut message = vec![0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0];
    message.extend(b"cam\0\x04\0\0\0png\0");
    message.extend((file.len() as u32).to_le_bytes());
    message.extend(&file);
    recording(root, "sensor_msgs/msg/CompressedImage", 2, &message);
    call(random)
}

fn long_chunk(root: &Path, random: &mut Random) -> Call {
    let bytes = (49 << 20) + random.below(50 << 20) as usize;
    of_image(root, random, &image([100, 100], 100, &vec![0; bytes]))
}

/// Chunks of 16 MiB of one value each.
fn many_chunks(root: &Path, random: &mut Random) -> Call {
    let messages = 4 + random.below(4) as usize;
    let message = image([100, 100], 100, &vec![0; 16 << 20]);
    recording(root, "sensor_msgs/msg/Image", messages, &message);
    call(random)
}

fn topics(root: &Path, random: &mut Random) -> Call {
    let file = BufWriter::new(File::create(root.join("m.mcap")).unwrap());
    let mut writer = WriteOptions::new().create(file).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/Image", "ros2msg", b"").unwrap();
    for at in 0..5_000 + random.below(20_000) {
        let topic = format!("/left{at}/image");
        let channel_id = writer.add_channel(schema, &topic, "cdr", &BTreeMap::new()).unwrap();
        if at == 0 {
            let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
            writer.write_to_known_channel(&header, &image([2, 2], 2, &[1; 4])).unwrap();
        }
    }
    writer.finish().unwrap();
    call(random)
}

/// The folder of a recording, whose list is to be written.
fn folder_of_one(root: &Path, list: &str) -> Call {
    let folder = root.join("r");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("r_0.mcap"), "").unwrap();
    fs::write(folder.join("metadata.yaml"), list).unwrap();
    Call::new(&["inspect", "r"])
}

fn list_aliases(root: &Path, random: &mut Random) -> Call {
    let mut list = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned();
    for at in 1..20 + random.below(20) {
        let before = at - 1;
        let aliases = vec![format!("*a{before}"); 10].join(", ");
        list += &format!("a{at}: &a{at} [{aliases}]\n");
    }
    folder_of_one(root, &list)
}

fn many_files(root: &Path, random: &mut Random) -> Call {
    let files = 1_001 + random.below(5_000);
    let list: String = (0..files).map(|_| "  - r_0.mcap\n").collect();
    let head = "rosbag2_bagfile_information:\n  relative_file_paths:\n";
    folder_of_one(root, &format!("{head}{list}"))
}

fn hole(root: &Path, random: &mut Random) -> Call {
    recording(root, "sensor_msgs/msg/Image", 2, &image([2, 2], 2, &[1; 4]));
    let file = File::options().write(true).open(root.join("m.mcap")).unwrap();
    file.set_len((1 << 36) + u64::from(random.next_u32())).unwrap();
    call(random)
}

/// A footer that calls most of a large file its index.
fn index(root: &Path, random: &mut Random) -> Call {
    recording(root, "sensor_msgs/msg/Image", 2, &image([2, 2], 2, &[1; 4]));
    let whole = fs::read(root.join("m.mcap")).unwrap();
    let (begin, end) = whole.split_at(whole.len() - 37);
    // A record of a kind of our own, as long as the rest of the file, follows the magic.
    let hole = (30 << 20) + random.below(30 << 20) as usize;
    let mut file = begin.to_vec();
    let start = file.len() as u64;
    file.push(0x80);
    file.extend((hole as u64).to_le_bytes());
    file.resize(file.len() + hole, 0);
    let mut footer = end.to_vec();
    footer[9..17].copy_from_slice(&start.to_le_bytes());
    footer[17..25].copy_from_slice(&0u64.to_le_bytes());
    footer[25..29].copy_from_slice(&[0; 4]);
    file.extend(&footer);
    fs::write(root.join("m.mcap"), file).unwrap();
    call(random)
}

/// A topic of the index that says it is billions of bytes long.
fn long_text(root: &Path, random: &mut Random) -> Call {
    recording(root, "sensor_msgs/msg/Image", 2, &image([2, 2], 2, &[1; 4]));
    let mut file = fs::read(root.join("m.mcap")).unwrap();
    let topic = b"/right/image_rect";
    // The chunk that has it too is packed.
    let at = file.windows(topic.len()).rposition(|text| text == topic).unwrap();
    file[at - 4..at].copy_from_slice(&above(400_000_000, random).to_le_bytes());
    fs::write(root.join("m.mcap"), file).unwrap();
    call(random)
}

/// Entries of a letter, which take a key, a value and memory of a map each.
fn entries(root: &Path, random: &mut Random) -> Call {
    let of_channel: BTreeMap<String, String> = (0..1_000_000 + random.below(500_000))
        .map(|at| (format!("{at:x}"), "v".to_owned()))
        .collect();
    let mut writer = WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
    writer.add_channel(0, "/left", "cdr", &of_channel).unwrap();
    writer.finish().unwrap();
    fs::write(root.join("m.mcap"), writer.into_inner().into_inner()).unwrap();
    call(random)
}
