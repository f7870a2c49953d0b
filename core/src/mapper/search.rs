//! State of the search for a camera that was lost: one step a frame
//! (docs/decisions/0096-a-search-over-frames.md).

use crate::state::Visitor;

/// Next step of the search for a camera that was lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Search {
    /// No camera is searched for.
    #[default]
    Off,
    /// Registration of the guessed pose.
    Guess,
    /// Registration of the better of the guessed pose and the registered one.
    Registered,
    /// Comparison with poses ahead and behind.
    Along,
    /// Comparison with poses around what is shown.
    Around,
}

impl Search {
    /// Visits the step as the bits of a byte above the lowest, which is another's.
    pub fn visit_above(&mut self, lowest: &mut bool, visitor: &mut impl Visitor) {
        let mut bits = u8::from(*lowest) | (*self as u8) << 1;
        visitor.u8(&mut bits);
        *lowest = bits & 1 != 0;
        *self = match bits >> 1 {
            1 => Self::Guess,
            2 => Self::Registered,
            3 => Self::Along,
            4 => Self::Around,
            _ => Self::Off,
        };
    }
}
