//! Vertices as planes of bytes that deflate well.

/// Bits of a cell's coordinate in the order of positions.
const CELL_BITS: u32 = 10;

/// The longest side of a box, m.
pub fn longest_side([low, high]: [[f32; 3]; 2]) -> f32 {
    (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f32::max)
}

/// The number of a point's cell along a curve whose neighbours are near each other in space (Morton
/// order).
pub fn morton(position_m: [f32; 3], bounds_m: [[f32; 3]; 2]) -> u32 {
    let side = longest_side(bounds_m).max(1e-6);
    let cell = |axis: usize| {
        ((position_m[axis] - bounds_m[0][axis]) / side * ((1 << CELL_BITS) - 1) as f32) as u32
    };
    let cells = [0, 1, 2].map(cell);
    (0..CELL_BITS)
        .rev()
        .flat_map(|bit| cells.map(|cell| cell >> bit & 1))
        .fold(0, |number, bit| number << 1 | bit)
}

/// Appends the differences of words from the one before, small ones of either sign as small
/// numbers.
pub fn push_word_differences(planes: &mut Vec<u8>, words: impl Iterator<Item = u16>) {
    let differences = words.scan(0u16, |before, word| {
        let difference = word.wrapping_sub(std::mem::replace(before, word)) as i16;
        Some((difference << 1 ^ difference >> 15) as u16)
    });
    push_words(planes, &differences.collect::<Vec<_>>());
}

/// Appends the differences of bytes from the one before.
pub fn push_byte_differences(planes: &mut Vec<u8>, bytes: impl Iterator<Item = u8>) {
    planes.extend(
        bytes.scan(0u8, |before, byte| Some(byte.wrapping_sub(std::mem::replace(before, byte)))),
    );
}

/// Appends the low bytes of all words, and then the high ones.
pub fn push_words(planes: &mut Vec<u8>, words: &[u16]) {
    planes.extend(words.iter().map(|word| *word as u8));
    planes.extend(words.iter().map(|word| (word >> 8) as u8));
}
