//! The time between frames: measured where frames bear their times, assumed where they do not.

use crate::state::Visitor;

const S_PER_NS: f64 = 1e-9;

/// Time of the last frame, and from the one before to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clock {
    /// Time of the last frame, ns; `None` where it had none.
    last_ns: Option<u64>,
    /// From the frame before the last to it, s.
    interval_s: f32,
}

impl Clock {
    /// Before the first frame.
    pub fn new(assumed_s: f32) -> Self {
        Self { last_ns: None, interval_s: assumed_s }
    }

    /// Returns true if a frame of this time may follow.
    pub fn may_follow(&self, time_ns: Option<u64>) -> bool {
        self.last_ns.zip(time_ns).is_none_or(|(last_ns, time_ns)| last_ns < time_ns)
    }

    /// Takes a frame's time: the time since the frame before, or the assumed one where either is
    /// not known.
    pub fn advance(&mut self, time_ns: Option<u64>, assumed_s: f32) -> f32 {
        // As precise as the assumed time, so that stamps of exactly that rate give the same bits.
        let measured = self
            .last_ns
            .zip(time_ns)
            .map(|(last_ns, time_ns)| (time_ns.saturating_sub(last_ns) as f64 * S_PER_NS) as f32);
        self.interval_s = measured.unwrap_or(assumed_s);
        self.last_ns = time_ns;
        self.interval_s
    }

    /// Time between the last two frames, s.
    pub fn interval_s(&self) -> f32 {
        self.interval_s
    }

    /// Visits both.
    pub fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { last_ns, interval_s } = self;
        visitor.option(last_ns, || 0, |visitor, last_ns| visitor.u64(last_ns));
        visitor.f32(interval_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_of_the_assumed_rate_give_the_bits_of_none() {
        let mut clock = Clock::new(0.1);
        // Nanoseconds since 1970, as recordings have them: f32 seconds would not resolve frames.
        let start = 1_403_636_579_763_555_584;
        assert_eq!(clock.advance(Some(start), 0.1), 0.1, "nothing is known before the first frame");
        assert_eq!(clock.advance(Some(start + 100_000_000), 0.1).to_bits(), 0.1f32.to_bits());
        assert_eq!(clock.advance(Some(start + 133_000_000), 0.1), 0.033);
        // Equal stamps are refused, later ones and none are taken.
        assert!(
            !clock.may_follow(Some(start + 133_000_000))
                && clock.may_follow(Some(start + 133_000_001))
                && clock.may_follow(None)
        );
        assert_eq!([clock.advance(None, 0.1), clock.advance(Some(start), 0.1)], [0.1, 0.1]);
    }
}
