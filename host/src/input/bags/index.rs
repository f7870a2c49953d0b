//! The index at the end of an MCAP file, whose records are looked at before they are parsed.

use crate::formats::bounds::{MAX_BAG_CHANNEL_ENTRIES, MAX_BAG_INDEX_BYTES, bytes_text, thousands};
use mcap::Summary;
use mcap::records::op;
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use std::fs::File;
use std::io::{self, Read, Seek};

/// Reads the index, within its bound; with its length, bytes.
///
/// # Errors
/// The fault of the index, as the rest of a sentence.
pub fn summary(file: &mut File) -> Result<(Option<Summary>, u64), String> {
    let failed = |error: io::Error| error.to_string();
    let options = SummaryReaderOptions::default()
        .with_file_size(file.metadata().map_err(failed)?.len())
        .with_record_length_limit(MAX_BAG_INDEX_BYTES as usize);
    let mut reader = SummaryReader::new_with_options(options);
    let mut bytes = 0;
    let mut records = Records::default();
    while let Some(event) = reader.next_event() {
        match event.map_err(|error| error.to_string())? {
            SummaryReadEvent::ReadRequest(need) => {
                if bytes > MAX_BAG_INDEX_BYTES {
                    let most = bytes_text(MAX_BAG_INDEX_BYTES);
                    return Err(format!("its index is longer than the {most} that are read"));
                }
                let space = reader.insert(need.min(MAX_BAG_INDEX_BYTES as usize));
                let read = file.read(space).map_err(failed)?;
                bytes += read as u64;
                records.take(space.get(..read).unwrap_or_default())?;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => {
                records = Records::default();
                reader.notify_seeked(file.seek(to).map_err(failed)?);
            }
        }
    }
    Ok((reader.finish(), bytes))
}

/// Records as they come. The parser takes memory for a text before it looks whether the record is
/// as long, and expects of some records that are for other parts of a file that they are whole.
#[derive(Default)]
struct Records {
    /// Bytes of the record that is not there as a whole yet.
    bytes: Vec<u8>,
    /// Entries of the channels so far.
    entries: usize,
}

impl Records {
    /// Takes the next bytes, and looks at the records that end in them.
    ///
    /// # Errors
    /// The fault of a record, as the rest of a sentence.
    fn take(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.bytes.extend_from_slice(bytes);
        let mut rest = &self.bytes[..];
        while let Some(&kind) = rest.first() {
            // Before it is whole: of a chunk, the parser takes records as they come.
            belongs(kind)?;
            let Some((_, body, behind)) = record(rest) else { break };
            self.entries += check(kind, body)?;
            if self.entries > MAX_BAG_CHANNEL_ENTRIES {
                let most = thousands(MAX_BAG_CHANNEL_ENTRIES);
                return Err(format!(
                    "its channels have more than the {most} entries that are read"
                ));
            }
            rest = behind;
        }
        let looked_at = self.bytes.len() - rest.len();
        self.bytes.drain(..looked_at);
        Ok(())
    }
}

/// Kind and body of the first record, and what is behind it; `None` where it is not whole.
fn record(bytes: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let (&kind, rest) = bytes.split_first()?;
    let (&len, rest) = rest.split_first_chunk()?;
    let (body, behind) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(len)).ok()?)?;
    Some((kind, body, behind))
}

/// Refuses a kind of record that belongs elsewhere; those that are not known are passed over.
fn belongs(kind: u8) -> Result<(), &'static str> {
    let is_of_index = matches!(
        kind,
        op::SCHEMA
            | op::CHANNEL
            | op::CHUNK_INDEX
            | op::ATTACHMENT_INDEX
            | op::METADATA_INDEX
            | op::STATISTICS
            | op::SUMMARY_OFFSET
            | op::FOOTER
            | 0
            | 0x10..
    );
    if is_of_index { Ok(()) } else { Err("its index holds records that belong elsewhere") }
}

/// Refuses a record with a text that ends beyond it. Returns the number of entries of a channel.
fn check(kind: u8, body: &[u8]) -> Result<usize, &'static str> {
    const BEYOND: &str = "a text or list of its index ends beyond its record";
    let whole = match kind {
        op::SCHEMA => body.get(2..).and_then(behind_text).and_then(behind_text),
        op::CHANNEL => {
            let names = body.get(4..).and_then(behind_text).and_then(behind_text);
            return names.and_then(entries).ok_or(BEYOND);
        }
        op::CHUNK_INDEX => {
            let offsets = body.get(32..).and_then(behind_offsets);
            offsets.and_then(|rest| behind_text(rest.get(8..)?))
        }
        op::ATTACHMENT_INDEX => body.get(40..).and_then(behind_text).and_then(behind_text),
        op::METADATA_INDEX => body.get(16..).and_then(behind_text),
        // Without a text.
        _ => Some(body),
    };
    whole.map(|_| 0).ok_or(BEYOND)
}

/// The bytes behind a length and as many bytes.
fn behind_text(bytes: &[u8]) -> Option<&[u8]> {
    let (&len, rest) = bytes.split_first_chunk()?;
    rest.get(u32::from_le_bytes(len) as usize..)
}

/// The number of entries in a list of keys and values.
fn entries(bytes: &[u8]) -> Option<usize> {
    let behind = behind_text(bytes)?;
    let mut texts = bytes.get(4..bytes.len() - behind.len())?;
    let mut count = 0;
    while !texts.is_empty() {
        texts = behind_text(texts)?;
        count += 1;
    }
    Some(count / 2)
}

/// The bytes behind a list of channels and offsets, which the parser reads by whole entries.
fn behind_offsets(bytes: &[u8]) -> Option<&[u8]> {
    const ENTRY: usize = 2 + 8;
    let (&len, rest) = bytes.split_first_chunk()?;
    rest.get((u32::from_le_bytes(len) as usize).checked_next_multiple_of(ENTRY)?..)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mcap::records::MessageHeader;
    use mcap::{Attachment, Writer};
    use std::borrow::Cow;
    use std::collections::BTreeMap;
    use std::io::{Cursor, Write};

    /// A recording with a record of each kind in its index.
    fn recording() -> Vec<u8> {
        let mut writer = Writer::new(Cursor::new(Vec::new())).unwrap();
        let schema = writer.add_schema("sensor_msgs/msg/Image", "ros2msg", b"text").unwrap();
        let of_channel = BTreeMap::from([("key".to_owned(), "value".to_owned())]);
        let channel_id = writer.add_channel(schema, "/left", "cdr", &of_channel).unwrap();
        let header = MessageHeader { channel_id, sequence: 0, log_time: 1, publish_time: 1 };
        writer.write_to_known_channel(&header, b"message").unwrap();
        let (name, media_type) = ("notes".to_owned(), "text/plain".to_owned());
        let data = Cow::Borrowed(&b"notes"[..]);
        let attachment = Attachment { log_time: 1, create_time: 1, name, media_type, data };
        writer.attach(&attachment).unwrap();
        let metadata = mcap::records::Metadata { name: "rig".to_owned(), metadata: of_channel };
        writer.write_metadata(&metadata).unwrap();
        writer.finish().unwrap();
        writer.into_inner().into_inner()
    }

    /// Position of the index.
    fn start(recording: &[u8]) -> usize {
        let at = recording.len() - 8 - 20;
        u64::from_le_bytes(recording[at..at + 8].try_into().unwrap()) as usize
    }

    /// Reads the index of a file of these bytes.
    fn read(bytes: &[u8]) -> Result<Option<Summary>, String> {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        summary(&mut file).map(|(summary, _)| summary)
    }

    /// A recording with a length of 1.4 GiB so many bytes into a record of its index.
    fn forged(kind: u8, at: usize) -> Vec<u8> {
        let mut bytes = recording();
        let mut rest = &bytes[start(&bytes)..];
        let body = loop {
            let (found, body, behind) = record(rest).unwrap();
            if found == kind {
                break bytes.len() - behind.len() - body.len();
            }
            rest = behind;
        };
        bytes[body + at..body + at + 4].fill(0x57);
        bytes
    }

    #[test]
    fn an_index_as_it_is_written_is_read_whole() {
        let bytes = recording();
        let expected = Summary::read(&bytes).unwrap().unwrap();
        assert_eq!(read(&bytes).unwrap(), Some(expected));
        // However the records come.
        let index = &bytes[start(&bytes)..bytes.len() - 8];
        for len in 1..index.len() {
            let mut records = Records::default();
            assert!(index.chunks(len).all(|part| records.take(part).is_ok()), "{len} at once");
            assert!(records.bytes.is_empty(), "{len} at once");
        }
    }

    #[test]
    fn texts_beyond_their_record_are_refused_before_they_are_read() {
        // The key in a channel follows the topic, its encoding and the length of the list.
        let key = 4 + (4 + 5) + (4 + 3) + 4;
        for (kind, at) in [
            (op::SCHEMA, 2),
            (op::SCHEMA, 2 + 4 + 21),
            (op::CHANNEL, 4),
            (op::CHANNEL, 4 + 4 + 5),
            (op::CHANNEL, key - 4),
            (op::CHANNEL, key),
            (op::CHANNEL, key + 4 + 3),
            (op::CHUNK_INDEX, 32),
            (op::CHUNK_INDEX, 32 + 4 + 10 + 8),
            (op::ATTACHMENT_INDEX, 40),
            (op::ATTACHMENT_INDEX, 40 + 4 + 5),
            (op::METADATA_INDEX, 16),
        ] {
            let refusal = read(&forged(kind, at)).unwrap_err();
            assert!(refusal.contains("ends beyond its record"), "{kind}, {at}: {refusal}");
        }
        // A list that ends within an entry is read to the entry's end.
        let list = [[0; 32].as_slice(), &[1, 0, 0, 0], &[0; 10 + 8], &[0x57; 4]].concat();
        assert!(check(op::CHUNK_INDEX, &list).is_err());
    }

    #[test]
    fn records_of_other_parts_of_a_file_are_refused_in_an_index() {
        let bytes = recording();
        let (before, index) = bytes.split_at(start(&bytes));
        // Without its checksum, a panic of the parser.
        let attachment = [&[op::ATTACHMENT, 32, 0, 0, 0, 0, 0, 0, 0][..], &[0; 32]].concat();
        let refusal = read(&[before, &attachment, index].concat()).unwrap_err();
        assert!(refusal.contains("belong elsewhere"), "{refusal}");
        // A chunk that is never whole, and in it a name of 1.4 GiB.
        let head = [[0; 28].as_slice(), &[0; 4], &100u64.to_le_bytes()].concat();
        let schema =
            [&[op::SCHEMA, 12, 0, 0, 0, 0, 0, 0, 0, 1, 0][..], &[0x57; 4], &[0; 6]].concat();
        let len = (bytes.len() as u64).to_le_bytes();
        let chunk = [&[op::CHUNK][..], &len, &head, &schema].concat();
        let refusal = read(&[before, &chunk, index].concat()).unwrap_err();
        assert!(refusal.contains("belong elsewhere"), "{refusal}");
        // One of a kind that is not known is passed over.
        let other = [0x80, 2, 0, 0, 0, 0, 0, 0, 0, 7, 7];
        assert!(read(&[before, &other, index].concat()).unwrap().is_some());
    }
}
