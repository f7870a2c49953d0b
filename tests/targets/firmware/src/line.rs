//! A line of text without `core::fmt`, which would bring panics along.

/// Space for a frame's digests with sixteen objects.
const LONGEST: usize = 512;

/// A line under construction; what does not fit is cut off.
pub struct Line {
    bytes: [u8; LONGEST + 1],
    len: usize,
}

impl Line {
    /// An empty line.
    pub const fn new() -> Self {
        Self { bytes: [0; LONGEST + 1], len: 0 }
    }

    /// Adds text.
    pub fn str(mut self, text: &str) -> Self {
        text.bytes().for_each(|byte| self.push(byte));
        self
    }

    /// Adds a number in decimals.
    pub fn decimal(mut self, value: u32) -> Self {
        let mut unit = 1_000_000_000;
        while unit > 0 {
            if value >= unit || unit == 1 {
                self.push(b'0' + (value / unit % 10) as u8);
            }
            unit /= 10;
        }
        self
    }

    /// Adds a number in sixteen hexadecimal digits.
    pub fn hex(mut self, value: u64) -> Self {
        for digit in (0..16).rev().map(|digit_at| (value >> (4 * digit_at)) as u8 & 15) {
            self.push(if digit < 10 { b'0' + digit } else { b'a' - 10 + digit });
        }
        self
    }

    fn push(&mut self, byte: u8) {
        // The last byte stays zero.
        if let Some(slot) = self.bytes.split_last_mut().and_then(|(_, text)| text.get_mut(self.len))
        {
            *slot = byte;
            self.len += 1;
        }
    }

    /// The text.
    pub fn text(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&[])
    }

    /// The text and a zero byte after it.
    #[cfg(all(target_arch = "arm", target_os = "none"))]
    pub fn with_zero(&self) -> &[u8] {
        &self.bytes
    }
}
