//! Messages of images, calibrations and inertial samples, in the encodings of ROS 2 and ROS 1.
//!
//! CDR (ROS 2) aligns numbers to their size, behind four bytes that say their order, and ends texts
//! with a zero. ROS 1 aligns nothing, is little-endian, and its headers begin with a number.

use crate::formats::TimedReading;
use std::fmt::Write;

/// Most numbers in a list of a calibration.
const MAX_NUMBERS: usize = 64;

/// Arrangement of a message's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// ROS 2.
    Cdr,
    /// ROS 1.
    Ros1,
}

impl Encoding {
    /// The encoding of a name in a file.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "cdr" => Some(Self::Cdr),
            "ros1" => Some(Self::Ros1),
            _ => None,
        }
    }
}

/// Reads values one by one; `None` where the bytes end.
struct Reader<'m> {
    bytes: &'m [u8],
    at: usize,
    little: bool,
    encoding: Encoding,
}

impl<'m> Reader<'m> {
    fn new(message: &'m [u8], encoding: Encoding) -> Option<Self> {
        if encoding == Encoding::Ros1 {
            return Some(Self { bytes: message, at: 0, little: true, encoding });
        }
        let (head, bytes) = message.split_at_checked(4)?;
        Some(Self { bytes, at: 0, little: head.get(1)? & 1 == 1, encoding })
    }

    fn take(&mut self, len: usize, align: usize) -> Option<&'m [u8]> {
        let align = if self.encoding == Encoding::Cdr { align } else { 1 };
        let from = self.at.next_multiple_of(align);
        let bytes = self.bytes.get(from..from.checked_add(len)?)?;
        self.at = from + len;
        Some(bytes)
    }

    fn number<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut bytes: [u8; N] = self.take(N, N)?.try_into().ok()?;
        if !self.little {
            bytes.reverse();
        }
        Some(bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.number().map(u32::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.number().map(f64::from_le_bytes)
    }

    fn bytes(&mut self) -> Option<&'m [u8]> {
        let len = self.u32()? as usize;
        self.take(len, 1)
    }

    fn text(&mut self) -> Option<&'m str> {
        std::str::from_utf8(self.bytes()?).ok().map(|text| text.trim_end_matches('\0'))
    }

    /// The header's time, ns; its frame is passed over.
    fn stamp_ns(&mut self) -> Option<u64> {
        if self.encoding == Encoding::Ros1 {
            // The header's running number.
            self.u32()?;
        }
        let (seconds, ns) = (self.u32()?, self.u32()?);
        self.text()?;
        Some(u64::from(seconds) * 1_000_000_000 + u64::from(ns))
    }

    fn array<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Some(values)
    }
}

/// Returns the time stamp of a message with a header, ns.
pub fn stamp_ns(message: &[u8], encoding: Encoding) -> Option<u64> {
    Reader::new(message, encoding)?.stamp_ns()
}

/// `sensor_msgs/Image`.
#[derive(Debug)]
pub struct RawImage<'m> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `mono8`, `bgr8`, `bayer_rggb8` and so on.
    pub encoding: &'m str,
    /// True if samples of 16 bit are big-endian.
    pub big_endian: bool,
    /// Bytes from one row to the next.
    pub step: usize,
    /// The rows.
    pub data: &'m [u8],
}

impl<'m> RawImage<'m> {
    /// Reads the message.
    pub fn read(message: &'m [u8], encoding: Encoding) -> Option<Self> {
        let mut reader = Reader::new(message, encoding)?;
        reader.stamp_ns()?;
        let (height, width) = (reader.u32()? as usize, reader.u32()? as usize);
        let encoding = reader.text()?;
        let big_endian = reader.take(1, 1)? != [0];
        let step = reader.u32()? as usize;
        Some(Self { width, height, encoding, big_endian, step, data: reader.bytes()? })
    }
}

/// The file in a `sensor_msgs/CompressedImage`.
pub fn compressed_image(message: &[u8], encoding: Encoding) -> Option<&[u8]> {
    let mut reader = Reader::new(message, encoding)?;
    reader.stamp_ns()?;
    reader.text()?;
    reader.bytes()
}

/// The sample in a `sensor_msgs/Imu`, at the time of its header.
pub fn inertial_reading(message: &[u8], encoding: Encoding) -> Option<TimedReading> {
    let mut reader = Reader::new(message, encoding)?;
    let time_ns = i64::try_from(reader.stamp_ns()?).ok()?;
    // Orientation and its covariance are not of the sensors.
    reader.array::<13>()?;
    let turn_rate = reader.array()?;
    reader.array::<9>()?;
    Some(TimedReading { time_ns, turn_rate, force: reader.array()? })
}

/// `sensor_msgs/CameraInfo`.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraInfo {
    width: u32,
    height: u32,
    model: String,
    distortion: Vec<f64>,
    camera: [f64; 9],
    rotation: [f64; 9],
    /// The projection matrix of the rectified camera, row by row.
    pub projection: [f64; 12],
}

impl CameraInfo {
    /// Reads the message.
    pub fn read(message: &[u8], encoding: Encoding) -> Option<Self> {
        let mut reader = Reader::new(message, encoding)?;
        reader.stamp_ns()?;
        let (height, width) = (reader.u32()?, reader.u32()?);
        let model = reader.text()?.to_owned();
        let count = reader.u32()? as usize;
        if count > MAX_NUMBERS {
            return None;
        }
        let distortion = (0..count).map(|_| reader.f64()).collect::<Option<_>>()?;
        Some(Self {
            width,
            height,
            model,
            distortion,
            camera: reader.array()?,
            rotation: reader.array()?,
            projection: reader.array()?,
        })
    }

    /// Returns true if the camera was never calibrated: ROS then leaves zeros.
    pub fn is_blank(&self) -> bool {
        self.camera[0] == 0.0 || self.projection[0] == 0.0
    }

    /// Returns true if images come without distortion and rotation.
    pub fn is_undistorted(&self) -> bool {
        let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        self.distortion.iter().all(|value| *value == 0.0)
            && self.rotation == identity
            && self.camera[0] == self.projection[0]
    }

    /// Returns the calibration as `camera_calibration` writes it to a file.
    pub fn as_yaml(&self) -> String {
        let list = |values: &[f64]| {
            values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(", ")
        };
        let model = if self.model.is_empty() { "plumb_bob" } else { &self.model };
        let mut text = format!(
            "image_width: {}\nimage_height: {}\ndistortion_model: {model}\n",
            self.width, self.height
        );
        let matrices: [(&str, &[f64], usize); 4] = [
            ("camera_matrix", &self.camera, 3),
            ("distortion_coefficients", &self.distortion, 1),
            ("rectification_matrix", &self.rotation, 3),
            ("projection_matrix", &self.projection, 3),
        ];
        for (name, values, rows) in matrices {
            let columns = values.len() / rows;
            // Writing to a String cannot fail.
            let _ = write!(
                text,
                "{name}:\n  rows: {rows}\n  cols: {columns}\n  data: [{}]\n",
                list(values)
            );
        }
        text
    }
}
