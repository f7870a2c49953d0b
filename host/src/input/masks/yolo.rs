//! YOLO text: for each image `STEM.txt`, a row an object, coordinates as shares of width and
//! height: `class cx cy w h [score]`, a box; or `class x1 y1 x2 y2 x3 y3 ...`, a polygon. Names of
//! the classes are the lines of `classes.txt` in the folder or the one above it, else COCO's.

use super::boxes::{DetectedBox, DetectionSource, Detections};
use super::format::{MaskFormat, OpenedMasks, all_if_any, frames_of};
use super::shapes::Polygons;
use super::{Frames, class_of, coco_class, read_text};
use crate::input::source::{InputError, StereoImages};
use dynvox_core::tracking::Class;
use std::path::{Path, PathBuf};

/// YOLO text.
pub static FORMAT: MaskFormat = MaskFormat {
    name: "yolo",
    value: "DIR",
    summary: "",
    open: |path, dataset| {
        let (rows, there) = Yolo::open(path, frames_of(dataset))?;
        OpenedMasks::boxes(rows, all_if_any(there, dataset), dataset)
    },
};

/// A folder of YOLO text.
pub(super) struct Yolo {
    folder: PathBuf,
    frames: Frames,
    /// Classes of `classes.txt`, where there is one.
    classes: Option<Vec<Option<Class>>>,
}

impl Yolo {
    /// The folder, and how many of the frames it has objects for.
    pub fn open(folder: &Path, frames: Frames) -> Result<(Self, usize), InputError> {
        let there = frames.files(folder, "txt");
        let above = folder.parent().map(|above| above.join("classes.txt"));
        let named = [Some(folder.join("classes.txt")), above]
            .into_iter()
            .flatten()
            .find(|path| path.is_file());
        let text = named.map(|path| read_text(&path)).transpose()?.flatten();
        let classes = text.map(|text| text.lines().map(|name| class_of(name.trim())).collect());
        Ok((Self { folder: folder.to_path_buf(), frames, classes }, there))
    }

    /// Adds a row's object; `None` where it is not one.
    fn add(&self, row: &str, found: &mut Detections) -> Option<()> {
        let (class, rest) = row.split_once(char::is_whitespace)?;
        let number: usize = class.parse().ok()?;
        let class = self
            .classes
            .as_ref()
            .map_or_else(|| coco_class(number), |classes| classes.get(number).copied().flatten());
        let values: Option<Vec<f64>> = rest
            .split_whitespace()
            .map(|word| word.parse().ok().filter(|value: &f64| value.is_finite()))
            .collect();
        let (values, (width, height)) = (values?, self.frames.size);
        let (width_px, height_px) = (width as f64, height as f64);
        found.masks.refusals.unknown_class += u32::from(class.is_none());
        let class = class.unwrap_or_default();
        match values[..] {
            [u, v, w, h] | [u, v, w, h, _] => {
                let score = values.get(4).map_or(1.0, |score| *score as f32);
                let edges = [
                    (u - w / 2.0) * width_px,
                    (v - h / 2.0) * height_px,
                    (u + w / 2.0) * width_px,
                    (v + h / 2.0) * height_px,
                ];
                found.boxes.push(DetectedBox { class, score, edges });
            }
            ref corners if corners.len() >= 6 && corners.len().is_multiple_of(2) => {
                let polygon = [corners
                    .as_chunks::<2>()
                    .0
                    .iter()
                    .map(|[u, v]| [u * width_px, v * height_px])
                    .collect()];
                let polygon = Polygons::new(&polygon, self.frames.size);
                if found.masks.reserve(polygon.pixels.area() as usize) {
                    found.masks.push(polygon.mask(class, 1.0));
                }
            }
            _ => return None,
        }
        Some(())
    }
}

impl DetectionSource for Yolo {
    fn detections(&self, index: usize, _: &StereoImages) -> Result<Detections, InputError> {
        let mut found = Detections::default();
        let path = self.frames.stems.get(index).map(|stem| self.folder.join(format!("{stem}.txt")));
        // Programs that write YOLO text write no file for an image without objects.
        let Some((path, text)) =
            path.and_then(|path| read_text(&path).transpose().map(|text| (path, text)))
        else {
            return Ok(found);
        };
        for (line, row) in (1..).zip(text?.lines()).filter(|(_, row)| !row.trim().is_empty()) {
            self.add(row.trim(), &mut found).ok_or_else(|| {
                let formats = "`class cx cy w h [score]` nor `class x1 y1 x2 y2 x3 y3 ...`, in \
                               shares of the image's size";
                InputError::masks(&path, format!("line {line} is neither {formats}"))
            })?;
        }
        Ok(found)
    }
}
