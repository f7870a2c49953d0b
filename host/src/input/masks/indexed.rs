//! Instance PNGs: `NNNNNN.png`, 8 or 16 bit grey, 0 nothing, k instance k of this frame; beside it
//! `NNNNNN.txt`, one row an instance: `id class score x1 y1 x2 y2`. Lines that begin with `#` are
//! comments. The box is read but that of the mask is used.

use super::format::{MaskFormat, OpenedMasks, frames_of};
use super::{Frames, MaskSource, class_of, read_labels, read_text};
use crate::input::source::{FrameMasks, InputError, StereoImages, bounding_boxes};
use dynvox_core::tracking::Class;
use std::path::{Path, PathBuf};

/// Instance PNGs with lists.
pub static FORMAT: MaskFormat = MaskFormat {
    name: "files",
    value: "DIR",
    summary: "PNG and list",
    open: |path, dataset| {
        let (masks, there) = Indexed::open(path, frames_of(dataset));
        Ok(OpenedMasks::masks(masks, there))
    },
};

/// A folder of instance PNGs.
pub(super) struct Indexed {
    folder: PathBuf,
    frames: Frames,
}

impl Indexed {
    /// The folder, and how many of the frames it has masks for.
    pub fn open(folder: &Path, frames: Frames) -> (Self, usize) {
        let there = frames.files(folder, "png");
        (Self { folder: folder.to_path_buf(), frames }, there)
    }
}

impl MaskSource for Indexed {
    fn masks(&self, index: usize, _: &StereoImages) -> Result<FrameMasks, InputError> {
        let Some(stem) = self.frames.stems.get(index) else { return Ok(FrameMasks::missing()) };
        let path = self.folder.join(format!("{stem}.png"));
        if !path.is_file() {
            return Ok(FrameMasks::missing());
        }
        let labels = read_labels(&path, self.frames.size)?;
        let list = self.folder.join(format!("{stem}.txt"));
        let text = read_text(&list)?.ok_or_else(|| {
            InputError::masks(&path, format!("its list {} is missing", list.display()))
        })?;
        let mut masks = FrameMasks::default();
        let boxes = bounding_boxes(&labels);
        let rows = rows(&text, &mut masks).map_err(|reason| InputError::masks(&list, reason))?;
        masks.refusals.unnamed =
            boxes.keys().filter(|label| rows.iter().all(|(id, ..)| id != *label)).count() as u32;
        masks.extract(&labels, &boxes, rows);
        Ok(masks)
    }
}

/// The rows of a list: id, class, score.
fn rows(text: &str, masks: &mut FrameMasks) -> Result<Vec<(u16, Class, f32)>, String> {
    let mut rows: Vec<(u16, Class, f32)> = Vec::new();
    for (line, row) in (1..)
        .zip(text.lines())
        .filter(|(_, row)| !row.trim().is_empty() && !row.trim_start().starts_with('#'))
    {
        let (id, name, score) =
            parse(row).ok_or_else(|| format!("line {line} is not `id class score x1 y1 x2 y2`"))?;
        if rows.iter().any(|(known, ..)| *known == id) {
            return Err(format!("line {line} names instance {id} a second time"));
        }
        let class = class_of(&name);
        masks.refusals.unknown_class += u32::from(class.is_none());
        rows.push((id, class.unwrap_or_default(), score));
    }
    Ok(rows)
}

/// A name may have spaces: score and box are the last five words.
fn parse(row: &str) -> Option<(u16, String, f32)> {
    let words: Vec<&str> = row.split_whitespace().collect();
    let (id, rest) = words.split_first()?;
    let name_words = rest.len().checked_sub(5).filter(|&count| count > 0)?;
    let (name, numbers) = rest.split_at(name_words);
    let numbers: Option<Vec<f32>> = numbers.iter().map(|word| word.parse().ok()).collect();
    Some((id.parse().ok().filter(|&id| id > 0)?, name.join(" "), *numbers?.first()?))
}
