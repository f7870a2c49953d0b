//! Memory and work of a JPEG, by its markers.

use crate::formats::bounds::{MAX_JPEG_SCANS, check_decoding};
use ::image::ImageDecoder;

/// Marker of a baseline frame.
const BASELINE: u8 = 0xC0;
/// Marker of an extended sequential frame.
const EXTENDED: u8 = 0xC1;
/// Marker of a scan.
const SCAN: u8 = 0xDA;
/// Bytes of a coefficient in memory.
const COEFFICIENT_BYTES: u64 = 2;

/// Refuses a file that takes too much memory or time to decode: the file is held twice, and the
/// coefficients of a progressive one are kept until its last scan.
///
/// # Errors
/// Names the need and the bound, as the rest of a sentence.
pub fn check(file: &[u8], decoder: &impl ImageDecoder) -> Result<(), String> {
    let (width, height) = decoder.dimensions();
    let samples = decoder.total_bytes();
    let coefficients = if is_sequential(file) { 0 } else { COEFFICIENT_BYTES * samples };
    let bytes = samples + coefficients + 2 * file.len() as u64;
    check_decoding(width as usize, height as usize, bytes)?;
    let scans = file.windows(2).filter(|marker| marker == &[0xFF, SCAN]).count();
    if scans <= MAX_JPEG_SCANS {
        return Ok(());
    }
    Err(format!("it has {scans} scans; at most {MAX_JPEG_SCANS} are read"))
}

/// True if the frame's header says that each scan holds whole blocks. A file that cannot be
/// followed up to that header counts as progressive, which takes more.
fn is_sequential(file: &[u8]) -> bool {
    let mut rest = file.get(2..).unwrap_or_default();
    while let [0xFF, marker, after @ ..] = rest {
        match *marker {
            BASELINE | EXTENDED => return true,
            // Padding between segments.
            0xFF => rest = &rest[1..],
            0xC2..=0xC3 | 0xC5..=0xC7 | 0xC9..=0xCB | 0xCD..=0xCF | SCAN => return false,
            _ => {
                let Some(len) = after.first_chunk().map(|bytes| u16::from_be_bytes(*bytes)) else {
                    return false;
                };
                let Some(next) = after.get(usize::from(len)..) else { return false };
                rest = next;
            }
        }
    }
    false
}
