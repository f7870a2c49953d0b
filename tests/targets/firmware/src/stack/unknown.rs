//! Targets on which the stack is not ours to paint.

/// No paint.
pub struct Paint;

impl Paint {
    /// Paints nothing.
    pub fn below() -> Self {
        Self
    }

    /// Unknown: 0.
    pub fn used_below(&self) -> u32 {
        0
    }

    /// Unknown: 0.
    pub fn used_in_all(&self) -> u32 {
        0
    }
}
