//! YOLO text: for each image `STEM.txt`, a row an object, coordinates as shares of width and
//! height: `class cx cy w h`, a box; or `class x1 y1 x2 y2 x3 y3 ...`, a polygon; behind either
//! a score, the number of a track, or both, as Ultralytics writes them. Names of the classes are
//! the lines of `classes.txt` in the folder or the one above it, else COCO's.

mod row;

use super::boxes::{DetectedBox, DetectionSource, Detections};
use super::format::{MaskFormat, OpenedMasks, all_if_any, frames_of};
use super::shapes::Polygons;
use super::{Frames, class_of, coco_class, read_text};
use crate::input::source::{InputError, StereoImages};
use dynvox_core::tracking::Class;
use row::{Row, Shape};
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
    /// Rows end in a score and the number of a track.
    has_tracks: bool,
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
        let mut has_tracks = None;
        for stem in &frames.stems {
            let text = read_text(&folder.join(format!("{stem}.txt")))?;
            let one = text.as_deref().and_then(row::ends_in_tracks);
            has_tracks = one.map(|one| one && has_tracks != Some(false)).or(has_tracks);
        }
        let has_tracks = has_tracks.unwrap_or_default();
        Ok((Self { folder: folder.to_path_buf(), frames, classes, has_tracks }, there))
    }

    /// Adds a row's object.
    fn add(&self, row: Row, found: &mut Detections) {
        let class = self.classes.as_ref().map_or_else(
            || coco_class(row.class),
            |classes| classes.get(row.class).copied().flatten(),
        );
        found.masks.refusals.unknown_class += u32::from(class.is_none());
        let class = class.unwrap_or_default();
        let (width_px, height_px) = (self.frames.size.0 as f64, self.frames.size.1 as f64);
        match row.shape {
            Shape::Box([u, v, width, height]) => found.boxes.push(DetectedBox {
                class,
                score: row.score,
                edges: [
                    (u - width / 2.0) * width_px,
                    (v - height / 2.0) * height_px,
                    (u + width / 2.0) * width_px,
                    (v + height / 2.0) * height_px,
                ],
            }),
            Shape::Polygon(corners) => {
                let corners = corners.iter().map(|[u, v]| [u * width_px, v * height_px]).collect();
                let polygon = [corners];
                let polygon = Polygons::new(&polygon, self.frames.size);
                if found.masks.reserve(polygon.pixels.area() as usize) {
                    found.masks.push(polygon.mask(class, row.score));
                }
            }
        }
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
            let row = row::parse(row.trim(), self.has_tracks)
                .map_err(|reason| InputError::masks(&path, format!("line {line} {reason}")))?;
            self.add(row, &mut found);
        }
        Ok(found)
    }
}
