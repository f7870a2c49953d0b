//! The map as observers look at it: raycasts on the run's threads.

use super::Threads;
use crate::observe::{MapView, StageTime};
use dynvox_core::planning::PlanningReport;
use dynvox_core::view::{RaycastView, Raycaster};
use dynvox_core::{Mapper, Stage};

/// The mapper and the threads that raycast.
pub(super) struct LiveMap<'m, 's> {
    pub mapper: &'m mut Mapper<'s>,
    pub threads: &'m Threads,
    /// Time of the first raycast.
    pub first_raycast: Option<StageTime>,
}

impl<'s> MapView<'s> for LiveMap<'_, 's> {
    fn mapper(&self) -> &Mapper<'s> {
        self.mapper
    }

    fn raycast(&mut self, view: RaycastView) -> Option<&Raycaster<'s>> {
        let (mapper, threads) = (&mut *self.mapper, self.threads);
        let seen = threads.run(|| mapper.raycast(view, threads));
        self.first_raycast.get_or_insert(threads.take_times().stages[Stage::Raycast as usize]);
        seen.ok()
    }

    fn raycast_with_objects(&mut self, view: RaycastView) -> Option<&Raycaster<'s>> {
        let (mapper, threads) = (&mut *self.mapper, self.threads);
        threads.run(|| mapper.raycast_composed(view, threads)).ok()
    }

    fn plan(&mut self, ahead_s: f32) -> PlanningReport {
        self.mapper.update_planning_maps(ahead_s)
    }
}
