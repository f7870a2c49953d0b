//! Sizes of a room, drawn from its seed.

use super::config::{RoomConfig, RoomKind, RoomPath};
use crate::synth::random::Rng;

/// Width of the strip along a room's walls that furniture stands in, and of the way beside it, m.
const FURNISHED_M: f64 = 1.3;
/// Width of the strip along a yard's borders, m.
const PLANTED_M: f64 = 3.0;

/// Sizes of a room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Half width and half length, m: the floor is x within ± the first, z within ± the second.
    pub half_m: [f64; 2],
    /// Height of the ceiling, m.
    pub height_m: f64,
    /// Half axes of the way round, m; in a corridor the distance from its middle line, and half
    /// the way along it.
    pub round_m: [f64; 2],
    /// True for a corridor.
    pub is_corridor: bool,
}

impl Extent {
    /// Sizes of a configured room.
    pub fn new(kind: RoomKind, config: &RoomConfig) -> Self {
        let mut rng = Rng::new(config.seed, 0xE_47E47, kind as i64);
        let height_m = rng.between(2.45, 2.8);
        let is_corridor = kind == RoomKind::Room && config.path == RoomPath::Corridor;
        let (half_m, kept_m) = match kind {
            _ if is_corridor => ([rng.between(0.9, 1.1), rng.between(5.5, 7.5)], 1.4),
            RoomKind::Room => ([rng.between(2.3, 3.0), rng.between(2.7, 3.5)], FURNISHED_M),
            RoomKind::Yard => ([rng.between(6.0, 8.0), rng.between(6.5, 9.0)], PLANTED_M),
        };
        let round_m =
            if is_corridor { [0.3, half_m[1] - kept_m] } else { half_m.map(|half| half - kept_m) };
        Self { half_m, height_m, round_m, is_corridor }
    }
}
