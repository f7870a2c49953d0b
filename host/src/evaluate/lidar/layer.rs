//! What a point belongs to.

use dynvox_core::tracking::{State, ThingAt, Treatment};

/// What a point belongs to, by what its pixel shows in its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// The street: no mask, or one of a thing that cannot move.
    Static = 0,
    /// A thing that is reconstructed in a volume of its own and whose motion is known, moving or parked.
    Dynamic = 1,
    /// A thing that could move and has no volume: of a class that is only kept out, or of unknown motion.
    Ignored = 2,
}

impl Layer {
    /// All, in the order of tables.
    pub const ALL: [Self; 3] = [Self::Static, Self::Dynamic, Self::Ignored];

    /// By what a pixel shows.
    pub fn of(thing: Option<&ThingAt>) -> Self {
        let Some(thing) = thing else { return Self::Static };
        match thing.class.treatment() {
            Treatment::Ignore => Self::Static,
            Treatment::Reconstruct if thing.state != State::Uncertain => Self::Dynamic,
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
