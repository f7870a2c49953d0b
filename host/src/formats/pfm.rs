//! Portable float maps: `Pf`, width, height, a scale whose sign tells the byte order, then floats,
//! the lowest row first.

use super::{FormatError, Image, read_bytes_within};
use std::path::Path;

/// Bytes of a header: its four words, and blanks.
const HEADER_BYTES: u64 = 256;

/// Next action for a file that is not of this format.
const ACTION: &str = "Write it anew, as a grey PFM of the images' size";

/// Reads a grey PFM of `size`. The scale's magnitude says nothing of the values and is left aside,
/// as other programs do.
///
/// # Errors
/// The file cannot be read, has no header of a grey PFM, or another size.
pub fn read_pfm(path: &Path, size: (usize, usize)) -> Result<Image<f32>, FormatError> {
    let most = HEADER_BYTES + 4 * (size.0 * size.1) as u64;
    let bytes = read_bytes_within(path, "a PFM of the images' size", most)?;
    let refuse = |reason: &str| FormatError::content(path, reason, ACTION);
    let (header, body) = header(&bytes)
        .ok_or_else(|| refuse("it does not have the header of a PFM: Pf, width, height, scale"))?;
    match header[0] {
        "Pf" => {}
        "PF" => {
            return Err(refuse("it is a PFM in colour; disparity or depth is one value a pixel"));
        }
        _ => return Err(refuse("it does not begin with Pf")),
    }
    let (Ok(width), Ok(height)) = (header[1].parse::<usize>(), header[2].parse::<usize>()) else {
        return Err(refuse("its width and height are not numbers"));
    };
    if (width, height) != size {
        return Err(FormatError::other_size(path, (width, height), size));
    }
    let scale: f64 = header[3]
        .parse()
        .ok()
        .filter(|scale: &f64| *scale != 0.0 && scale.is_finite())
        .ok_or_else(|| refuse("its scale is not a number"))?;
    let (words, rest) = body.as_chunks::<4>();
    if words.len() != width * height || !rest.is_empty() {
        return Err(refuse(&format!(
            "it holds {} bytes of pixels, not {}",
            body.len(),
            4 * width * height
        )));
    }
    let value = |word: &[u8; 4]| {
        if scale < 0.0 { f32::from_le_bytes(*word) } else { f32::from_be_bytes(*word) }
    };
    let pixels = words.chunks_exact(width).rev().flatten().map(value).collect();
    Image::new(width, height, pixels).ok_or_else(|| refuse("it has no pixels"))
}

/// The four words of the header, and what follows the single byte after them.
fn header(bytes: &[u8]) -> Option<([&str; 4], &[u8])> {
    let mut words = [""; 4];
    let mut rest = bytes;
    for word in &mut words {
        rest = rest.trim_ascii_start();
        let end = rest.iter().take(32).position(u8::is_ascii_whitespace)?;
        *word = std::str::from_utf8(&rest[..end]).ok()?;
        rest = &rest[end..];
    }
    Some((words, rest.get(1..)?))
}
