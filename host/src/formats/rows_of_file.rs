//! A file whose rows are read one by one, each within a bound.

use super::FormatError;
use super::bounds::{MAX_ROW_BYTES, bytes_text};
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

/// Hands out the bytes of a file, and fails in a row that does not end.
#[derive(Debug)]
pub struct RowsOfFile<R> {
    bytes: R,
    /// Bytes of the row so far.
    row: usize,
}

/// Opens a table that may be of any length.
///
/// # Errors
/// It cannot be opened.
pub fn rows_of_file(path: &Path) -> Result<RowsOfFile<BufReader<File>>, FormatError> {
    let file = File::open(path).map_err(FormatError::read(path))?;
    Ok(RowsOfFile { bytes: BufReader::new(file), row: 0 })
}

impl<R: Read> Read for RowsOfFile<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.bytes.read(buffer)?;
        let bytes = buffer.get(..read).unwrap_or_default();
        self.row = match bytes.iter().rposition(|&byte| byte == b'\n') {
            Some(end) => read - 1 - end,
            None => self.row + read,
        };
        if self.row > MAX_ROW_BYTES {
            let most = bytes_text(MAX_ROW_BYTES as u64);
            let reason = format!("a row is longer than the {most} that are read");
            return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
        }
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_rows_are_read_and_one_without_an_end_is_not() {
        let read = |bytes: &[u8]| RowsOfFile { bytes, row: 0 }.read_to_end(&mut Vec::new());
        assert_eq!(read(&b"1,2,3\n".repeat(MAX_ROW_BYTES)).unwrap(), 6 * MAX_ROW_BYTES);
        let error = read(&vec![b'1'; 2 * MAX_ROW_BYTES]).unwrap_err().to_string();
        assert_eq!(error, "a row is longer than the 1 MiB that are read");
    }
}
