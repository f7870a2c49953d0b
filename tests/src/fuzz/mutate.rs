//! Valid inputs, changed at random.

use dynvox_core::random::Random;

/// Words that readers treat in a way of their own.
const WORDS: [&[u8]; 24] = [
    b"0",
    b"-1",
    b"1e308",
    b"-1e400",
    b"nan",
    b"inf",
    b"4294967296",
    b"18446744073709551615",
    b"99999999999999999999",
    b"\n",
    b"\n\n",
    b"\t",
    b" ",
    b",",
    b":",
    b"[",
    b"]",
    b"{",
    b"\"",
    b"&a *a",
    b"\xff\xfe",
    b"\0",
    b"\xef\xbb\xbf",
    b"-",
];
/// Longest input that is made, bytes.
const MAX_LENGTH: usize = 1 << 20;
/// Changes of one input at most.
const MAX_CHANGES: u32 = 6;

/// Changes inputs by seeded draws: equal seeds give equal inputs on every machine.
pub struct Mutator(Random);

impl Mutator {
    /// A mutator with a seed of its own.
    pub fn new(seed: u64) -> Self {
        Self(Random::new(seed))
    }

    fn below(&mut self, bound: usize) -> usize {
        self.0.below(bound.min(u32::MAX as usize) as u32) as usize
    }

    /// One of the seeds, changed in one to six places.
    pub fn mutate(&mut self, seeds: &[Vec<u8>]) -> Vec<u8> {
        let at = self.below(seeds.len());
        let mut bytes = seeds.get(at).cloned().unwrap_or_default();
        for _ in 0..=self.0.below(MAX_CHANGES) {
            self.change(&mut bytes, seeds);
        }
        bytes.truncate(MAX_LENGTH);
        bytes
    }

    /// A range of the bytes, mostly short.
    fn range(&mut self, len: usize) -> std::ops::Range<usize> {
        let from = self.below(len + 1);
        let most = if self.0.below(4) == 0 { len } else { 16 };
        let to = (from + self.below(most + 1)).min(len);
        from..to
    }

    fn change(&mut self, bytes: &mut Vec<u8>, seeds: &[Vec<u8>]) {
        let range = self.range(bytes.len());
        match self.0.below(8) {
            // Cut off, cut out, repeated, replaced by a word of the format or a piece of another
            // seed.
            0 => bytes.truncate(range.start),
            1 => drop(bytes.drain(range)),
            2 => {
                let again = bytes[range.clone()].to_vec();
                bytes.splice(range.start..range.start, again);
            }
            3 => {
                let word = WORDS[self.below(WORDS.len())];
                bytes.splice(range, word.iter().copied());
            }
            4 => {
                let other = &seeds[self.below(seeds.len())];
                let part = self.range(other.len());
                bytes.splice(range, other[part].iter().copied());
            }
            5 => bytes[range].iter_mut().for_each(|byte| *byte = self.0.next_u32() as u8),
            6 => {
                // A number of the header or the text, changed a little.
                let step = if self.0.below(2) == 0 { 1 } else { 255 };
                bytes[range].iter_mut().take(1).for_each(|byte| *byte = byte.wrapping_add(step));
            }
            _ => {
                let bit = 1 << self.0.below(8);
                bytes[range].iter_mut().take(1).for_each(|byte| *byte ^= bit);
            }
        }
    }
}
