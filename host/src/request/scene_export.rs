//! Export of a run for programs of photogrammetry and radiance fields.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::str::FromStr;

/// Format of an exported scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SceneFormat {
    /// COLMAP's text model: `sparse/0/{cameras,images,points3D}.txt`.
    Colmap,
    /// Nerfstudio's `transforms.json` and `points.ply`.
    Nerfstudio,
}

impl FromStr for SceneFormat {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "colmap" => Ok(Self::Colmap),
            "nerfstudio" => Ok(Self::Nerfstudio),
            _ => Err(format!("`{text}` is no format of --export: give colmap or nerfstudio")),
        }
    }
}

/// A scene that is to be exported.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneExport {
    /// Format.
    pub format: SceneFormat,
    /// New folder that it is written to.
    pub folder: PathBuf,
}

impl SceneExport {
    /// Reads the words of the option: a format and a folder; nothing of no words.
    ///
    /// # Errors
    /// They are something else. The text is a sentence.
    pub fn from_words(words: &[String]) -> Result<Option<Self>, String> {
        match words {
            [] => Ok(None),
            [format, folder] => {
                Ok(Some(Self { format: format.parse()?, folder: PathBuf::from(folder) }))
            }
            _ => Err("--export takes a format and a folder: `--export colmap DIR`".to_owned()),
        }
    }
}
