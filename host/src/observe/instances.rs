//! Saves the instances of every frame: those given, and apart those found by motion.

use super::{FrameContext, ObserveError, ObservedRun, Observer};
use crate::input::masks::save_masks;
use crate::input::{FrameSource, InstanceMask};
use crate::owned::create_folder;
use dynvox_core::Mapper;
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::Class;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Folder of the masks found by motion, below that of the given masks.
pub const MOTION_FOLDER: &str = "motion";

/// Saves instances where [`ObservedRun::instances_folder`] says so.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct InstancesObserver {}

impl Observer for InstancesObserver {
    type Section = ();

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let Some(folder) = run.instances_folder.as_deref() else { return Ok(()) };
        let motion_folder = folder.join(MOTION_FOLDER);
        create_folder(&motion_folder)
            .map_err(|source| ObserveError::Write { path: motion_folder.clone(), source })?;
        let (stem, size) =
            (stem(run.plan.dataset.as_ref(), frame.row.frame), run.plan.dataset.size());
        let save = |folder: &Path, masks: &[InstanceMask]| {
            Ok::<(), ObserveError>(save_masks(folder, &stem, size, masks)?)
        };
        // The masks that were given; beside them those that the core found itself.
        save(folder, &frame.images.masks.instances)?;
        save(&motion_folder, &found_by_motion(frame.view.mapper(), size))
    }

    fn finish(self, _: &ObservedRun<'_>, _: &super::Finished) -> Result<(), ObserveError> {
        Ok(())
    }
}

/// Name of a frame's files.
pub(super) fn stem(dataset: &dyn FrameSource, index: usize) -> String {
    dataset.stem(index).unwrap_or_else(|| format!("{index:06}"))
}

/// The masks of this frame's moving objects that no source of masks gave.
fn found_by_motion(mapper: &Mapper<'_>, size: (usize, usize)) -> Vec<InstanceMask> {
    let (width, height) = size;
    let image = PixelBox { left: 0, top: 0, width: width as i32, height: height as i32 };
    let track_at = |u: i32, v: i32| {
        mapper.instance_at(u, v).filter(|at| at.class == Class::MovingObject).map(|at| at.track)
    };
    // One pass over the image: masks of all objects at once.
    let mut labels = vec![0u16; width * height];
    let mut tracks = BTreeMap::new();
    for (at, label) in labels.iter_mut().enumerate() {
        let Some(track) = track_at((at % width) as i32, (at / width) as i32) else { continue };
        // Labels from 1: 0 is the background.
        let next = tracks.len() as u16 + 1;
        *label = *tracks.entry(track).or_insert(next);
    }
    let label_at = |u: i32, v: i32| labels.get(v as usize * width + u as usize).copied();
    let score = |track: Option<u32>| {
        mapper.tracks().find(|known| Some(known.id) == track).map_or(1.0, |track| track.score)
    };
    let mask = |(track, label): (Option<u32>, u16)| {
        InstanceMask::from_predicate(Class::MovingObject, score(track), image, |u, v| {
            label_at(u, v) == Some(label)
        })
    };
    tracks.into_iter().filter_map(mask).collect()
}
