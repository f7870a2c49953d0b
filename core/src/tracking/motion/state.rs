//! The three motion states.

/// Motion state of an object: uncertain, static or dynamic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MotionState {
    /// It may move or not.
    #[default]
    Uncertain,
    /// It does not move.
    Static,
    /// It moves.
    Dynamic,
}

impl MotionState {
    /// Name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Uncertain => "uncertain",
            Self::Static => "static",
            Self::Dynamic => "dynamic",
        }
    }

    /// The code, as tables keep it.
    pub(crate) const fn code(self) -> u32 {
        self as u32
    }

    /// The state of a code; [`MotionState::Uncertain`] for an unknown one.
    pub(crate) fn from_code(code: u32) -> Self {
        match code {
            1 => Self::Static,
            2 => Self::Dynamic,
            _ => Self::Uncertain,
        }
    }
}
