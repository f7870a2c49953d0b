//! The live view's part of a run: figures after each frame, pictures and regions of the map now and
//! then.

use super::frame_pictures::Shown;
use super::{Finished, FrameContext, ObserveError, ObservedRun, Observer, pictures};
use crate::live::{LiveFigures, LivePictures, LiveView, MapRegion, MapUpdate};
use crate::volume_copy::VolumeCopy;
use dynvox_core::tracking::MotionState;
use dynvox_core::volume::Volume;
use hashbrown::{HashMap, HashSet};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Time from one picture to the next, and from one update of the map to the next.
const PICTURES_EVERY: Duration = Duration::from_millis(500);
const MAP_EVERY: Duration = Duration::from_millis(500);
/// Blocks copied at once at most, but for those of one region: some 6 MB.
const MAX_BLOCKS: usize = 2_048;

/// Feeds the live view, where a run has one.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct LiveObserver {
    /// State of an open page; `None` without one.
    #[serde(skip)]
    watched: Option<Watched>,
}

/// State while a page is open.
#[derive(Debug)]
struct Watched {
    pictures_at: Option<Instant>,
    map_at: Option<Instant>,
    /// Regions that changed since they were drawn, in the order in which they did.
    changed: VecDeque<MapRegion>,
    known: HashSet<MapRegion>,
}

impl Watched {
    /// A page that lacks all of a map.
    fn new(volume: &Volume<'_>) -> Self {
        let mut watched = Self {
            pictures_at: None,
            map_at: None,
            changed: VecDeque::new(),
            known: HashSet::new(),
        };
        let keys = volume.pool().live().filter_map(|slot| volume.blocks().key(slot));
        // The page shows the map that frames are fused into.
        keys.filter(|key| key.segment.archived_submap().is_none())
            .for_each(|key| watched.add(MapRegion::new(key)));
        watched
    }

    fn add(&mut self, region: MapRegion) {
        if self.known.insert(region) {
            self.changed.push_back(region);
        }
    }

    /// Takes the regions that changed first, with as many blocks as may be copied at once.
    fn take(&mut self, volume: &Volume<'_>) -> Vec<MapRegion> {
        let mut blocks_of: HashMap<MapRegion, usize> = HashMap::new();
        for key in volume.pool().live().filter_map(|slot| volume.blocks().key(slot)) {
            *blocks_of.entry(MapRegion::new(key)).or_default() += 1;
        }
        let (mut taken, mut blocks) = (Vec::new(), 0);
        while let Some(&region) = self.changed.front() {
            blocks += blocks_of.get(&region).copied().unwrap_or_default();
            if !taken.is_empty() && blocks > MAX_BLOCKS {
                break;
            }
            self.changed.pop_front();
            self.known.remove(&region);
            taken.push(region);
        }
        taken
    }

    /// Draws what changed, if it is time and nothing else is being drawn.
    fn draw(&mut self, live: &LiveView, frame: &FrameContext<'_, '_>) {
        let (volume, mesh) = (frame.view.mapper().static_map(), frame.view.mapper().config().mesh);
        for key in volume.visible().slots().iter().filter_map(|&slot| volume.blocks().key(slot)) {
            self.add(MapRegion::new(key));
        }
        if !is_due(self.map_at, MAP_EVERY) || !live.can_draw() {
            return;
        }
        self.map_at = Some(Instant::now());
        let regions = self.take(volume);
        let wanted: HashSet<MapRegion> = regions.iter().copied().collect();
        let blocks = VolumeCopy::of_blocks(volume, |key| {
            MapRegion::touched_by(key).any(|region| wanted.contains(&region))
        });
        live.draw(MapUpdate { regions, blocks, mesh });
    }
}

fn is_due(last: Option<Instant>, every: Duration) -> bool {
    last.is_none_or(|at| at.elapsed() >= every)
}

/// Figures of a frame.
fn figures(run: &ObservedRun<'_>, frame: &FrameContext<'_, '_>) -> LiveFigures {
    let (row, report) = (frame.row, &frame.row.report);
    let [x, y, z] = report.t_world_camera.translation_m;
    let [a, b, c, d] = report.t_world_camera.rotation;
    LiveFigures {
        frame: row.frame,
        frames: frame.position + 1,
        of: run.plan.frames.count(),
        step_ms: row.step_ms,
        severity: row.severity().name(),
        cause: row.cause(),
        pool: f64::from(report.blocks.used) / f64::from(report.blocks.capacity.max(1)),
        moving: row.track_states[MotionState::Dynamic as usize],
        pose: [x, y, z, a, b, c, d],
    }
}

/// Pictures of a frame.
fn pictures_of(frame: &mut FrameContext<'_, '_>) -> LivePictures {
    let (left, disparity) = (frame.jpeg(Shown::Left), frame.jpeg(Shown::Disparity));
    let mapper = frame.view.mapper();
    let (width, height) = (mapper.disparity_q8().width(), mapper.disparity_q8().height());
    LivePictures { left, disparity, masks: pictures::masks(mapper, width, height) }
}

impl Observer for LiveObserver {
    type Section = ();

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let Some(live) = &run.plan.live else { return Ok(()) };
        live.add_frame(figures(run, frame));
        if !live.is_watched() {
            self.watched = None;
            return Ok(());
        }
        let volume = frame.view.mapper().static_map();
        let watched = self.watched.get_or_insert_with(|| Watched::new(volume));
        watched.draw(live, frame);
        if is_due(watched.pictures_at, PICTURES_EVERY) {
            watched.pictures_at = Some(Instant::now());
            live.show(pictures_of(frame));
        }
        Ok(())
    }

    fn finish(self, _: &ObservedRun<'_>, _: &Finished) -> Result<(), ObserveError> {
        Ok(())
    }
}
