//! The vertical in the map.

/// Direction that points up in the map, with its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Vertical {
    /// Unit vector that points up, in the coordinates of `t_world_camera` where the map began:
    /// poses may lean the more, the longer the way since.
    pub up_world: [f32; 3],
    /// Standard deviation of its angle, rad.
    pub sigma_rad: f32,
}
