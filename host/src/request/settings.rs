//! Settings: defaults, then the file of `--config`, then each `--set key=value`. Unknown keys are
//! errors that name the key.

use crate::formats::bounds::SETTINGS_TEXT;
use crate::formats::calibration::RectifiedSize;
use crate::formats::read_text_within;
use crate::synth::{RoomConfig, StreetConfig, TownConfig};
use anyhow::{Context, bail};
use dynvox_core::MapperConfig;
use dynvox_core::egomotion::EgomotionConfig;
use dynvox_core::egomotion::icp::IcpConfig;
use dynvox_core::geometry::StereoRig;
use dynvox_core::objects::ObjectsConfig;
use dynvox_core::planning::PlanningConfig;
use dynvox_core::rectify::{Rectification, self_calibration::RigConfig};
use dynvox_core::scene_flow::SceneFlowConfig;
use dynvox_core::segmentation::SegmentationConfig;
use dynvox_core::settings::constant;
use dynvox_core::stereo::StereoConfig;
use dynvox_core::tracking::TrackingConfig;
use dynvox_core::view::{MeshConfig, RaycastConfig};
use dynvox_core::volume::VolumeConfig;
use dynvox_core::{Capacity, Config, Scale};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;
use toml::{Table, Value};

/// Everything that can be configured, in the sections of the file. The rig's calibration is not
/// among it: it comes with the data set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Corrections of the rig.
    pub rig: RigConfig,
    /// Size that raw pairs are rectified to.
    pub rectify: RectifiedSize,
    /// Stereo matching.
    pub stereo: StereoConfig,
    /// Matches from frame to frame.
    pub scene_flow: SceneFlowConfig,
    /// Motion of the camera from matches.
    pub egomotion: EgomotionConfig,
    /// Motion of the camera from depth against the map.
    pub icp: IcpConfig,
    /// Stages of the mapper.
    pub mapper: MapperConfig,
    /// Tracking of objects.
    pub tracking: TrackingConfig,
    /// Moving objects that no detector found.
    pub segmentation: SegmentationConfig,
    /// Reconstruction of objects.
    pub objects: ObjectsConfig,
    /// Static map.
    pub volume: VolumeConfig,
    /// Raycasts of the map.
    pub raycast: RaycastConfig,
    /// Mesh of the map.
    pub mesh: MeshConfig,
    /// Window of the planner.
    pub planning: PlanningConfig,
    /// The synthetic street; absent where it has its defaults, and from the file of a run on other
    /// data.
    #[serde(skip_serializing_if = "Option::is_none")]
    street: Option<StreetConfig>,
    /// The synthetic room or yard, likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    room: Option<RoomConfig>,
    /// The synthetic town, likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    town: Option<TownConfig>,
    /// Keys that somebody set to their defaults: what follows from the rig does not replace them.
    /// Other values tell by themselves that somebody set them.
    #[serde(skip)]
    asked: BTreeSet<String>,
}

impl Settings {
    /// Resolves defaults, file and settings of the command line, in that order.
    pub fn resolve(file: Option<&Path>, sets: &[String]) -> anyhow::Result<Self> {
        let mut layers = Layers::defaults()?;
        if let Some(path) = file {
            let shown = path.display();
            let text = read_text_within(path, &SETTINGS_TEXT)
                .context("the file of --config cannot be used")?;
            let table: Table = text.parse().map_err(|error: toml::de::Error| {
                anyhow::anyhow!(
                    "{shown} is not TOML: {}. Correct it, or begin with the config.toml of a run",
                    one_line(&error)
                )
            })?;
            // Key by key, so that an error names its key.
            for (key, value) in leaves("", &table) {
                layers.set(&key, value).with_context(|| format!("{shown} cannot be used"))?;
            }
        }
        for set in sets {
            let Some((key, text)) = set.split_once('=') else {
                bail!(
                    "--set {set} has no value. Write --set key=value, as in --set \
                     volume.voxel_size_m=0.1"
                );
            };
            layers
                .set(key.trim(), value_of(text.trim()))
                .with_context(|| format!("--set {set} cannot be used"))?;
        }
        Ok(layers.finish())
    }

    /// Resolves defaults and a table of settings in their sections.
    ///
    /// # Errors
    /// A key is unknown, or its value is of another kind.
    pub fn from_table(table: &Table) -> anyhow::Result<Self> {
        let mut layers = Layers::defaults()?;
        for (key, value) in leaves("", table) {
            layers.set(&key, value)?;
        }
        Ok(layers.finish())
    }

    /// The matcher's configuration.
    pub fn stereo(&self) -> StereoConfig {
        self.stereo
    }

    /// The mapper's configuration for a rig, and for raw images where they are rectified.
    pub fn config(&self, rig: StereoRig, rectification: Option<&Rectification>) -> Config {
        // Named field by field: a new section does not compile until it is handed over.
        let Self {
            rig: rig_settings,
            rectify: _,
            stereo,
            scene_flow,
            egomotion,
            icp,
            mapper,
            tracking,
            segmentation,
            objects,
            volume,
            raycast,
            mesh,
            planning,
            street: _,
            room: _,
            town: _,
            asked: _,
        } = self;
        Config {
            rig,
            rectification: rectification.copied(),
            inertial: None,
            rig_settings: *rig_settings,
            stereo: *stereo,
            scene_flow: *scene_flow,
            egomotion: *egomotion,
            icp: *icp,
            mapper: *mapper,
            tracking: *tracking,
            segmentation: *segmentation,
            objects: *objects,
            volume: *volume,
            raycast: *raycast,
            mesh: *mesh,
            planning: *planning,
        }
    }

    /// Shortens the pruning window to what the profile remembers, unless another than the default
    /// was asked for.
    pub fn fit(&mut self, capacity: &Capacity) {
        let default = VolumeConfig::default().prune_lag;
        if self.volume.prune_lag == default {
            self.volume.prune_lag = u32::try_from(capacity.history_frames)
                .map_or(default, |frames| frames.min(default));
        }
    }

    /// Lengths that follow from the rig, but for those that somebody set.
    ///
    /// # Errors
    /// A length is not a value of its setting.
    pub fn adapt(&mut self, scale: &Scale) -> anyhow::Result<()> {
        let street = Scale::STREET.settings();
        let mut layers = Layers::over(self.clone())?;
        for ((key, value), (_, default)) in scale.settings().into_iter().zip(street) {
            let default = Value::Float(f64::from(default));
            if at(&layers.table, key) == Some(&default) && !self.asked.contains(key) {
                layers.set(key, Value::Float(f64::from(value)))?;
            }
        }
        let asked = std::mem::take(&mut self.asked);
        *self = Self { asked, ..layers.finish() };
        Ok(())
    }

    /// Keys that somebody set to their defaults.
    pub(super) fn asked(&self) -> &BTreeSet<String> {
        &self.asked
    }

    /// The street's configuration.
    pub fn street(&self) -> StreetConfig {
        self.street.clone().unwrap_or_default()
    }

    /// The street's configuration, to be changed.
    pub fn street_mut(&mut self) -> &mut StreetConfig {
        self.street.get_or_insert_default()
    }

    /// The configuration of the synthetic room or yard.
    pub fn room(&self) -> RoomConfig {
        self.room.clone().unwrap_or_default()
    }

    /// The configuration of the synthetic room or yard, to be changed.
    pub fn room_mut(&mut self) -> &mut RoomConfig {
        self.room.get_or_insert_default()
    }

    /// The configuration of the synthetic town.
    pub fn town(&self) -> TownConfig {
        self.town.unwrap_or_default()
    }

    /// The configuration of the synthetic town, to be changed.
    pub fn town_mut(&mut self) -> &mut TownConfig {
        self.town.get_or_insert_default()
    }

    /// All settings as a file that `--config` takes, those of the worlds that are shown among
    /// them.
    pub fn to_toml(&self, worlds: Worlds) -> anyhow::Result<String> {
        let street = worlds.street.then(|| self.street());
        let room = worlds.room.then(|| self.room());
        let town = worlds.town.then(|| self.town());
        Ok(toml::to_string(&Self { street, room, town, ..self.clone() })?)
    }
}

/// Synthetic worlds whose settings a file shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Worlds {
    street: bool,
    room: bool,
    town: bool,
}

impl Worlds {
    /// None.
    pub const NONE: Self = Self { street: false, room: false, town: false };
    /// The street.
    pub const STREET: Self = Self { street: true, ..Self::NONE };
    /// The room or yard.
    pub const ROOM: Self = Self { room: true, ..Self::NONE };
    /// The town, and the street for its cameras and houses.
    pub const TOWN: Self = Self { street: true, town: true, ..Self::NONE };
    /// All.
    pub const ALL: Self = Self { street: true, room: true, town: true };
}

/// Settings under construction: as a table and as values.
struct Layers {
    table: Table,
    settings: Settings,
    defaults: Table,
}

impl Layers {
    /// The defaults with those of all synthetic worlds.
    fn all_worlds() -> Settings {
        Settings {
            street: Some(StreetConfig::default()),
            room: Some(RoomConfig::default()),
            town: Some(TownConfig::default()),
            ..Settings::default()
        }
    }

    /// The defaults, those of the synthetic worlds among them.
    fn defaults() -> anyhow::Result<Self> {
        Self::over(Self::all_worlds())
    }

    /// Layers over settings that are there.
    fn over(settings: Settings) -> anyhow::Result<Self> {
        let defaults = Table::try_from(Self::all_worlds())?;
        Ok(Self { table: Table::try_from(&settings)?, settings, defaults })
    }

    /// The settings; equal ones are equal values.
    fn finish(mut self) -> Settings {
        self.settings.street.take_if(|street| *street == StreetConfig::default());
        self.settings.room.take_if(|room| *room == RoomConfig::default());
        self.settings.town.take_if(|town| *town == TownConfig::default());
        self.settings
    }

    /// Sets one key and checks at once that it is known and its value of the right kind, so that
    /// the error can name it.
    fn set(&mut self, key: &str, value: Value) -> anyhow::Result<()> {
        // A setting of an older version gets a sentence of its own.
        if let Some(constant) = constant(key) {
            bail!("`{key}` is a constant now, {constant}: leave it out");
        }
        let known = self.table.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        match key.split_once('.') {
            None => bail!(
                "`{key}` is not a key. Keys are section.name with one of the sections {known}"
            ),
            Some((section, _)) if !self.table.contains_key(section) => {
                bail!("`{key}` is not a key: there is no section {section}. Sections are {known}")
            }
            Some(_) => insert(&mut self.table, key, value),
        }
        let mut asked = std::mem::take(&mut self.settings.asked);
        self.settings = self.table.clone().try_into().map_err(|error| {
            anyhow::anyhow!(
                "`{key}`: {}. The config.toml of a run lists all keys with their values",
                one_line(&error)
            )
        })?;
        // Compared as settings have it: a file may say 1 where the setting is 1.0.
        if at(&Table::try_from(&self.settings)?, key) == at(&self.defaults, key) {
            asked.insert(key.to_owned());
        } else {
            asked.remove(key);
        }
        self.settings.asked = asked;
        Ok(())
    }
}

/// Every value below a table that is not a table itself, with its full key.
pub(crate) fn leaves(prefix: &str, table: &Table) -> Vec<(String, Value)> {
    let mut found = Vec::new();
    for (key, value) in table {
        let key = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            Value::Table(inner) => found.extend(leaves(&key, inner)),
            value => found.push((key, value.clone())),
        }
    }
    found
}

/// The value at a dotted key.
fn at<'t>(table: &'t Table, key: &str) -> Option<&'t Value> {
    let mut names = key.split('.');
    let first = table.get(names.next()?);
    names.try_fold(first?, |inner, name| inner.as_table()?.get(name))
}

/// Sets the value at a dotted key, and makes the tables on the way.
pub(super) fn insert(table: &mut Table, key: &str, value: Value) {
    match key.split_once('.') {
        None => drop(table.insert(key.to_owned(), value)),
        Some((first, rest)) => {
            let inner = table.entry(first).or_insert_with(|| Value::Table(Table::new()));
            // A value in the way of a table is replaced: the later of two arguments counts.
            if !inner.is_table() {
                *inner = Value::Table(Table::new());
            }
            if let Value::Table(inner) = inner {
                insert(inner, rest, value);
            }
        }
    }
}

/// The value as TOML; what is not TOML is a word.
fn value_of(text: &str) -> Value {
    let parsed =
        format!("value = {text}").parse::<Table>().ok().and_then(|mut table| table.remove("value"));
    parsed.unwrap_or_else(|| Value::String(text.to_owned()))
}

fn one_line(error: &toml::de::Error) -> String {
    error.message().trim().replace('\n', " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn any_rig() -> StereoRig {
        StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.5 }
    }

    fn sets(sets: &[&str]) -> anyhow::Result<Settings> {
        Settings::resolve(None, &sets.iter().map(|set| (*set).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn the_command_line_overrides_the_file_which_overrides_the_defaults() {
        let folder = tempfile::TempDir::new().unwrap();
        let file = folder.path().join("c.toml");
        std::fs::write(&file, "[volume]\nvoxel_size_m = 1\nfar_m = 12.5\n").unwrap();
        let settings = Settings::resolve(Some(&file), &["volume.voxel_size_m=0.1".into()]).unwrap();
        let volume = settings.config(any_rig(), None).volume;
        assert_eq!((volume.voxel_size_m, volume.far_m, volume.near_m), (0.1, 12.5, 0.5));
    }

    #[test]
    fn lengths_adapt_to_the_rig_but_for_those_that_somebody_set() {
        let desk = StereoRig { focal_px: 754.7, baseline_m: 0.063, ..any_rig() };
        let scale = Scale::for_rig(&desk, 960);
        let adapted = |given: &[&str]| {
            let mut settings = sets(given).unwrap();
            settings.adapt(&scale).unwrap();
            settings.config(desk, None).volume
        };
        let volume = adapted(&[]);
        assert_eq!((volume.voxel_size_m, volume.near_m, volume.far_m), (0.004, 0.04, 3.36));
        // Set to the default, which a desk would not have.
        let volume = adapted(&["volume.voxel_size_m=0.05", "volume.far_m=9"]);
        assert_eq!((volume.voxel_size_m, volume.near_m, volume.far_m), (0.05, 0.04, 9.0));
    }

    #[test]
    fn a_default_that_somebody_set_outlives_storing() {
        let request = super::super::Request {
            settings: sets(&["volume.far_m=20", "volume.near_m=1"]).unwrap(),
            ..Default::default()
        };
        let stored = serde_json::to_string(&request).unwrap();
        assert!(stored.contains("\"far_m\":20.0"), "{stored}");
        assert_eq!(serde_json::from_str::<super::super::Request>(&stored).unwrap(), request);
        assert_ne!(request.settings, sets(&["volume.near_m=1"]).unwrap());
    }

    #[test]
    fn the_resolved_file_gives_the_same_settings_again() {
        let folder = tempfile::TempDir::new().unwrap();
        let file = folder.path().join("c.toml");
        let text = sets(&["volume.voxel_size_m=0.1", "volume.observation_weight=depth"])
            .unwrap()
            .to_toml(Worlds::ALL)
            .unwrap();
        assert!(
            // Exact decimal numbers, and names instead of numbers of a variant.
            text.contains("voxel_size_m = 0.1\n")
                && text.contains("observation_weight = \"depth\""),
            "{text}"
        );
        std::fs::write(&file, &text).unwrap();
        assert_eq!(
            Settings::resolve(Some(&file), &[]).unwrap().to_toml(Worlds::ALL).unwrap(),
            text
        );
    }

    #[test]
    fn the_core_sets_every_key_of_the_file_to_the_same_value() {
        // Keys of every kind: numbers, integers, switches, choices, and nested sections.
        let other = [
            "volume.voxel_size_m=0.1",
            "volume.observation_weight=depth",
            "tracking.motion.samples=77",
            "segmentation.enabled=true",
            "rig.self_calibration=report",
            "rig.disparity_correction.offset_px=0.125",
            "egomotion.confidence=0.99",
            "volume.when_full=refuse",
            "tracking.tracks.overlap=box",
        ];
        let given = sets(&other).unwrap();
        let table: Table = given.to_toml(Worlds::NONE).unwrap().parse().unwrap();
        let mut config = dynvox_core::Config::for_rig(any_rig());
        for (key, value) in leaves("", &table) {
            let text = value.to_string();
            assert_eq!(
                // The core takes bare words and numbers, and knows no quotes or brackets.
                config.set(&key, text.trim_matches(['"', '[', ']'])),
                Ok(()),
                "{key} = {text}"
            );
        }
        assert_eq!(config, given.config(any_rig(), None));
    }

    #[test]
    fn unknown_keys_and_wrong_kinds_are_named() {
        // Each message must name the key as it was written.
        let refusal = |set: &str| format!("{:#}", sets(&[set]).unwrap_err());
        let message = refusal("volume.voxel_sise_m=0.1");
        assert!(
            message.contains("`volume.voxel_sise_m`") && message.contains("voxel_size_m"),
            "{message}"
        );
        assert!(refusal("volumes.far_m=1").contains("no section volumes"));
        assert!(
            refusal("rig.focal_px=1").contains("`rig.focal_px`"),
            "the calibration comes with the data"
        );
        assert!(refusal("far_m=1").contains("`far_m` is not a key"));
        assert!(refusal("volume.far_m").contains("has no value"));
        assert!(refusal("stereo.beta=0.02").contains("`stereo.beta` is a constant now, 0.02"));
        assert!(refusal("volume.far_m=wide").contains("`volume.far_m`"));
        assert!(refusal("street.wdith=100").contains("`street.wdith`"));
        let folder = tempfile::TempDir::new().unwrap();
        let file = folder.path().join("c.toml");
        std::fs::write(&file, "[volume]\nnonsense = 1\n").unwrap();
        let message = format!("{:#}", Settings::resolve(Some(&file), &[]).unwrap_err());
        assert!(message.contains("c.toml") && message.contains("`volume.nonsense`"), "{message}");
        std::fs::write(&file, "[volume\n").unwrap();
        assert!(
            format!("{:#}", Settings::resolve(Some(&file), &[]).unwrap_err())
                .contains("is not TOML")
        );
    }
}
