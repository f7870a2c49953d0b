//! Bytes of MAVLink 2 messages.
//!
//! Written here because the crate that reads MAVLink has features for std and for embedded targets
//! that exclude each other: a library that picks one breaks callers of the other. The tests read
//! every message back with that crate.

use crate::sector::{Direction, SECTOR_DEG, SECTORS, Sectors};

/// Most bytes of a message: header, payload, checksum.
pub const MESSAGE_MAX_BYTES: usize = HEADER_BYTES + PAYLOAD_MAX_BYTES + 2;

const HEADER_BYTES: usize = 10;
const PAYLOAD_MAX_BYTES: usize = 167;
/// Kind of a message.
#[derive(Clone, Copy)]
struct Kind {
    /// Number of the kind.
    number: u32,
    /// Extra byte of the checksum, which tells versions of a kind apart.
    extra: u8,
}

const OBSTACLE_DISTANCE: Kind = Kind { number: 330, extra: 23 };
const OBSTACLE_DISTANCE_3D: Kind = Kind { number: 11_037, extra: 130 };
/// `MAV_FRAME_BODY_FRD`: x ahead, y right, z down.
const BODY_FRD: u8 = 12;
/// `MAV_DISTANCE_SENSOR_UNKNOWN`: no kind of the list is a stereo camera.
const SENSOR_UNKNOWN: u8 = 4;
/// An unknown direction.
const UNKNOWN_CM: u16 = u16::MAX;
/// The farthest distance that a message tells, one less than what says "nothing within".
const FAR_MAX_CM: u16 = u16::MAX - 2;

/// Sender of messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sender {
    /// Number of the vehicle, from 1.
    pub system: u8,
    /// Number of the component; 158 is a peripheral, 196 obstacle avoidance.
    pub component: u8,
    /// Number of the message: one more with each.
    pub sequence: u8,
}

/// A message's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Message {
    bytes: [u8; MESSAGE_MAX_BYTES],
    len: usize,
}

impl Message {
    /// The bytes to send.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or_default()
    }
}

/// `OBSTACLE_DISTANCE` in the vehicle's axes: centimetres in 72 directions, clockwise from straight
/// ahead. A direction that is not known is `UINT16_MAX`, a free one the farthest distance and 1.
/// `time_us` is the time of the frame, since the start of the system or 1970.
///
/// ```
/// use dynvox_onboard::mavlink::{Sender, obstacle_distance};
/// # use dynvox_core::{Capacity, Config, Mapper, memory::SLAB_ALIGN};
/// # use dynvox_core::geometry::{StereoRig, Transform};
/// # use dynvox_onboard::{Band, Vehicle, sectors};
/// # let rig =
/// #     StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
/// # let mut slab = vec![0; Capacity::TINY.bytes() + SLAB_ALIGN];
/// # let mapper = Mapper::new(&Capacity::TINY, &Config::for_rig(rig), &mut slab)?;
/// # let band = Band {
/// #     body_m: 0.5, near_m: 1.0, far_m: 10.0, up_m: 0.5, down_m: 0.5, stale_frames: 10,
/// # };
/// # let around = sectors(mapper.planning(), &Vehicle::new(&Transform::IDENTITY, true), &band);
/// let sender = Sender { system: 1, component: 196, sequence: 0 };
/// let message = obstacle_distance(&around, 1_000_000, sender);
/// assert_eq!((message.bytes()[0], message.bytes().len()), (0xFD, 179));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn obstacle_distance(sectors: &Sectors, time_us: u64, sender: Sender) -> Message {
    let band = sectors.band();
    let far_cm = centimetres(band.far_m);
    let mut payload = Payload::default();
    payload.put(&time_us.to_le_bytes());
    for direction in sectors.directions() {
        let cm = match *direction {
            Direction::Unknown => UNKNOWN_CM,
            Direction::Free => far_cm + 1,
            Direction::Obstacle { distance_m } => centimetres(distance_m).min(far_cm),
        };
        payload.put(&cm.to_le_bytes());
    }
    payload.put(&centimetres(band.body_m).to_le_bytes());
    payload.put(&far_cm.to_le_bytes());
    payload.put(&[SENSOR_UNKNOWN, SECTOR_DEG as u8]);
    payload.put(&(SECTOR_DEG as f32).to_le_bytes());
    payload.put(&0.0f32.to_le_bytes());
    payload.put(&[BODY_FRD]);
    payload.message(OBSTACLE_DISTANCE, sender)
}

/// `OBSTACLE_DISTANCE_3D` of one obstacle at a point in the vehicle's axes, m. `time_ms` is the
/// time since the start of the system.
pub fn obstacle_distance_3d(
    point_m: [f32; 3],
    sectors: &Sectors,
    time_ms: u32,
    sender: Sender,
) -> Message {
    let mut payload = Payload::default();
    payload.put(&time_ms.to_le_bytes());
    point_m.iter().for_each(|c| payload.put(&c.to_le_bytes()));
    payload.put(&sectors.band().body_m.to_le_bytes());
    payload.put(&sectors.band().far_m.to_le_bytes());
    // Obstacles have no numbers of their own.
    payload.put(&u16::MAX.to_le_bytes());
    payload.put(&[SENSOR_UNKNOWN, BODY_FRD]);
    payload.message(OBSTACLE_DISTANCE_3D, sender)
}

/// A distance in whole centimetres, never longer than it is.
fn centimetres(m: f32) -> u16 {
    let cm = m * 100.0;
    if cm >= f32::from(FAR_MAX_CM) { FAR_MAX_CM } else { cm as u16 }
}

/// A payload under construction.
struct Payload {
    bytes: [u8; PAYLOAD_MAX_BYTES],
    len: usize,
}

impl Default for Payload {
    fn default() -> Self {
        Self { bytes: [0; PAYLOAD_MAX_BYTES], len: 0 }
    }
}

impl Payload {
    /// Appends bytes; every message fits.
    fn put(&mut self, more: &[u8]) {
        let into = self.bytes.iter_mut().skip(self.len);
        into.zip(more).for_each(|(to, from)| *to = *from);
        self.len += more.len();
    }

    /// The message, with zeros at the end of the payload left out as MAVLink 2 has it.
    fn message(&self, kind: Kind, sender: Sender) -> Message {
        let payload = self.bytes.get(..self.len).unwrap_or_default();
        let used = payload.iter().rposition(|byte| *byte != 0).map_or(1, |last| last + 1);
        let [low, middle, high, _] = kind.number.to_le_bytes();
        let head = [
            0xFD,
            used as u8,
            0,
            0,
            sender.sequence,
            sender.system,
            sender.component,
            low,
            middle,
            high,
        ];
        let mut message = Message { bytes: [0; MESSAGE_MAX_BYTES], len: HEADER_BYTES + used + 2 };
        let content = head.iter().chain(payload.iter().take(used)).copied();
        // The first byte marks the message and is not in its checksum.
        let sum = content.clone().skip(1).chain([kind.extra]).fold(u16::MAX, crc);
        let whole = content.chain(sum.to_le_bytes());
        message.bytes.iter_mut().zip(whole).for_each(|(to, from)| *to = from);
        message
    }
}

/// One byte more of CRC-16/MCRF4XX.
fn crc(sum: u16, byte: u8) -> u16 {
    let low = byte ^ (sum as u8);
    let low = low ^ (low << 4);
    let wide = u16::from(low);
    (sum >> 8) ^ (wide << 8) ^ (wide << 3) ^ (wide >> 4)
}

const _: () = assert!(SECTORS * 2 + 23 == PAYLOAD_MAX_BYTES);
