//! All files of a recording as one: topics, images by their times, pictures.

use super::container::{Container, Topic};
use super::listing::{Kind, conversion, files_at};
use super::mcap_file::McapFile;
use super::messages::{CameraInfo, inertial_reading, stamp_ns};
use super::{images, listing};
use crate::formats::bounds::{
    MAX_BAG_IMAGES, MAX_BAG_INDEXES_BYTES, MAX_INERTIAL_SAMPLES, bytes_text, thousands,
};
use crate::formats::{BayerPattern, Picture, TimedReading};
use crate::input::source::InputError;
use std::path::{Path, PathBuf};

/// An image in a recording.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Position of its file.
    pub file: usize,
    /// Time of recording, ns: the position in its file.
    pub log_ns: u64,
    /// Time stamp of the header, ns.
    pub header_ns: u64,
    /// Time at which it was taken, ns: the header's unless that tells none.
    pub time_ns: u64,
}

/// The files of a recording, in order.
pub struct Recording {
    path: PathBuf,
    files: Vec<Box<dyn Container>>,
    topics: Vec<Topic>,
    /// Colour filters of grey images that are mosaics.
    bayer: Option<BayerPattern>,
}

impl Recording {
    /// Opens a file, or all of a folder.
    ///
    /// # Errors
    /// One of them cannot be used.
    pub fn open(path: &Path) -> Result<Self, InputError> {
        let mut files: Vec<Box<dyn Container>> = Vec::new();
        let mut index_bytes = 0;
        for file in files_at(path)? {
            if Kind::of_name(&file) != Some(Kind::Mcap) {
                return Err(InputError::bag(
                    &file,
                    format!(
                        "it is a recording of ROS in another format than MCAP. {}",
                        conversion(path)
                    ),
                ));
            }
            let opened = McapFile::open(&file)?;
            index_bytes += opened.index_bytes();
            if index_bytes > MAX_BAG_INDEXES_BYTES {
                let most = bytes_text(MAX_BAG_INDEXES_BYTES);
                let reason = format!(
                    "the indexes of its files are longer than the {most} that are read. Give some \
                     of the files in a folder of their own"
                );
                return Err(InputError::bag(path, reason));
            }
            files.push(Box::new(opened));
        }
        let mut topics: Vec<Topic> =
            files.iter().flat_map(|file| file.topics().iter().cloned()).collect();
        topics.sort_by(|a, b| a.name.cmp(&b.name));
        topics.dedup();
        Ok(Self { path: path.to_path_buf(), files, topics, bayer: None })
    }

    /// Takes grey images for mosaics of a pattern.
    pub fn with_bayer(self, bayer: Option<BayerPattern>) -> Self {
        Self { bayer, ..self }
    }

    /// Returns the path of the recording.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the topics by name.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Facts about the files, as notes.
    pub fn notes(&self) -> Vec<String> {
        let count = self.files.len();
        let all = (count > 1).then(|| format!("{count} files of one recording, in their order"));
        all.or_else(|| listing::siblings_note(&self.path)).into_iter().collect()
    }

    /// Every image of a topic, in the order of the files.
    ///
    /// # Errors
    /// A file is damaged, or has too many images.
    pub fn entries(&self, topic: &str) -> Result<Vec<Entry>, InputError> {
        let mut entries = Vec::new();
        for (file, container) in self.files.iter().enumerate() {
            let Some(encoding) = encoding_of(container.as_ref(), topic) else { continue };
            container.messages(topic, 0..=u64::MAX, &mut |message| {
                let entry = |header_ns| Entry {
                    file,
                    log_ns: message.log_ns,
                    header_ns,
                    time_ns: header_ns,
                };
                entries.extend(stamp_ns(message.bytes, encoding).map(entry));
                entries.len() <= MAX_BAG_IMAGES
            })?;
        }
        if entries.len() > MAX_BAG_IMAGES {
            let most = thousands(MAX_BAG_IMAGES);
            let reason = format!(
                "{topic} has more than the {most} images that are read of a topic. Split the \
                 recording"
            );
            return Err(InputError::bag(&self.path, reason));
        }
        Ok(entries)
    }

    /// Every inertial sample of a topic, in the order of the files, at the times of their headers;
    /// one more than are read where there are too many. Messages that are not whole are left out.
    ///
    /// # Errors
    /// A file is damaged.
    pub fn inertial(&self, topic: &str) -> Result<Vec<TimedReading>, InputError> {
        let mut readings = Vec::new();
        for container in &self.files {
            let Some(encoding) = encoding_of(container.as_ref(), topic) else { continue };
            container.messages(topic, 0..=u64::MAX, &mut |message| {
                readings.extend(inertial_reading(message.bytes, encoding));
                readings.len() <= MAX_INERTIAL_SAMPLES
            })?;
        }
        Ok(readings)
    }

    /// The first calibration of a topic.
    ///
    /// # Errors
    /// No message is a whole `CameraInfo`, or a file is damaged.
    pub fn camera_info(&self, topic: &str) -> Result<CameraInfo, InputError> {
        let mut info = None;
        for container in &self.files {
            let Some(encoding) = encoding_of(container.as_ref(), topic) else { continue };
            container.messages(topic, 0..=u64::MAX, &mut |message| {
                info = CameraInfo::read(message.bytes, encoding);
                false
            })?;
            if info.is_some() {
                break;
            }
        }
        info.ok_or_else(|| {
            let reason = format!(
                "{topic} has no whole CameraInfo. Give the calibration with --calibration FILE"
            );
            InputError::bag(&self.path, reason)
        })
    }

    /// The two images of a pair.
    ///
    /// # Errors
    /// One of them cannot be read.
    pub fn pair(
        &self,
        topics: &[String; 2],
        pair: &[Entry; 2],
    ) -> Result<[Picture; 2], InputError> {
        let [left, right] = [0, 1].map(|side| self.picture(&topics[side], &pair[side]));
        Ok([left?, right?])
    }

    /// One image of a topic.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn picture(&self, topic: &str, entry: &Entry) -> Result<Picture, InputError> {
        let mut found = None;
        let container = self.files.get(entry.file);
        if let Some(container) = container
            && let Some(topic) = container.topics().iter().find(|known| known.name == topic)
        {
            container.messages(&topic.name, entry.log_ns..=entry.log_ns, &mut |message| {
                if stamp_ns(message.bytes, topic.encoding) != Some(entry.header_ns) {
                    return true;
                }
                let picture = images::picture(message.bytes, topic);
                found = Some(picture.and_then(|picture| match self.bayer {
                    Some(pattern) => picture.demosaiced(pattern),
                    None => Ok(picture),
                }));
                false
            })?;
        }
        let found = found.unwrap_or_else(|| Err("the message is gone".to_owned()));
        let file = container.map_or(self.path.as_path(), |container| container.path());
        found.map_err(|reason| InputError::Image {
            path: PathBuf::from(format!("{} {topic} at {} ns", file.display(), entry.time_ns)),
            reason,
        })
    }
}

fn encoding_of(container: &dyn Container, topic: &str) -> Option<super::messages::Encoding> {
    container.topics().iter().find(|known| known.name == topic).map(|known| known.encoding)
}
