//! COCO JSON: a file of annotations (`images`, `annotations`, `categories`) or a list of results
//! (`image_id`, `category_id`, `score`). An object has a `segmentation`, polygons or run lengths,
//! or a `bbox` alone.

use super::boxes::{DetectedBox, DetectionSource, Detections};
use super::coco_values::{Counts, ImageId, Segmentation};
use super::format::{MaskFormat, OpenedMasks, frames_of};
use super::shapes::{Polygons, around_runs, mask_of_runs};
use super::{Frames, class_of, coco_class};
use crate::formats::bounds::{MAX_COCO_BYTES, TABLE_TEXT, TextBound};
use crate::formats::{FormatError, read_text_within, rle};
use crate::input::source::{InputError, InstanceMask, StereoImages};
use dynvox_core::tracking::Class;
use serde::Deserialize;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// Numbers of COCO's categories that no object has.
const UNUSED: [u64; 11] = [12, 26, 29, 30, 45, 66, 68, 69, 71, 83, 91];

/// COCO JSON.
pub static FORMAT: MaskFormat = MaskFormat {
    name: "coco",
    value: "FILE",
    summary: "",
    open: |path, dataset| {
        let (objects, there) = Coco::open(path, frames_of(dataset))?;
        OpenedMasks::boxes(objects, there, dataset)
    },
};

/// A file of annotations.
#[derive(Deserialize)]
struct Annotations {
    images: Vec<ImageEntry>,
    annotations: Vec<Object>,
    categories: Vec<Category>,
}

/// A file of either kind, told by its first sign: trying both would hold the file a second time, in
/// values.
enum File {
    Annotations(Annotations),
    Results(Vec<Object>),
}

impl File {
    fn from_text(text: &str) -> serde_json::Result<Self> {
        if text.trim_start().starts_with('[') {
            serde_json::from_str(text).map(Self::Results)
        } else {
            serde_json::from_str(text).map(Self::Annotations)
        }
    }
}

#[derive(Deserialize)]
struct ImageEntry {
    id: u64,
    file_name: String,
}

#[derive(Deserialize)]
struct Category {
    id: u64,
    name: String,
}

/// An object of an image.
#[derive(Deserialize)]
struct Object {
    image_id: ImageId,
    category_id: u64,
    score: Option<f32>,
    bbox: Option<[f64; 4]>,
    segmentation: Option<Segmentation>,
    #[serde(default)]
    iscrowd: u8,
}

/// A file of COCO JSON.
pub(super) struct Coco {
    path: PathBuf,
    frames: Frames,
    /// Objects by their image's name without ending.
    objects: BTreeMap<String, Vec<Object>>,
    /// Classes of the file's categories; COCO's own where it has none.
    classes: Option<HashMap<u64, Option<Class>>>,
}

impl Coco {
    /// Reads the file, and tells how many of the frames it names.
    pub fn open(path: &Path, frames: Frames) -> Result<(Self, usize), InputError> {
        let bound = TextBound {
            what: "COCO's JSON",
            bytes: MAX_COCO_BYTES,
            line_bytes: MAX_COCO_BYTES as usize,
            ..TABLE_TEXT
        };
        let file = File::from_text(&read_text_within(path, &bound)?).map_err(|error| {
            let reason =
                format!("it is neither COCO's annotations nor a list of results ({error})");
            InputError::masks_format(FormatError::content(path, reason, ""))
        })?;
        let (images, list, classes) = match file {
            File::Annotations(Annotations { images, annotations, categories }) => (
                images,
                annotations,
                Some(categories.into_iter().map(|one| (one.id, class_of(&one.name))).collect()),
            ),
            File::Results(results) => (Vec::new(), results, None),
        };
        let stems: HashMap<u64, String> =
            images.into_iter().map(|image| (image.id, stem(&image.file_name))).collect();
        let numbers: HashMap<usize, &String> = (0..frames.stems.len())
            .map(|index| (frames.number(index), &frames.stems[index]))
            .collect();
        let mut objects = BTreeMap::<String, Vec<Object>>::new();
        for object in list {
            let image = match &object.image_id {
                ImageId::Name(name) => Some(stem(name)),
                ImageId::Number(id) if stems.is_empty() => {
                    numbers.get(&(*id as usize)).map(|stem| (*stem).clone())
                }
                ImageId::Number(id) => stems.get(id).cloned(),
            };
            objects.entry(image.unwrap_or_default()).or_default().push(object);
        }
        // An image without objects is one in which nothing is seen.
        let there = frames
            .stems
            .iter()
            .filter(|name| {
                objects.contains_key(*name) || stems.values().any(|known| known == *name)
            })
            .count();
        let there = if stems.is_empty() && there > 0 { frames.stems.len() } else { there };
        Ok((Self { path: path.to_path_buf(), frames, objects, classes }, there))
    }

    fn add(&self, object: &Object, found: &mut Detections) -> Result<(), String> {
        let id = object.category_id;
        let class = self
            .classes
            .as_ref()
            .map_or_else(|| coco_category(id), |classes| classes.get(&id).copied().flatten());
        found.masks.refusals.unknown_class += u32::from(class.is_none());
        let (class, score) = (class.unwrap_or_default(), object.score.unwrap_or(1.0));
        match (&object.segmentation, object.bbox) {
            (Some(Segmentation::Runs { size, counts }), _) => {
                self.add_runs(class, score, *size, counts, found)?
            }
            (Some(Segmentation::Polygons(polygons)), _) if !polygons.is_empty() => {
                let corners = |polygon: &Vec<f64>| polygon.as_chunks::<2>().0.to_vec();
                let polygons: Vec<Vec<[f64; 2]>> = polygons.iter().map(corners).collect();
                let polygons = Polygons::new(&polygons, self.frames.size);
                if found.masks.reserve(polygons.pixels.area() as usize) {
                    found.masks.push(polygons.mask(class, score));
                }
            }
            (_, Some([left, top, width, height])) => {
                found.boxes.push(DetectedBox {
                    class,
                    score,
                    edges: [left, top, left + width, top + height],
                });
            }
            _ => found.masks.refusals.empty += 1,
        }
        Ok(())
    }

    fn add_runs(
        &self,
        class: Class,
        score: f32,
        size: [usize; 2],
        counts: &Counts,
        found: &mut Detections,
    ) -> Result<(), String> {
        let (width, height) = self.frames.size;
        if size != [height, width] {
            let [found_height, found_width] = size;
            return Err(format!(
                "a mask is {found_width} x {found_height} px, but the images are {width} x \
                 {height} px"
            ));
        }
        let runs = match counts {
            Counts::Text(text) => rle::runs(text, width, height)?,
            Counts::Numbers(counts) => rle::runs_of_counts(counts, width, height)?,
        };
        let mask = |pixels| -> Option<InstanceMask> {
            Some(mask_of_runs(class, score, pixels, &runs, height))
        };
        match around_runs(&runs, height) {
            None => found.masks.push(None),
            Some(pixels) if found.masks.reserve(pixels.area() as usize) => {
                found.masks.push(mask(pixels))
            }
            Some(_) => {}
        }
        Ok(())
    }
}

impl DetectionSource for Coco {
    fn detections(&self, index: usize, _: &StereoImages) -> Result<Detections, InputError> {
        let mut found = Detections::default();
        let objects = self.frames.stems.get(index).and_then(|stem| self.objects.get(stem));
        // A crowd is no instance.
        for object in objects.into_iter().flatten().filter(|object| object.iscrowd == 0) {
            self.add(object, &mut found).map_err(|reason| InputError::masks(&self.path, reason))?;
        }
        Ok(found)
    }
}

/// A file's name without folders and ending.
fn stem(name: &str) -> String {
    Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The class of COCO's own categories: 1 to 90, some of them unused.
fn coco_category(id: u64) -> Option<Class> {
    let unused = UNUSED.iter().filter(|unused| **unused < id).count();
    coco_class((id as usize).checked_sub(1 + unused)?).filter(|_| !UNUSED.contains(&id))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cocos_categories_have_their_numbers() {
        let named = [
            (1, Class::Person),
            (3, Class::Car),
            (8, Class::Truck),
            (13, Class::Other),
            (16, Class::Animal),
            (25, Class::Animal),
            (90, Class::Other),
        ];
        assert!(named.iter().all(|(id, class)| coco_category(*id) == Some(*class)));
        assert!([0, 12, 26, 91, 200].iter().all(|id| coco_category(*id).is_none()));
    }
}
