//! Contradictions in what the software itself controls.
//!
//! What the world sends is checked and refused; what the core keeps must be right. Each owner of
//! state has a `check_invariants` that says what must hold after a frame. Where it does not hold, a
//! test stops, and every other build counts it into [`crate::Report::internal_faults`].

/// Counts what does not hold.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Invariants {
    faults: u32,
    /// The state comes from outside: what does not hold is no fault of the software.
    is_foreign: bool,
}

impl Invariants {
    /// Invariants of a state that was read, which stop no test.
    pub fn of_foreign() -> Self {
        Self { is_foreign: true, ..Self::default() }
    }

    /// Notes whether `what` holds.
    #[track_caller]
    pub fn require(&mut self, holds: bool, what: &'static str) {
        debug_assert!(holds || self.is_foreign, "internal fault: {what}");
        self.faults = self.faults.saturating_add(u32::from(!holds));
    }

    /// Returns the number of conditions that did not hold.
    pub fn faults(self) -> u32 {
        self.faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_holds_is_no_fault() {
        let mut invariants = Invariants::default();
        invariants.require(true, "one is one");
        assert_eq!(invariants.faults(), 0);
    }

    #[test]
    fn what_was_read_may_be_anything() {
        let mut invariants = Invariants::of_foreign();
        invariants.require(false, "one is two");
        assert_eq!(invariants.faults(), 1);
    }

    #[test]
    #[should_panic(expected = "internal fault: the pool is no larger than its capacity")]
    fn a_fault_stops_a_test() {
        Invariants::default().require(false, "the pool is no larger than its capacity");
    }
}
