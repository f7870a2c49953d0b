//! Synthetic worlds by name.

use super::Settings;
use super::source::Source;
use crate::input::InputError;
use crate::synth::{Room, RoomKind, Street, Town, World};
use serde::Deserialize;

/// A synthetic world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum SyntheticWorld {
    /// A street with moving cars
    #[default]
    Street,
    /// A furnished room or a corridor, at the scale of hands
    Room,
    /// A yard with houses, a hedge, trees and people
    Yard,
    /// A town, and a loop of streets to go round
    Town,
}

impl SyntheticWorld {
    /// The world as a source of images.
    pub fn source(self) -> Source {
        match self {
            Self::Street => Source::Street,
            Self::Room => Source::Room,
            Self::Yard => Source::Yard,
            Self::Town => Source::Town,
        }
    }

    /// The world behind a source; `None` for recordings and streams.
    pub fn of_source(source: &Source) -> Option<Self> {
        match source {
            Source::Street => Some(Self::Street),
            Source::Room => Some(Self::Room),
            Source::Yard => Some(Self::Yard),
            Source::Town => Some(Self::Town),
            Source::Stream | Source::Recording(_) => None,
        }
    }

    /// Builds the world with its settings changed.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn build(self, settings: &Settings, change: &Change) -> Result<Box<dyn World>, InputError> {
        let failed =
            |error: crate::synth::SynthError| InputError::Street { reason: error.to_string() };
        let kind = match self {
            Self::Street => {
                let mut config = settings.street();
                config.frames = change.frames.unwrap_or(config.frames);
                config.inertial = config.inertial.filter(|_| !change.without_unit);
                return Ok(Box::new(Street::new(config).map_err(failed)?));
            }
            Self::Town => {
                let mut street = settings.street();
                street.inertial = street.inertial.filter(|_| !change.without_unit);
                let town = Town::new(street, settings.town()).map_err(failed)?;
                return Ok(Box::new(match change.frames {
                    Some(frames) => town.with_frames(frames),
                    None => town,
                }));
            }
            Self::Room => RoomKind::Room,
            Self::Yard => RoomKind::Yard,
        };
        let mut config = settings.room();
        config.frames = change.frames.unwrap_or(config.frames);
        config.inertial = config.inertial.filter(|_| !change.without_unit);
        Ok(Box::new(Room::new(kind, config).map_err(failed)?))
    }
}

/// Changes of a world's settings by the command line.
#[derive(Clone, Copy, Debug, Default)]
pub struct Change {
    /// Frames instead of those of the settings.
    pub frames: Option<u32>,
    /// True if the camera has no inertial unit, against the settings.
    pub without_unit: bool,
}
