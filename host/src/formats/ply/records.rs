//! Records of one size in a file, read and changed at any position.
//!
//! Memory: [`CHUNKS`] chunks of [`CHUNK_RECORDS`] records, however long the file is. What is asked
//! for together should lie near each other.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};

/// Records read and written at once.
const CHUNK_RECORDS: u64 = 4_096;
/// Chunks kept.
const CHUNKS: usize = 256;

#[derive(Debug)]
struct Chunk {
    number: u64,
    changed: bool,
    bytes: Vec<u8>,
}

/// The records of a file.
#[derive(Debug)]
pub(super) struct Records {
    file: File,
    /// Offset of the first record.
    start: u64,
    /// Number of records.
    len: u64,
    /// Bytes of one.
    size: usize,
    /// Each chunk in the slot of its number modulo [`CHUNKS`].
    chunks: Vec<Option<Chunk>>,
}

impl Records {
    /// `len` records of `size` bytes that begin at `start`.
    pub fn new(file: File, start: u64, len: u64, size: usize) -> Self {
        Self { file, start, len, size, chunks: (0..CHUNKS).map(|_| None).collect() }
    }

    /// Returns the number of records.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Appends a record.
    pub fn push(&mut self, record: &[u8]) -> io::Result<()> {
        let at = self.len;
        self.len += 1;
        self.change(at, |bytes| bytes.copy_from_slice(record))
    }

    /// A record; `None` behind the last.
    pub fn get(&mut self, at: u64) -> io::Result<Option<&[u8]>> {
        if at >= self.len {
            return Ok(None);
        }
        let from = (at % CHUNK_RECORDS) as usize * self.size;
        let size = self.size;
        Ok(self.chunk(at)?.bytes.get(from..from + size))
    }

    /// Changes a record.
    pub fn change(&mut self, at: u64, change: impl FnOnce(&mut [u8])) -> io::Result<()> {
        let from = (at % CHUNK_RECORDS) as usize * self.size;
        let size = self.size;
        let chunk = self.chunk(at)?;
        chunk.changed = true;
        if chunk.bytes.len() < from + size {
            chunk.bytes.resize(from + size, 0);
        }
        change(&mut chunk.bytes[from..from + size]);
        Ok(())
    }

    /// Changes each record once, and writes what has changed: first what is in memory, so that no
    /// more is read than is not.
    pub fn finish(mut self, mut change: impl FnMut(&mut [u8])) -> io::Result<File> {
        let in_memory: Vec<u64> = self.chunks.iter().flatten().map(|chunk| chunk.number).collect();
        let read =
            (0..self.len.div_ceil(CHUNK_RECORDS)).filter(|number| !in_memory.contains(number));
        for number in in_memory.iter().copied().chain(read) {
            let size = self.size;
            let chunk = self.chunk(number * CHUNK_RECORDS)?;
            chunk.changed = true;
            chunk.bytes.chunks_exact_mut(size).for_each(&mut change);
            self.write(number as usize % CHUNKS)?;
        }
        Ok(self.file)
    }

    /// The chunk with a record.
    fn chunk(&mut self, at: u64) -> io::Result<&mut Chunk> {
        let number = at / CHUNK_RECORDS;
        let slot = number as usize % CHUNKS;
        if self.chunks[slot].as_ref().is_none_or(|chunk| chunk.number != number) {
            self.write(slot)?;
            self.chunks[slot] = None;
        }
        if self.chunks[slot].is_none() {
            // What was appended last may not be in the file yet.
            let there = self.file.metadata()?.len().saturating_sub(self.position(number))
                / self.size as u64;
            let mut bytes = vec![
                0;
                there.min(CHUNK_RECORDS).min(self.len - number * CHUNK_RECORDS)
                    as usize
                    * self.size
            ];
            self.file.seek(SeekFrom::Start(self.position(number)))?;
            self.file.read_exact(&mut bytes)?;
            self.chunks[slot] = Some(Chunk { number, changed: false, bytes });
        }
        self.chunks[slot].as_mut().ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn position(&self, number: u64) -> u64 {
        self.start + number * CHUNK_RECORDS * self.size as u64
    }

    /// Writes a chunk that has changed.
    fn write(&mut self, slot: usize) -> io::Result<()> {
        let Some(number) =
            self.chunks[slot].as_ref().filter(|chunk| chunk.changed).map(|chunk| chunk.number)
        else {
            return Ok(());
        };
        let position = self.position(number);
        self.file.seek(SeekFrom::Start(position))?;
        if let Some(chunk) = &mut self.chunks[slot] {
            self.file.write_all(&chunk.bytes)?;
            chunk.changed = false;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_far_apart_are_changed_while_others_are_appended() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("records");
        let file =
            File::options().read(true).write(true).create(true).truncate(true).open(&path).unwrap();
        let mut records = Records::new(file, 3, 0, 4);
        // More than all slots hold.
        let count = CHUNKS as u64 * CHUNK_RECORDS + 9_000;
        for at in 0..count {
            records.push(&(at as u32).to_le_bytes()).unwrap();
            if at % 100_000 == 7 {
                records.change(at / 2, |bytes| bytes[3] = 0xff).unwrap();
            }
        }
        assert_eq!((records.len(), records.get(count).unwrap()), (count, None));
        assert_eq!(records.get(5).unwrap(), Some(&5u32.to_le_bytes()[..]));
        let mut visited = 0;
        records.finish(|_| visited += 1).unwrap();
        let bytes = std::fs::read(path).unwrap();
        assert_eq!((visited, bytes.len() as u64), (count, 3 + 4 * count));
        for (at, record) in bytes[3..].chunks_exact(4).enumerate() {
            let marked = (0..count)
                .step_by(100_000)
                .any(|step| step + 7 < count && (step + 7) / 2 == at as u64);
            let expected = (at as u32) | if marked { 0xff00_0000 } else { 0 };
            assert_eq!(u32::from_le_bytes(record.try_into().unwrap()), expected, "{at}");
        }
    }
}
