//! Reading an MCAP file through its index, a chunk at a time.

use super::cdr::{CameraInfo, stamp_ns};
use super::{Entry, images};
use crate::formats::Picture;
use crate::formats::bounds::{
    MAX_BAG_IMAGES, MAX_BAG_INDEX_BYTES, MAX_BAG_RATIO, MAX_BAG_RECORD_BYTES, bytes_text,
    check_bytes, thousands,
};
use crate::input::source::InputError;
use mcap::sans_io::indexed_reader::{
    IndexedReadEvent, IndexedReader, IndexedReaderOptions, ReadOrder,
};
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use mcap::{McapError, Summary};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// A file and its index.
pub struct BagFile {
    path: PathBuf,
    summary: Summary,
}

/// A topic and the type of its messages: `sensor_msgs/msg/Image`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    pub name: String,
    pub kind: String,
}

impl BagFile {
    /// Reads the index.
    pub fn open(path: &Path) -> Result<Self, InputError> {
        let broken = |reason: String| {
            let shown = path.display();
            InputError::bag(
                path,
                format!(
                    "it is truncated or has no index ({reason}). Repair it with `mcap recover \
                     {shown} -o repaired.mcap`"
                ),
            )
        };
        let mut file = File::open(path).map_err(crate::input::source::read_failed(path))?;
        let summary = summary(&mut file)
            .map_err(|error| broken(error.to_string()))?
            .ok_or_else(|| broken("no summary".to_owned()))?;
        if summary.chunk_indexes.is_empty() {
            return Err(broken("no chunk is listed".to_owned()));
        }
        let len = file.metadata().map_err(crate::input::source::read_failed(path))?.len();
        check_chunks(&summary, len)
            .map_err(|reason| InputError::bag(path, format!("{reason}. Record or copy it anew")))?;
        Ok(Self { path: path.to_path_buf(), summary })
    }

    /// Returns the path of the recording.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the recording's topics in CDR, by name.
    pub fn topics(&self) -> Vec<Topic> {
        let channels =
            self.summary.channels.values().filter(|channel| channel.message_encoding == "cdr");
        let kind = |schema: &str| schema.replace("/msg/", "/");
        let mut topics: Vec<Topic> = channels
            .filter_map(|channel| {
                Some(Topic {
                    name: channel.topic.clone(),
                    kind: kind(&channel.schema.as_ref()?.name),
                })
            })
            .collect();
        topics.sort_by(|a, b| a.name.cmp(&b.name));
        topics.dedup();
        topics
    }

    /// Hands each message of some topics, logged at `logged_ns`, to `take` with its
    /// topic and time, until that returns false.
    fn messages(
        &self,
        topics: &[&str],
        logged_ns: RangeInclusive<u64>,
        take: &mut dyn FnMut(&str, u64, &[u8]) -> bool,
    ) -> Result<(), InputError> {
        let damaged = |error: McapError| {
            InputError::bag(&self.path, format!("it is damaged: {error}. Record or copy it anew"))
        };
        let failed = |error: std::io::Error| damaged(McapError::Io(error));
        let options = IndexedReaderOptions::new()
            .include_topics(topics.iter().copied())
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
                    let Some(channel) = self.summary.channels.get(&header.channel_id) else {
                        continue;
                    };
                    if !take(&channel.topic, header.log_time, data) {
                        return Ok(());
                    }
                }
            }
        }
        Ok(())
    }

    /// Every image of a topic by the time it was taken.
    pub fn entries(&self, topic: &str) -> Result<Vec<Entry>, InputError> {
        let mut entries = Vec::new();
        self.messages(&[topic], 0..=u64::MAX, &mut |_, log_ns, data| {
            entries.extend(stamp_ns(data).map(|stamp_ns| Entry { log_ns, stamp_ns }));
            entries.len() <= MAX_BAG_IMAGES
        })?;
        if entries.len() > MAX_BAG_IMAGES {
            let most = thousands(MAX_BAG_IMAGES);
            return Err(InputError::bag(
                &self.path,
                format!(
                    "{topic} has more than the {most} images that are read of a topic. Split the \
                     recording"
                ),
            ));
        }
        entries.sort_by_key(|entry: &Entry| entry.stamp_ns);
        entries.dedup_by_key(|entry| entry.stamp_ns);
        Ok(entries)
    }

    /// The first calibration of a topic.
    pub fn camera_info(&self, topic: &str) -> Result<CameraInfo, InputError> {
        let mut info = None;
        self.messages(&[topic], 0..=u64::MAX, &mut |_, _, data| {
            info = CameraInfo::read(data);
            false
        })?;
        info.ok_or_else(|| {
            InputError::bag(
                &self.path,
                format!(
                    "{topic} has no whole CameraInfo. Give the calibration with --calibration FILE"
                ),
            )
        })
    }

    /// The two images of a pair.
    pub fn pair(
        &self,
        topics: &[String; 2],
        pair: &[Entry; 2],
    ) -> Result<[Picture; 2], InputError> {
        let [left, right] = [0, 1].map(|side| self.picture(&topics[side], &pair[side]));
        Ok([left?, right?])
    }

    fn picture(&self, topic: &str, entry: &Entry) -> Result<Picture, InputError> {
        let compressed = self
            .topics()
            .iter()
            .any(|known| known.name == topic && known.kind.ends_with("CompressedImage"));
        let mut found = None;
        self.messages(&[topic], entry.log_ns..=entry.log_ns, &mut |_, _, data| {
            if stamp_ns(data) != Some(entry.stamp_ns) {
                return true;
            }
            found = Some(images::picture(data, compressed));
            false
        })?;
        let found = found.unwrap_or_else(|| Err("the message is gone".to_owned()));
        let at =
            || PathBuf::from(format!("{} {topic} at {} ns", self.path.display(), entry.stamp_ns));
        found.map_err(|reason| InputError::Image { path: at(), reason })
    }
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

/// Reads the index at the file's end, within its bound.
fn summary(file: &mut File) -> Result<Option<Summary>, McapError> {
    let options = SummaryReaderOptions::default()
        .with_file_size(file.metadata()?.len())
        .with_record_length_limit(MAX_BAG_INDEX_BYTES as usize);
    let mut reader = SummaryReader::new_with_options(options);
    let mut bytes = 0;
    while let Some(event) = reader.next_event() {
        match event? {
            SummaryReadEvent::ReadRequest(need) => {
                if bytes > MAX_BAG_INDEX_BYTES {
                    let most = bytes_text(MAX_BAG_INDEX_BYTES);
                    let error = format!("its index is longer than the {most} that are read");
                    return Err(McapError::Io(std::io::Error::other(error)));
                }
                let read = file.read(reader.insert(need.min(MAX_BAG_INDEX_BYTES as usize)))?;
                bytes += read as u64;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => reader.notify_seeked(file.seek(to)?),
        }
    }
    Ok(reader.finish())
}
