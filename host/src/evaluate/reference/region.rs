//! The part of the scene a point belongs to.

use dynvox_core::tracking::{InstanceAt, MotionState, Treatment};

/// The part of the scene a point belongs to, by its pixel in its own frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    /// The static background: no mask, or one of a class that cannot move.
    Static = 0,
    /// An object that is reconstructed in a volume of its own and whose motion is known, moving or
    /// parked.
    Dynamic = 1,
    /// An object without a volume: of a class that is only masked out, or of unknown motion.
    Ignored = 2,
}

impl Region {
    /// All, in the order of tables.
    pub const ALL: [Self; 3] = [Self::Static, Self::Dynamic, Self::Ignored];

    /// By what a pixel shows.
    pub fn from_instance(object: Option<&InstanceAt>) -> Self {
        let Some(object) = object else { return Self::Static };
        match object.class.treatment() {
            Treatment::Ignore => Self::Static,
            Treatment::Reconstruct if object.state != MotionState::Uncertain => Self::Dynamic,
            Treatment::Reconstruct | Treatment::KeepOut => Self::Ignored,
        }
    }

    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Dynamic => "dynamic",
            Self::Ignored => "ignored",
        }
    }
}
