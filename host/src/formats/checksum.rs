//! Checksums of files.

use std::fs::File;
use std::io::{self, Read};

/// Bytes read at once.
const WINDOW_BYTES: usize = 16 << 10;

/// CRC-32 of the next `bytes` bytes of a file; `None` where it is shorter.
///
/// # Errors
/// The file cannot be read.
pub fn checksum_of(file: &File, bytes: u64) -> io::Result<Option<u32>> {
    let (mut checksum, mut left, mut window) =
        (crc32fast::Hasher::new(), bytes, vec![0; WINDOW_BYTES]);
    let mut rest = file.take(bytes);
    loop {
        match rest.read(&mut window)? {
            0 => return Ok((left == 0).then(|| checksum.finalize())),
            read => {
                checksum.update(&window[..read]);
                left -= read as u64;
            }
        }
    }
}
