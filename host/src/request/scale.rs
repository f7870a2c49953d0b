//! The scale of a map: the lengths of its settings, by the rig or by name.

use dynvox_core::geometry::StereoRig;
use dynvox_core::{Config, Scale};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Choice of a map's lengths: voxel size, depth, truncation and what goes with them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SceneScale {
    /// By focal length, baseline and image size.
    #[default]
    Rig,
    /// A desk, within reach of a hand: voxels of 4 mm.
    Desk,
    /// A room: voxels of 2 cm.
    Room,
    /// A street: the defaults, voxels of 5 cm to a depth of 20 m.
    Street,
    /// Open land: voxels of 20 cm.
    Field,
}

/// Names on the command line.
const NAMES: [(&str, SceneScale); 5] = [
    ("rig", SceneScale::Rig),
    ("desk", SceneScale::Desk),
    ("room", SceneScale::Room),
    ("street", SceneScale::Street),
    ("field", SceneScale::Field),
];

impl SceneScale {
    /// The lengths for a rig whose rectified images are `width_px` wide.
    pub fn lengths(self, rig: &StereoRig, width_px: usize) -> Scale {
        match self {
            Self::Rig => Scale::for_rig(rig, width_px),
            Self::Desk => Scale::with_voxels(0.004, rig),
            Self::Room => Scale::with_voxels(0.02, rig),
            Self::Street => Scale::STREET,
            Self::Field => Scale::with_voxels(0.2, rig),
        }
    }
}

/// Value of `--scale`: a factor on the images' sides, or the name of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScaleWord {
    /// Factor of the images' sides, above 0 and up to 1.
    Images(f64),
    /// Lengths of the map.
    Scene(SceneScale),
}

impl FromStr for ScaleWord {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(factor) = text.parse() {
            return Ok(Self::Images(factor));
        }
        let found = NAMES.iter().find(|(name, _)| *name == text);
        found.map(|(_, scene)| Self::Scene(*scene)).ok_or_else(|| {
            let names = NAMES.map(|(name, _)| name).join(", ");
            format!(
                "`{text}` is no scale. Write a factor on the images' sides up to 1, or a scene: \
                 {names}"
            )
        })
    }
}

/// Depth from which on the matcher searches, m: what is nearer has a larger disparity.
pub fn searched_from_m(config: &Config) -> f64 {
    config.rig.focal_px * config.rig.baseline_m / f64::from(config.stereo.disparity_max)
}

/// The depths and the voxels of a map, as a sentence that begins with the baseline.
pub fn sentence(config: &Config) -> String {
    let (rig, volume) = (&config.rig, &config.volume);
    let near_m = f64::from(volume.near_m).max(searched_from_m(config));
    format!(
        "{} baseline: maps {} to {} in voxels of {}",
        length(rig.baseline_m),
        length(near_m),
        length(f64::from(volume.far_m)),
        length(f64::from(volume.voxel_size_m))
    )
}

/// A length to two or three digits, in the unit people would use.
fn length(m: f64) -> String {
    let (value, unit) = match m {
        m if m < 0.01 => (1000.0 * m, "mm"),
        m if m < 1.0 => (100.0 * m, "cm"),
        m => (m, "m"),
    };
    let text = format!("{value:.*}", usize::from(value < 10.0) + usize::from(value < 100.0));
    let digits =
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{digits} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sentence_says_baseline_depths_and_voxels() {
        let rig = StereoRig {
            focal_px: 754.7,
            center_u_px: 489.4,
            center_v_px: 265.2,
            baseline_m: 0.063,
        };
        let mut config = Config::for_rig(rig);
        SceneScale::Rig.lengths(&rig, 960).apply(&mut config);
        assert_eq!(sentence(&config), "6.3 cm baseline: maps 18.6 cm to 3.36 m in voxels of 4 mm");
        let car = StereoRig { focal_px: 718.9, baseline_m: 0.5372, ..rig };
        assert_eq!(
            sentence(&Config::for_rig(car)),
            "53.7 cm baseline: maps 1.51 m to 20 m in voxels of 5 cm"
        );
    }

    #[test]
    fn a_scale_is_a_factor_or_a_scene() {
        assert_eq!("0.5".parse(), Ok(ScaleWord::Images(0.5)));
        assert_eq!("room".parse(), Ok(ScaleWord::Scene(SceneScale::Room)));
        let refusal = "attic".parse::<ScaleWord>().unwrap_err();
        assert!(refusal.contains("`attic`") && refusal.contains("desk, room, street, field"));
    }
}
