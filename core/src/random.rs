//! Seeded random numbers: one generator per purpose, handed in, so that one user's draws never
//! shift another's.

use crate::state::Visitor;

/// PCG-XSH-RR 64/32 (O'Neill, *PCG: A Family of Simple Fast Space-Efficient Statistically Good
/// Algorithms*, 2014): 8 bytes of state, integers only.
///
/// ```
/// use dynvox_core::random::Random;
///
/// let (mut a, mut b) = (Random::new(7), Random::new(7));
/// assert_eq!([a.next_u32(), a.next_u32()], [b.next_u32(), b.next_u32()]);
/// assert!(a.below(6) < 6);
/// ```
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// A generator for one purpose. Equal seeds give equal draws on every machine.
    ///
    /// ```
    /// use dynvox_core::random::Random;
    ///
    /// let [mut one, mut other] = [Random::new(7), Random::new(7)];
    /// assert_eq!(one.next_u32(), other.next_u32(), "one seed, one sequence");
    /// ```
    pub const fn new(seed: u64) -> Self {
        Self { state: seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03 }
    }

    /// Visits every field.
    pub(crate) fn visit(&mut self, visitor: &mut impl Visitor) {
        let Self { state } = self;
        visitor.u64(state);
    }

    /// 32 uniform bits.
    pub fn next_u32(&mut self) -> u32 {
        let old = self.state;
        self.state =
            old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let xorshifted = (((old >> 18) ^ old) >> 27) as u32;
        xorshifted.rotate_right((old >> 59) as u32)
    }

    /// Uniform from 0 to below 1, in steps of 2^-32.
    ///
    /// ```
    /// use dynvox_core::random::Random;
    ///
    /// let mut random = Random::new(1);
    /// assert!((0..100).all(|_| (0.0..1.0).contains(&random.fraction())));
    /// ```
    pub fn fraction(&mut self) -> f64 {
        f64::from(self.next_u32()) / 4_294_967_296.0
    }

    /// Uniform in `0..bound`; 0 when `bound` is 0. One draw, by multiplication: the bias is at most
    /// `bound` / 2^32.
    ///
    /// ```
    /// use dynvox_core::random::Random;
    ///
    /// let mut random = Random::new(1);
    /// assert!((0..100).all(|_| random.below(6) < 6));
    /// ```
    pub fn below(&mut self, bound: u32) -> u32 {
        ((u64::from(self.next_u32()) * u64::from(bound)) >> 32) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_seeds_give_equal_draws_and_other_seeds_others() {
        let draw = |seed| {
            let mut random = Random::new(seed);
            [(); 8].map(|()| random.below(1_000))
        };
        assert_eq!(draw(1), draw(1));
        assert_ne!(draw(1), draw(2));
        assert!(draw(3).iter().all(|&value| value < 1_000));
    }
}
