//! Pictures of some frames and of the finished map as files, for the viewer: a fixed number,
//! however long the run.

use super::{
    EndContext, Finished, FrameContext, ObserveError, ObservedRun, Observer, frame_pictures::Shown,
    pictures, spread,
};
use crate::owned;
use crate::scene::{OVERVIEW, PICTURES_FOLDER, PICTURES_INDEX, PictureIndex, PictureKind};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Frames with pictures, at most.
const FRAMES: usize = 40;

/// Writes pictures. What the disk refuses ends it, and the run goes on without them.
#[derive(Debug, Serialize, Deserialize)]
pub struct GalleryObserver {
    /// Position and number of the frames that have pictures.
    taken: Vec<(usize, usize)>,
    /// Interval of pictures for a stream, whose end is unknown: one every so many frames.
    every: usize,
    failure: Option<String>,
}

impl Default for GalleryObserver {
    fn default() -> Self {
        Self { taken: Vec::new(), every: 1, failure: None }
    }
}

impl Observer for GalleryObserver {
    /// Reason why the pictures could not be written, if so.
    type Section = Option<String>;

    /// Removes pictures of frames after the checkpoint: they will be taken again.
    fn resume(&mut self, run: &ObservedRun<'_>) -> Result<(), ObserveError> {
        let folder = folder(run);
        let failed = |source| ObserveError::Write { path: folder.clone(), source };
        if !folder.is_dir() {
            return Ok(());
        }
        // Pictures noted at the checkpoint stay.
        let known: Vec<String> = self
            .taken
            .iter()
            .flat_map(|(_, frame)| PictureKind::ALL.map(|kind| kind.file(*frame)))
            .collect();
        for entry in folder.read_dir().map_err(failed)? {
            let entry = entry.map_err(failed)?;
            if !known.iter().any(|name| entry.file_name() == name.as_str()) {
                owned::remove_own(&entry.path()).map_err(failed)?;
            }
        }
        // An empty folder would show a gallery without pictures.
        if self.taken.is_empty() { owned::remove_folder(&folder).map_err(failed) } else { Ok(()) }
    }

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let position = frame.position;
        // Without a known number of frames every n-th is taken, and thinned out as they become
        // many.
        let chosen = run.plan.frames.count().map_or_else(
            || position.is_multiple_of(self.every),
            |frames| spread(frames, FRAMES)(position),
        );
        // A failure is reported once, at the end: pictures do not end a run.
        if chosen && self.failure.is_none() {
            self.taken.push((position, frame.row.frame));
            self.failure = write_frame(&folder(run), frame).err().map(|error| error.to_string());
            self.thin_out(&folder(run));
        }
        Ok(())
    }

    fn end(
        &mut self,
        run: &ObservedRun<'_>,
        end: &mut EndContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        // A run without frames, or whose disk refused, has no index.
        if end.last.is_none() || self.failure.is_some() {
            return Ok(());
        }
        let (width, height) = run.plan.dataset.size();
        let index = PictureIndex {
            width,
            height,
            frames: self.taken.iter().map(|(_, frame)| *frame).collect(),
        };
        let overview = &end.overview_jpeg;
        let written =
            if overview.is_empty() { Ok(()) } else { write(&folder(run).join(OVERVIEW), overview) };
        let index = serde_json::to_vec(&index).unwrap_or_default();
        self.failure = written
            .and_then(|()| write(&folder(run).join(PICTURES_INDEX), &index))
            .err()
            .map(|error| error.to_string());
        Ok(())
    }

    fn finish(self, _: &ObservedRun<'_>, _: &Finished) -> Result<Option<String>, ObserveError> {
        Ok(self.failure)
    }
}

impl GalleryObserver {
    /// Returns the reason why pictures could not be written, if so.
    pub fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// Removes every second picture of a stream when there are too many.
    fn thin_out(&mut self, folder: &Path) {
        if self.taken.len() <= FRAMES {
            return;
        }
        self.every *= 2;
        let every = self.every;
        self.taken.retain(|&(position, frame)| {
            let stays = position.is_multiple_of(every);
            if !stays {
                // One that stays behind is not in the list of pictures.
                PictureKind::ALL
                    .iter()
                    .for_each(|kind| drop(owned::remove_file(&folder.join(kind.file(frame)))));
            }
            stays
        });
    }
}

fn folder(run: &ObservedRun<'_>) -> PathBuf {
    run.folder.join(PICTURES_FOLDER)
}

/// Writes the pictures of a frame. One that cannot be made leaves no file.
fn write_frame(folder: &Path, frame: &mut FrameContext<'_, '_>) -> Result<(), ObserveError> {
    owned::create_folder(folder)
        .map_err(|source| ObserveError::Write { path: folder.to_path_buf(), source })?;
    let disparity_q8 = frame.view.mapper().disparity_q8();
    let masks = pictures::masks(frame.view.mapper(), disparity_q8.width(), disparity_q8.height());
    let composed = frame.jpeg(Shown::Composed);
    // Without objects the composed picture is empty, and the map's own is shown.
    let map = if composed.is_empty() { frame.jpeg(Shown::Map) } else { composed };
    let (left, disparity) = (frame.jpeg(Shown::Left), frame.jpeg(Shown::Disparity));
    let number = frame.row.frame;
    for (kind, picture) in PictureKind::ALL.into_iter().zip([left, masks, disparity, map]) {
        if !picture.is_empty() {
            write(&folder.join(kind.file(number)), &picture)?;
        }
    }
    Ok(())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), ObserveError> {
    owned::write(path, bytes)
        .map_err(|source| ObserveError::Write { path: path.to_path_buf(), source })
}
