//! What a file of any container gives: topics, and their messages in the order of the file.

use super::messages::Encoding;
use crate::input::source::InputError;
use std::ops::RangeInclusive;
use std::path::Path;

/// A topic and the type of its messages: `sensor_msgs/Image`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    pub name: String,
    pub kind: String,
    /// Arrangement of its messages' bytes.
    pub encoding: Encoding,
}

impl Topic {
    /// Returns true if its messages are images.
    pub fn is_image(&self) -> bool {
        matches!(self.kind.as_str(), "sensor_msgs/Image" | "sensor_msgs/CompressedImage")
    }
}

/// A message as it lies in the file.
#[derive(Clone, Copy, Debug)]
pub struct Message<'m> {
    /// Time at which it was recorded, ns.
    pub log_ns: u64,
    pub bytes: &'m [u8],
}

/// Takes messages one by one, until it returns false.
pub type TakeMessage<'t> = &'t mut dyn FnMut(Message<'_>) -> bool;

/// A file of messages.
pub trait Container: Send + Sync {
    /// Returns the path of the file.
    fn path(&self) -> &Path;

    /// Returns the topics whose messages can be read.
    fn topics(&self) -> &[Topic];

    /// Hands the messages of a topic that were recorded within a time to `take`.
    ///
    /// # Errors
    /// The file is damaged.
    fn messages(
        &self,
        topic: &str,
        logged_ns: RangeInclusive<u64>,
        take: TakeMessage<'_>,
    ) -> Result<(), InputError>;
}
