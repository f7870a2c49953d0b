//! MCAP: read through its index, a chunk at a time.

use super::container::{Container, Message, TakeMessage, Topic};
use super::index::summary;
use super::messages::Encoding;
use crate::formats::bounds::{MAX_BAG_RATIO, MAX_BAG_RECORD_BYTES, bytes_text, check_bytes};
use crate::input::source::InputError;
use mcap::sans_io::indexed_reader::{
    IndexedReadEvent, IndexedReader, IndexedReaderOptions, ReadOrder,
};
use mcap::{McapError, Summary};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// A file and its index.
pub struct McapFile {
    path: PathBuf,
    summary: Summary,
    index_bytes: u64,
    topics: Vec<Topic>,
}

impl McapFile {
    /// Reads the index.
    pub fn open(path: &Path) -> Result<Self, InputError> {
        let refuse = |reason: String| InputError::bag(path, reason);
        let recover = format!("`mcap recover {} -o repaired.mcap`", path.display());
        let broken = |reason: String| {
            refuse(format!("it is cut off or has no index ({reason}). Repair it with {recover}"))
        };
        let mut file = File::open(path).map_err(crate::input::source::read_failed(path))?;
        let (summary, index_bytes) = summary(&mut file).map_err(broken)?;
        let summary = summary.ok_or_else(|| broken("no summary".to_owned()))?;
        if summary.chunk_indexes.is_empty() {
            let messages = summary.stats.as_ref().map_or(0, |stats| stats.message_count);
            return Err(match messages {
                0 => broken("no chunk is listed".to_owned()),
                // As ROS 2's storage preset `fastwrite` leaves them.
                _ => refuse(format!(
                    "its messages are not in chunks, so that none can be found by its time. Write \
                     it anew with {recover}"
                )),
            });
        }
        let len = file.metadata().map_err(crate::input::source::read_failed(path))?.len();
        check_chunks(&summary, len)
            .map_err(|reason| refuse(format!("{reason}. Record or copy it anew")))?;
        let topics = topics(&summary);
        Ok(Self { path: path.to_path_buf(), summary, index_bytes, topics })
    }

    /// Returns the length of the index, bytes.
    pub fn index_bytes(&self) -> u64 {
        self.index_bytes
    }
}

impl Container for McapFile {
    fn path(&self) -> &Path {
        &self.path
    }

    fn topics(&self) -> &[Topic] {
        &self.topics
    }

    fn messages(
        &self,
        topic: &str,
        logged_ns: RangeInclusive<u64>,
        take: TakeMessage<'_>,
    ) -> Result<(), InputError> {
        let damaged = |error: McapError| {
            InputError::bag(&self.path, format!("it is damaged: {error}. Record or copy it anew"))
        };
        let failed = |error| crate::input::source::read_failed(&self.path)(error);
        let options = IndexedReaderOptions::new()
            .include_topics([topic])
            .starting_at(*logged_ns.start())
            .ending_at(*logged_ns.end())
            // By time, chunks that overlap would be in memory together.
            .with_order(ReadOrder::File)
            .with_record_length_limit(MAX_BAG_RECORD_BYTES);
        let mut reader =
            IndexedReader::new_with_options(&self.summary, options).map_err(damaged)?;
        let mut file = File::open(&self.path).map_err(failed)?;
        let mut chunk = Vec::new();
        while let Some(event) = reader.next_event() {
            match event.map_err(damaged)? {
                IndexedReadEvent::ReadChunkRequest { offset, length } => {
                    file.seek(SeekFrom::Start(offset)).map_err(failed)?;
                    chunk.clear();
                    let read = file
                        .by_ref()
                        .take(length as u64)
                        .read_to_end(&mut chunk)
                        .map_err(failed)?;
                    if read < length {
                        return Err(damaged(McapError::UnexpectedEof));
                    }
                    reader.insert_chunk_record_data(offset, &chunk).map_err(damaged)?;
                    // Unpacked, it is in the reader; a picture will need the memory.
                    chunk = Vec::new();
                }
                IndexedReadEvent::Message { header, data } => {
                    if !take(Message { log_ns: header.log_time, bytes: data }) {
                        return Ok(());
                    }
                }
            }
        }
        Ok(())
    }
}

/// The topics of messages that can be read, by name.
fn topics(summary: &Summary) -> Vec<Topic> {
    let mut topics: Vec<Topic> = summary
        .channels
        .values()
        .filter_map(|channel| {
            Some(Topic {
                name: channel.topic.clone(),
                kind: channel.schema.as_ref()?.name.replace("/msg/", "/"),
                encoding: Encoding::from_name(&channel.message_encoding)?,
            })
        })
        .collect();
    topics.sort_by(|a, b| a.name.cmp(&b.name));
    topics.dedup();
    topics
}

/// Refuses chunks that are too long, lie outside the file, overlap, or unpack to far more than the
/// file's length.
fn check_chunks(summary: &Summary, file_bytes: u64) -> Result<(), String> {
    let mut ranges = Vec::with_capacity(summary.chunk_indexes.len());
    let (mut packed, mut unpacked) = (0u64, 0u64);
    for chunk in &summary.chunk_indexes {
        let longest = chunk.compressed_size.max(chunk.uncompressed_size);
        check_bytes("a chunk of an MCAP file", longest, MAX_BAG_RECORD_BYTES as u64)?;
        packed = packed.saturating_add(chunk.compressed_size);
        unpacked = unpacked.saturating_add(chunk.uncompressed_size);
        ranges.push((chunk.chunk_start_offset, chunk.compressed_size));
    }
    ranges.sort_unstable();
    let overlap = ranges
        .windows(2)
        .any(|pair| pair[0].0.checked_add(pair[0].1).is_none_or(|end| end > pair[1].0));
    if overlap || packed > file_bytes {
        return Err("its index lists chunks that overlap or lie beyond its end".to_owned());
    }
    let most = MAX_BAG_RECORD_BYTES as u64 + file_bytes.saturating_mul(MAX_BAG_RATIO);
    if unpacked > most {
        return Err(format!(
            "its chunks unpack to {}; of a file of {} at most {} are read",
            bytes_text(unpacked),
            bytes_text(file_bytes),
            bytes_text(most)
        ));
    }
    Ok(())
}
