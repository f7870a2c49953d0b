//! What is watched while a run goes on: the reference depth, tracks, objects, pictures.

mod objects;
pub(crate) mod pictures;
mod reference;
mod retired;
mod thumbnail;
mod tracks;
mod volume_copy;

pub(crate) use objects::ObjectsAtWork;
pub use objects::ObjectsRecord;
pub(crate) use reference::LidarAtWork;
pub use reference::{ErrorPictures, LidarRecord, Reference, evaluable};
pub use retired::KeptObject;
pub use thumbnail::portrait;
pub use tracks::{TrackRecord, TrackRow, state_name};
