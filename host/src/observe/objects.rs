//! What moves or could, over a run: objects as they leave the mapper, tracks, both against truth.

use super::retired::{Kept, KeptObject};
use super::tracks::{TrackRecord, TrackRow, track_records};
use crate::evaluate::objects::{Judged, ObjectErrors, ObjectFigures};
use crate::evaluate::surfaces::TrueView;
use crate::evaluate::swept::Swept;
use crate::input::MaskRefusals;
use crate::input::StereoImages;
use crate::run::FolderError;
use crate::run::FrameRow;
use dynvox_core::masks::PixelBox;
use dynvox_core::tracking::{DetectionCount, TrackReport};
use dynvox_core::{Config, Mapper, Report};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What moved or could, over the whole run.
#[derive(Clone, Debug, Default)]
pub struct ObjectsRecord {
    /// All tracks, by number.
    pub tracks: Vec<TrackRecord>,
    /// All objects handed over, in that order.
    pub kept: Vec<KeptObject>,
    /// Tracks against truth.
    pub figures: Option<ObjectFigures>,
    /// Every track of every frame that was compared with a true thing.
    pub judged: Vec<(u32, Judged)>,
    /// Triangles of the static map where something drove; known where the truth is exact.
    pub swept_triangles: Option<u64>,
    /// What the source of masks said and could not be used.
    pub refusals: MaskRefusals,
    /// What became of the detections.
    pub detections: DetectionCount,
}

/// The objects of a run under way.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct ObjectsAtWork {
    /// What left the mapper.
    pub(crate) kept: Kept,
    errors: ObjectErrors,
    swept: Option<Swept>,
}

impl ObjectsAtWork {
    /// Notes a frame; returns the tracks seen in it.
    pub fn note(&mut self, config: &Config, frame: usize, mapper: &Mapper<'_>, images: &StereoImages, report: &Report) -> Vec<TrackRow> {
        let tracks: Vec<TrackReport> = mapper.tracks().filter(|track| track.seen).collect();
        for (summary, _) in mapper.objects().filter(|(summary, _)| summary.last_frame == report.frame) {
            self.kept.follow(frame, summary.id, summary.chain, summary.t_world_object);
        }
        if let Some(truth) = &images.objects {
            let size = (images.left.width(), images.left.height());
            let large_enough = |pixels: &PixelBox| config.instances.large_enough(pixels.area(), size.0);
            self.errors.add(&tracks, &report.t_world_camera, truth, size, large_enough);
            if let Some(exact) = &images.exact {
                let t_map_world = report.t_world_camera * truth.t_world_camera.inverse();
                let swept = self.swept.get_or_insert_default();
                truth.objects.iter().for_each(|object| swept.add(object, &t_map_world));
                let Some(depth_m) = exact.depth_m.view() else { return tracks.iter().map(TrackRow::from).collect() };
                let view = TrueView {
                    rig: &config.rig,
                    depth_m,
                    t_world_camera: truth.t_world_camera,
                    far_m: f64::from(config.instances.volume.far_m),
                };
                for (summary, _) in mapper.objects().filter(|(summary, _)| summary.last_frame == report.frame) {
                    let thing = self.errors.truth_of(summary.id).and_then(|id| truth.objects.iter().find(|thing| thing.id == id));
                    if let Some(thing) = thing {
                        let t_thing_object = thing.t_world_object.inverse() * t_map_world.inverse() * summary.t_world_object;
                        self.kept.side(summary.id, summary.chain).add(&view, thing, &t_thing_object);
                    }
                }
            }
        }
        tracks.iter().map(TrackRow::from).collect()
    }

    /// Sums up. Call it when the mapper has handed over its last object.
    pub fn finish(&mut self, rows: &[FrameRow]) -> ObjectsRecord {
        let mut refusals = MaskRefusals::default();
        rows.iter().for_each(|row| refusals.add(&row.refusals));
        ObjectsRecord {
            tracks: track_records(rows, &self.errors.tracks()),
            kept: self.kept.finish(),
            figures: self.errors.figures(),
            judged: self.errors.rows(),
            swept_triangles: None,
            refusals,
            detections: rows.iter().fold(DetectionCount::default(), |sum, row| summed(sum, &row.report.instances.detections)),
        }
    }

    /// Triangles of the finished static map where something drove.
    pub fn swept_triangles(&self, map: &Path) -> Result<Option<u64>, FolderError> {
        let counted = self.swept.as_ref().map(|swept| swept.triangles(map)).transpose();
        counted.map_err(|source| FolderError::Write { path: map.to_path_buf(), source })
    }
}

fn summed(a: DetectionCount, b: &DetectionCount) -> DetectionCount {
    DetectionCount {
        given: a.given + b.given,
        taken: a.taken + b.taken,
        bad_score: a.bad_score + b.bad_score,
        bad_box: a.bad_box + b.bad_box,
        bad_mask: a.bad_mask + b.bad_mask,
        ignored: a.ignored + b.ignored,
        too_small: a.too_small + b.too_small,
        tracked_only: a.tracked_only + b.tracked_only,
        beyond: a.beyond + b.beyond,
        no_room: a.no_room + b.no_room,
        covered: a.covered + b.covered,
    }
}
