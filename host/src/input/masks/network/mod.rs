//! Networks of ONNX files: their boxes, masks and semantic maps become the
//! masks of a frame.
//!
//! What a network's outputs mean is told from their shapes, never from their names (`layout`); what
//! shapes cannot tell stands in a TOML file beside the model (`settings`). Several networks may be
//! given: boxes of one and the semantic map of another name the same objects, and are combined
//! where boxes are made masks.
//!
//! A network runs while frames are read ahead, beside the mapper, on one thread: with two it
//! computes other bits. Memory and time: a process of its own has bounds (`worker`); here are an
//! input and its outputs at a time. A picture takes 50 to 100 ms with the small networks this is
//! meant for, and boxes in wide images three times that, with two tiles.

mod arrays;
mod boxes;
mod end_to_end;
mod layout;
mod model;
mod picture;
mod protocol;
mod prototypes;
mod runtime;
mod semantic;
mod settings;
#[cfg(test)]
mod tests;
mod worker;

pub use worker::{run_networks_in, serve};

use super::boxes::{DetectedBox, DetectionSource, Detections};
use crate::formats::Image;
use crate::input::source::{InputError, StereoImages, StopRequest};
use dynvox_core::tracking::Class;
use layout::Layout;
use model::{Input, InputValues, Model, Output};
use picture::{Fit, Picture};
use settings::Settings;
use std::path::{Path, PathBuf};

/// Boxes of a tile that come so close to its cut edge are left to the picture or the next tile, px.
const TILE_MARGIN_PX: f64 = 4.0;

/// A network, with what its input and outputs mean.
struct Network {
    path: PathBuf,
    model: Model,
    settings: Settings,
    layout: Layout,
    /// Form of the input's values.
    values: InputValues,
    /// Classes of the network; `None` for those that are not kept.
    classes: Vec<Option<Class>>,
}

/// The part of a picture that an input shows, and what its classes are.
struct PicturePart<'a> {
    fit: &'a Fit,
    /// Size of the input, px.
    input: (usize, usize),
    /// Size of the picture, px.
    picture: (usize, usize),
    /// Classes of the network; `None` for those that are not kept.
    classes: &'a [Option<Class>],
    settings: &'a Settings,
}

impl PicturePart<'_> {
    /// Left, top, right and bottom edge in the picture of those in the input.
    fn edges(&self, [left, top, right, bottom]: [f64; 4]) -> [f64; 4] {
        let ([left, top], [right, bottom]) =
            (self.fit.picture_point([left, top]), self.fit.picture_point([right, bottom]));
        [left, top, right, bottom]
    }
}

/// Networks that run on each frame.
pub(super) struct Networks(Vec<Network>);

impl Networks {
    /// Loads the networks.
    ///
    /// # Errors
    /// A file is missing, is not a network that the runtime takes, has an input that is not one
    /// picture, or meets a bound of memory or time.
    pub fn open(paths: &[PathBuf], stop: &StopRequest) -> Result<Self, InputError> {
        paths.iter().map(|path| Network::open(path, stop)).collect::<Result<_, _>>().map(Self)
    }
}

impl DetectionSource for Networks {
    fn detections(&self, _: usize, images: &StereoImages) -> Result<Detections, InputError> {
        let mut found = Detections::default();
        let picture = Picture::of(images);
        for network in &self.0 {
            network.run(&picture, &mut found)?;
        }
        found.boxes = without_doubles(found.boxes);
        Ok(found)
    }
}

impl Network {
    /// Loads a network and runs it on a grey picture: what its outputs are is known before the
    /// first frame.
    fn open(path: &Path, stop: &StopRequest) -> Result<Self, InputError> {
        let (path, settings) = Settings::beside(path)?;
        let refused = |reason: String| InputError::network(&path, reason);
        let model = Model::open(&path, &settings, stop).map_err(refused)?;
        let Input { size, bytes, .. } = model.input();
        let grey = Image::new(size.0, size.1, vec![0; size.0 * size.1])
            .ok_or_else(|| refused("its input is empty".to_owned()))?;
        let fit = Fit::new([0, 0, size.0, size.1], size, true);
        let outputs = model
            .run(&Picture::Grey(&grey), &fit, &settings.values(bytes, false))
            .and_then(numbers)
            .map_err(refused)?;
        let layout = Layout::of(&outputs, size, &settings).map_err(refused)?;
        let classes = settings.classes(layout.class_count(&outputs)).map_err(refused)?;
        let values = settings.values(bytes, layout.is_in_grid());
        Ok(Self { layout, values, classes, model, settings, path: path.clone() })
    }

    /// Runs it on the picture, and on tiles of one that is much wider than the input where small
    /// boxes would be lost.
    fn run(&self, picture: &Picture<'_>, found: &mut Detections) -> Result<(), InputError> {
        let (width, height) = picture.size();
        self.add(picture, [0, 0, width, height], found)?;
        if !self.layout.is_boxes() {
            return Ok(());
        }
        for tile in picture::tiles((width, height), self.model.input().size, self.settings.tiles) {
            let mut of_tile = Detections::default();
            self.add(picture, tile, &mut of_tile)?;
            // An object that a tile cuts is whole in the picture, or in the next tile.
            let (left, right) = (tile[0] as f64, (tile[0] + tile[2]) as f64);
            let is_whole = |one: &DetectedBox| {
                (tile[0] == 0 || one.edges[0] > left + TILE_MARGIN_PX)
                    && (right >= width as f64 || one.edges[2] < right - TILE_MARGIN_PX)
            };
            found.boxes.extend(of_tile.boxes.into_iter().filter(is_whole));
        }
        Ok(())
    }

    /// Runs it on a part of the picture (left, top, width, height) and adds what it finds.
    fn add(
        &self,
        picture: &Picture<'_>,
        part: [usize; 4],
        found: &mut Detections,
    ) -> Result<(), InputError> {
        let refused = |reason: String| InputError::network(&self.path, reason);
        let input = self.model.input().size;
        let fill = self.settings.fill.unwrap_or(self.layout == Layout::Semantic);
        let fit = &Fit::new(part, input, fill);
        let outputs =
            self.model.run(picture, fit, &self.values).and_then(numbers).map_err(refused)?;
        if Layout::of(&outputs, input, &self.settings) != Ok(self.layout) {
            return Err(refused(
                "its outputs change their shapes from picture to picture. Export it \
                                with fixed shapes"
                    .to_owned(),
            ));
        }
        let part = PicturePart {
            fit,
            input,
            picture: picture.size(),
            classes: &self.classes,
            settings: &self.settings,
        };
        match &self.layout {
            Layout::Boxes(format) => found
                .boxes
                .extend(boxes::rows(&outputs[format.output], format, &part).map(|(_, one)| one)),
            Layout::Semantic => found.regions = semantic::decode(&outputs[0], &part),
            Layout::Prototypes(format) => {
                prototypes::decode(&outputs, format, &part, &mut found.masks)
            }
            Layout::EndToEnd(format) => end_to_end::decode(&outputs, format, &part, found),
        }
        Ok(())
    }
}

/// Outputs without a value that is no number: comparisons with one would be false, and nothing be
/// found.
fn numbers(outputs: Vec<Output>) -> Result<Vec<Output>, String> {
    match outputs.iter().position(|output| output.values.iter().any(|value| value.is_nan())) {
        None => Ok(outputs),
        Some(at) => Err(format!(
            "its output {at} holds values that are no numbers (nan). Export it anew, or check its \
             input's mean and scale"
        )),
    }
}

/// Boxes without those that overlap a better one of a class that can be the same: non-maximum
/// suppression.
fn without_doubles(mut boxes: Vec<DetectedBox>) -> Vec<DetectedBox> {
    /// Overlap from which on two boxes are one object's.
    const MAX_OVERLAP: f64 = 0.45;
    // A stable order: the same boxes stay from run to run.
    boxes.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<DetectedBox> = Vec::new();
    for one in boxes {
        if kept.iter().all(|better| {
            !better.class.agrees_with(one.class) || overlap(better, &one) < MAX_OVERLAP
        }) {
            kept.push(one);
        }
    }
    kept
}

/// Intersection over union.
fn overlap(a: &DetectedBox, b: &DetectedBox) -> f64 {
    let area =
        |[left, top, right, bottom]: [f64; 4]| (right - left).max(0.0) * (bottom - top).max(0.0);
    let ([left, top, right, bottom], [left_b, top_b, right_b, bottom_b]) = (a.edges, b.edges);
    let both = area([left.max(left_b), top.max(top_b), right.min(right_b), bottom.min(bottom_b)]);
    both / (area(a.edges) + area(b.edges) - both).max(f64::MIN_POSITIVE)
}
