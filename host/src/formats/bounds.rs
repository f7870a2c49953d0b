//! Bounds of what is read: one table for every reader of files and streams.
//!
//! A reader compares what a header or the file system says with the table before it takes memory or
//! enters a loop. What lies beyond a bound is refused in a sentence that names the file, what it
//! asks for and the bound. Nothing is shortened silently.
//!
//! | bound | value |
//! |---|---|
//! | side of an image | [`MAX_SIDE_PX`] |
//! | memory to decode one picture | [`MAX_DECODE_BYTES`] |
//! | scans of a progressive JPEG | [`MAX_JPEG_SCANS`] |
//! | chunk or record of an MCAP file, packed or not | [`MAX_BAG_RECORD_BYTES`] |
//! | index of an MCAP file; a text in it | [`MAX_BAG_INDEX_BYTES`]; its record |
//! | entries of the channels in an index | [`MAX_BAG_CHANNEL_ENTRIES`] |
//! | indexes of all files of a recording; files | [`MAX_BAG_INDEXES_BYTES`], [`MAX_BAG_FILES`] |
//! | unpacked chunks for each byte of an MCAP file | [`MAX_BAG_RATIO`] |
//! | images of a topic; image topics | [`MAX_BAG_IMAGES`], [`MAX_BAG_TOPICS`] |
//! | text: bytes, lines, bytes of a line | [`CALIBRATION_TEXT`], [`SETTINGS_TEXT`] |
//! | as above | [`MANIFEST_TEXT`], [`TABLE_TEXT`] |
//! | as above; inertial samples | [`INERTIAL_TEXT`], [`MAX_INERTIAL_SAMPLES`] |
//! | line of a table that is read row by row | [`MAX_ROW_BYTES`] |
//! | XML: elements, attributes of one | [`MAX_XML_NODES`], [`MAX_XML_ATTRIBUTES`] |
//! | YAML: values, aliases | [`MAX_YAML_NODES`], [`MAX_YAML_ALIASES`] |
//! | bytes for each value of a depth image in text | [`MAX_VALUE_TEXT_BYTES`] |
//! | LiDAR scan | [`MAX_SCAN_BYTES`] |
//! | PLY: header, bytes of a vertex | [`MAX_PLY_HEADER_BYTES`], [`MAX_PLY_VERTEX_BYTES`] |
//! | COCO: file, polygons of an object | [`MAX_COCO_BYTES`], [`MAX_POLYGONS`] |
//! | network: file | [`MAX_NETWORK_FILE_BYTES`] |
//! | address space of a network's process | [`MAX_NETWORK_BYTES`] |
//! | time of a network for a picture | [`MAX_NETWORK_TIME`] |
//! | network: pixels of its input, outputs, values of one | [`MAX_NETWORK_INPUT_PX`] |
//! | as above | [`MAX_NETWORK_OUTPUTS`], [`MAX_NETWORK_VALUES`] |
//! | snapshot: file, the part about the run | [`MAX_SNAPSHOT_BYTES`], [`MAX_SNAPSHOT_PART_BYTES`] |

use std::fmt;
use std::time::Duration;

/// Largest width and height of an image, px: those of the mapper.
pub const MAX_SIDE_PX: usize = dynvox_core::stereo::MAX_IMAGE_SIZE;
/// Memory that decoding one picture may take, bytes: its file included where it is read whole.
pub const MAX_DECODE_BYTES: u64 = 96 * MIB;
/// Scans of a progressive JPEG; encoders write about ten.
pub const MAX_JPEG_SCANS: usize = 100;

/// Length of a chunk or record of an MCAP file, bytes, packed or not.
pub const MAX_BAG_RECORD_BYTES: usize = 48 * MIB as usize;
/// Length of the index of an MCAP file, bytes.
pub const MAX_BAG_INDEX_BYTES: u64 = 24 * MIB;
/// Entries of all channels in the index of an MCAP file, such as a topic's quality of service. One
/// takes about 170 bytes.
pub const MAX_BAG_CHANNEL_ENTRIES: usize = 100_000;
/// Length of the indexes of all files of a recording, bytes.
pub const MAX_BAG_INDEXES_BYTES: u64 = 96 * MIB;
/// Files of a recording.
pub const MAX_BAG_FILES: usize = 1_000;
/// Bytes of all unpacked chunks for each byte of an MCAP file.
pub const MAX_BAG_RATIO: u64 = 250;
/// Images of a topic: nine hours at 30 a second.
pub const MAX_BAG_IMAGES: usize = 1_000_000;
/// Topics with images.
pub const MAX_BAG_TOPICS: usize = 256;

const MIB: u64 = 1 << 20;

/// Bounds of a text file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextBound {
    /// Kind of text, as it stands in a message.
    pub what: &'static str,
    /// Bytes of the file.
    pub bytes: u64,
    /// Lines of the file.
    pub lines: usize,
    /// Bytes of one line.
    pub line_bytes: usize,
}

/// Calibrations.
pub const CALIBRATION_TEXT: TextBound =
    TextBound { what: "a calibration", bytes: MIB, lines: 20_000, line_bytes: 1 << 18 };
/// Tables: poses, times, labels, detections and run-length masks.
pub const TABLE_TEXT: TextBound =
    TextBound { what: "a table", bytes: 64 * MIB, lines: 500_000, line_bytes: 1 << 20 };

/// Inertial samples: two and a half hours at 200 Hz.
pub const INERTIAL_TEXT: TextBound =
    TextBound { what: "a table", bytes: 192 * MIB, lines: 2_000_000, line_bytes: 1 << 16 };
/// Samples of an inertial unit.
pub const MAX_INERTIAL_SAMPLES: usize = 2_000_000;

/// Lists of jobs, alignments and results, which programs write on one line.
pub const MANIFEST_TEXT: TextBound = TextBound {
    what: "a manifest",
    bytes: 32 * MIB,
    lines: 2_000_000,
    line_bytes: 32 * MIB as usize,
};
/// Settings, plans and summaries.
pub const SETTINGS_TEXT: TextBound =
    TextBound { what: "settings", bytes: 8 * MIB, lines: 200_000, line_bytes: 4 << 20 };

/// Bytes of a row of a table that is read row by row.
pub const MAX_ROW_BYTES: usize = 1 << 20;
/// Elements of an XML file.
pub const MAX_XML_NODES: u32 = 10_000;
/// Attributes of one element, whose names are compared with each other.
pub const MAX_XML_ATTRIBUTES: usize = 64;
/// Values of a YAML file.
pub const MAX_YAML_NODES: usize = 100_000;
/// Aliases in a YAML file.
pub const MAX_YAML_ALIASES: usize = 1_000;
/// Bytes of one value, with its blank, in a depth image that is text.
pub const MAX_VALUE_TEXT_BYTES: u64 = 16;
/// Bytes of a LiDAR scan: two million points.
pub const MAX_SCAN_BYTES: u64 = 32 * MIB;
/// Bytes of a PLY file's header.
pub const MAX_PLY_HEADER_BYTES: u64 = 64 << 10;
/// Bytes of one vertex of a PLY file.
pub const MAX_PLY_VERTEX_BYTES: usize = 64;
/// Polygons of an object in a COCO file.
pub const MAX_POLYGONS: usize = 10_000;
/// Bytes of a COCO file.
pub const MAX_COCO_BYTES: u64 = 16 * MIB;
/// Bytes of a network's file.
pub const MAX_NETWORK_FILE_BYTES: u64 = 512 * MIB;
/// Address space of a network's process, bytes.
pub const MAX_NETWORK_BYTES: u64 = 2_048 * MIB;
/// Time that a network may take for a picture.
pub const MAX_NETWORK_TIME: Duration = Duration::from_secs(30);
/// Pixels of a network's input.
pub const MAX_NETWORK_INPUT_PX: usize = 1 << 22;
/// Outputs of a network.
pub const MAX_NETWORK_OUTPUTS: usize = 16;
/// Values of one output of a network.
pub const MAX_NETWORK_VALUES: usize = 1 << 25;
/// Bytes of a snapshot.
pub const MAX_SNAPSHOT_BYTES: u64 = 8 << 30;
/// Bytes of a snapshot's part about the run; the mapper's part is read straight into its slab.
pub const MAX_SNAPSHOT_PART_BYTES: u64 = 64 * MIB;

/// A number with a comma before each three digits.
pub fn thousands(number: impl fmt::Display) -> String {
    let digits = number.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Bytes as text, in the largest unit that leaves no zero before the point.
pub fn bytes_text(bytes: u64) -> String {
    match bytes {
        0..1_024 => format!("{bytes} bytes"),
        1_024..MIB => format!("{} KiB", bytes.div_ceil(1_024)),
        _ => format!("{} MiB", thousands(bytes.div_ceil(MIB))),
    }
}

/// Refuses an image whose sides are beyond [`MAX_SIDE_PX`].
///
/// # Errors
/// The sides and their bound, as the rest of a sentence.
pub fn check_sides(width: usize, height: usize) -> Result<(), String> {
    if width.max(height) <= MAX_SIDE_PX {
        return Ok(());
    }
    let most = thousands(MAX_SIDE_PX);
    Err(format!("it is {width} x {height} px; at most {most} px a side are read"))
}

/// Refuses an image that takes more than [`MAX_DECODE_BYTES`] to decode, or whose sides are beyond
/// their bound.
///
/// # Errors
/// Names the need and the bound, as the rest of a sentence.
pub fn check_decoding(width: usize, height: usize, bytes: u64) -> Result<(), String> {
    check_sides(width, height)?;
    if bytes <= MAX_DECODE_BYTES {
        return Ok(());
    }
    let (needed, most) = (bytes_text(bytes), bytes_text(MAX_DECODE_BYTES));
    Err(format!(
        "its {width} x {height} px take {needed} to decode; at most {most} are taken for a picture"
    ))
}

/// The number of values of a network's output.
///
/// # Errors
/// The number and its bound, as the rest of a sentence.
pub fn check_output(shape: &[usize]) -> Result<usize, String> {
    let count = shape.iter().try_fold(1usize, |count, side| count.checked_mul(*side));
    count.filter(|count| *count <= MAX_NETWORK_VALUES).ok_or_else(|| {
        let sides: Vec<String> = shape.iter().map(usize::to_string).collect();
        format!(
            "an output has the shape [{}]; at most {} values of one are read",
            sides.join(", "),
            thousands(MAX_NETWORK_VALUES)
        )
    })
}

/// Refuses bytes beyond a bound.
///
/// # Errors
/// The bytes and the bound, as the rest of a sentence.
pub fn check_bytes(what: &str, bytes: u64, most: u64) -> Result<(), String> {
    if bytes <= most {
        return Ok(());
    }
    Err(format!("it has {}; {}", bytes_text(bytes), most_text(what, most)))
}

/// A bound of bytes, as the end of a sentence.
pub fn most_text(what: &str, most: u64) -> String {
    format!("at most {} of {what} are read", bytes_text(most))
}

impl TextBound {
    /// Refuses a text with too many lines, or with a line that is too long.
    ///
    /// # Errors
    /// The line and the bound, as the rest of a sentence.
    pub fn check_lines(&self, text: &[u8]) -> Result<(), String> {
        let mut lines = 0;
        for line in text.split(|&byte| byte == b'\n') {
            lines += 1;
            if line.len() > self.line_bytes {
                let (found, most) = (line.len() as u64, self.line_bytes as u64);
                return Err(format!(
                    "its line {lines} has {}; at most {} of a line are read",
                    bytes_text(found),
                    bytes_text(most)
                ));
            }
            if lines > self.lines + 1 {
                let most = thousands(self.lines);
                return Err(format!(
                    "it has more lines than the {most} that are read of {}",
                    self.what
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refusals_name_what_was_found_and_the_bound() {
        let sides = check_sides(20_000, 20_000).unwrap_err();
        assert_eq!(sides, "it is 20000 x 20000 px; at most 8,192 px a side are read");
        let memory = check_decoding(8_192, 8_192, 384 * MIB).unwrap_err();
        assert!(memory.contains("take 384 MiB to decode; at most 96 MiB"), "{memory}");
        let bytes = check_bytes("a table", 5 << 30, 32 * MIB).unwrap_err();
        assert_eq!(bytes, "it has 5,120 MiB; at most 32 MiB of a table are read");
        assert_eq!(check_sides(MAX_SIDE_PX, MAX_SIDE_PX), Ok(()));
        assert_eq!(check_output(&[1, 84, 8_400]), Ok(705_600));
        let output = check_output(&[1, 3, 100_000, 100_000]).unwrap_err();
        assert!(output.starts_with("an output has the shape [1, 3, 100000, 100000]; at most"));
        assert!(check_output(&[usize::MAX, 2]).is_err(), "more than can be counted");
    }

    #[test]
    fn lines_at_the_bound_are_read_and_longer_or_more_are_refused() {
        let bound = TextBound { what: "a list", bytes: 100, lines: 3, line_bytes: 4 };
        assert_eq!(bound.check_lines(b"abcd\nb\nc\n"), Ok(()));
        assert!(bound.check_lines(b"a\nabcde\n").unwrap_err().contains("its line 2 has 5 bytes"));
        assert!(bound.check_lines(b"\n\n\n\n\n").unwrap_err().contains("the 3 that are read"));
    }
}
