//! What the shapes of a network cannot tell: `MODEL.toml` beside `MODEL.onnx`.

use super::model::InputValues;
use crate::formats::bounds::SETTINGS_TEXT;
use crate::formats::{FormatError, read_text_within};
use crate::input::masks::{class_of, coco_class};
use crate::input::source::InputError;
use dynvox_core::tracking::{Class, Treatment};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Tiles of a picture at most.
const MAX_TILES: usize = 16;
/// Cityscapes' classes in the order of its networks.
const CITYSCAPES: [&str; 19] = [
    "road",
    "sidewalk",
    "building",
    "wall",
    "fence",
    "pole",
    "traffic light",
    "traffic sign",
    "vegetation",
    "terrain",
    "sky",
    "person",
    "rider",
    "car",
    "truck",
    "bus",
    "train",
    "motorcycle",
    "bicycle",
];

/// Order of a picture's three channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Channels {
    /// Red first.
    Rgb,
    /// Blue first.
    Bgr,
}

/// The settings of a network; each has a default that suits the layout.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// The network, where this file is given in its stead; relative to this file.
    pub model: Option<PathBuf>,
    /// Size of the input, px, where the network leaves it open.
    pub width: Option<usize>,
    /// See `width`.
    pub height: Option<usize>,
    /// Order of the channels; BGR for boxes that are not decoded, else RGB.
    pub channels: Option<Channels>,
    /// Taken off each value of 0 to 255, by channel in the order of the input; 0.
    pub mean: Option<[f32; 3]>,
    /// Multiplies the difference; 1 for boxes that are not decoded, else 1/255.
    pub scale: Option<[f32; 3]>,
    /// True if the picture is stretched to the input; otherwise its sides keep their ratio and the
    /// rest is grey.
    pub fill: Option<bool>,
    /// True if boxes of YOLOX's shape are decoded already; default false.
    pub decoded: bool,
    /// Names of the classes in the network's order; COCO's 80 or Cityscapes' 19 otherwise.
    pub names: Option<Vec<String>>,
    /// Names of the classes to keep; those of all that may move otherwise.
    pub keep: Option<Vec<String>>,
    /// Least score; 0.3.
    pub score_min: f32,
    /// Tiles side by side that a wide picture is divided into, besides the whole; 2 where it is 1.5
    /// times as wide as the input's shape, 0 for none.
    pub tiles: Option<usize>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            model: None,
            width: None,
            height: None,
            channels: None,
            mean: None,
            scale: None,
            fill: None,
            decoded: false,
            names: None,
            keep: None,
            score_min: 0.3,
            tiles: None,
        }
    }
}

impl Settings {
    /// The path of a network and its settings; `path` is that of the network, or of its settings.
    ///
    /// # Errors
    /// A file is missing, or the settings are not such.
    pub fn beside(path: &Path) -> Result<(PathBuf, Self), InputError> {
        let is_settings = path.extension().is_some_and(|ending| ending == "toml");
        let file = if is_settings { path.to_path_buf() } else { path.with_extension("toml") };
        let settings = if is_settings || file.is_file() {
            toml::from_str(&read_text_within(&file, &SETTINGS_TEXT)?).map_err(|error| {
                InputError::from(FormatError::content(
                    &file,
                    error.message().to_owned(),
                    "docs/inputs.md lists the keys of a network's settings",
                ))
            })?
        } else {
            Self::default()
        };
        settings.check().map_err(|reason| {
            let action = "docs/inputs.md lists the keys of a network's settings";
            InputError::from(FormatError::content(&file, reason, action))
        })?;
        let given = if is_settings {
            settings.model.as_ref().map(|model| file.with_file_name("").join(model))
        } else {
            Some(path.to_path_buf())
        };
        match given {
            Some(path) if path.is_file() => Ok((path, settings)),
            Some(path) => Err(InputError::network(&path, "there is no such file".to_owned())),
            None => Err(InputError::network(
                &file,
                "it does not name its network: add model = \"FILE.onnx\"".to_owned(),
            )),
        }
    }

    /// Refuses values that leave nothing to be found.
    fn check(&self) -> Result<(), String> {
        if !(0.0..=1.0).contains(&self.score_min) {
            return Err(format!("score_min = {} is not within 0 and 1", self.score_min));
        }
        let numbers = self.mean.iter().chain(&self.scale).flatten();
        if numbers.into_iter().any(|number| !number.is_finite()) {
            return Err("mean or scale is not a finite number".to_owned());
        }
        if self.scale.is_some_and(|scale| scale.contains(&0.0)) {
            return Err("a scale of 0 makes every picture black".to_owned());
        }
        if self.tiles.is_some_and(|tiles| tiles > MAX_TILES) {
            return Err(format!("there are at most {MAX_TILES} tiles"));
        }
        let named = |kept: &String| self.names.iter().flatten().any(|name| name == kept);
        for kept in self.keep.iter().flatten() {
            if class_of(kept).is_none() && !named(kept) {
                return Err(format!("`keep` names {}", self.unknown(kept)));
            }
        }
        Ok(())
    }

    /// An unknown name, with the known one that is nearest to it.
    fn unknown(&self, name: &str) -> String {
        let classes = Class::ALL.iter().map(|class| class.name());
        let known = classes.chain(self.names.iter().flatten().map(String::as_str));
        let nearest = known
            .filter(|known| *known != name)
            .min_by_key(|known| strsim::damerau_levenshtein(known, name))
            .unwrap_or_default();
        format!("`{name}`, which is no class; the nearest that is known is `{nearest}`")
    }

    /// Returns the class of each of so many outputs; `None` for those that are not kept. Without a
    /// number, as for a map of integers, there are as many as are named.
    ///
    /// # Errors
    /// The number of classes has no list that is known, or no class is kept.
    pub fn classes(&self, count: Option<usize>) -> Result<Vec<Option<Class>>, String> {
        let classes = self.all_classes(count)?;
        if classes.iter().any(Option::is_some) {
            return Ok(classes);
        }
        let first = self.names.iter().flatten().find(|name| class_of(name).is_none());
        let why =
            first.map_or_else(String::new, |name| format!(": `names` has {}", self.unknown(name)));
        Err(format!(
            "none of its classes is kept, and nothing would be found{why}. Correct its settings"
        ))
    }

    fn all_classes(&self, count: Option<usize>) -> Result<Vec<Option<Class>>, String> {
        let named = |name: &str| self.kept(name, class_of(name));
        match (&self.names, count) {
            (Some(names), Some(count)) if names.len() != count => Err(format!(
                "its settings name {} classes, but it has {count}: correct `names`",
                names.len()
            )),
            (Some(names), _) => Ok(names.iter().map(|name| named(name)).collect()),
            (None, None | Some(19)) => Ok(CITYSCAPES.iter().map(|name| named(name)).collect()),
            (None, Some(80)) => Ok((0..80).map(|index| self.kept("", coco_class(index))).collect()),
            (None, Some(count)) => Err(format!(
                "it has {count} classes, neither COCO's 80 nor Cityscapes' 19. Name them in the \
                 file of its settings: names = [\"car\", ...]"
            )),
        }
    }

    /// The values of an input that takes bytes or not; `in_grid`: of a network that gives boxes in
    /// the cells of its grids.
    pub fn values(&self, bytes: bool, in_grid: bool) -> InputValues {
        let channels = self.channels.unwrap_or(if in_grid { Channels::Bgr } else { Channels::Rgb });
        InputValues {
            blue_first: channels == Channels::Bgr,
            mean: self.mean.unwrap_or_default(),
            scale: self.scale.unwrap_or(if bytes || in_grid { [1.0; 3] } else { [1.0 / 255.0; 3] }),
        }
    }

    fn kept(&self, name: &str, class: Option<Class>) -> Option<Class> {
        let is_kept = |class: &Class| match &self.keep {
            Some(keep) => keep.iter().any(|kept| kept == name || kept == class.name()),
            None => class.treatment() != Treatment::Ignore,
        };
        class.filter(is_kept)
    }
}
