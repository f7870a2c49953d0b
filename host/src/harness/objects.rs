//! What moves or could, over a run: meshes of objects as they leave the mapper, where they were, tracks against truth.

use super::{FrameRow, Plan};
use crate::dataset::StereoImages;
use crate::evaluation::objects::{ObjectErrors, ObjectFigures, TrackErrors, median};
use crate::evaluation::swept::Swept;
use crate::export::{FolderError, PlyWriter, RunFolder, portrait, write_numbered};
use crate::segmentation::Refusals;
use dynvox_core::geometry::Transform;
use dynvox_core::instances::{Class, DetectionCount, ObjectSink, RetiredObject, State, TrackReport};
use dynvox_core::volume::{MeshConfig, Triangle};
use dynvox_core::{Mapper, Report};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Objects shown with a picture, at most: those fused most often.
const PORTRAITS: usize = 24;

/// An object handed over by the mapper.
#[derive(Clone, Debug)]
pub struct KeptObject {
    /// Number of its track.
    pub id: u32,
    /// Chain of poses within the track.
    pub chain: u32,
    /// Name of its files: the track's number; `7-2` for the second object of track 7.
    pub name: String,
    /// What it is.
    pub class: Class,
    /// What was last known of its motion.
    pub state: State,
    /// Frames fused.
    pub frames: u32,
    /// Blocks of its volume.
    pub blocks: usize,
    /// Triangles of its mesh.
    pub triangles: u64,
    /// Its mesh from three sides, as a PNG file; empty where there are enough others.
    pub portrait_png: Vec<u8>,
}

/// A track over the whole run.
#[derive(Clone, Debug)]
pub struct TrackRecord {
    /// Its number.
    pub id: u32,
    /// What it is.
    pub class: Class,
    /// First and last frame it was seen in, as the data set counts.
    pub first_frame: usize,
    /// See `first_frame`.
    pub last_frame: usize,
    /// Frames it was seen in.
    pub frames: usize,
    /// Of these, frames in each state: uncertain, static, dynamic.
    pub states: [usize; 3],
    /// The state it was in most, of static and dynamic; uncertain if it was neither.
    pub state: State,
    /// Median speed over the frames in that state, m/s.
    pub speed_m_s: Option<f64>,
    /// Most blocks of its volume.
    pub blocks: u32,
    /// Against the truth, where it is known.
    pub errors: Option<TrackErrors>,
}

/// What moved or could, over the whole run.
#[derive(Clone, Debug, Default)]
pub struct ObjectsRecord {
    /// All tracks, by number.
    pub tracks: Vec<TrackRecord>,
    /// All objects handed over, in that order.
    pub kept: Vec<KeptObject>,
    /// Tracks against truth.
    pub figures: Option<ObjectFigures>,
    /// Triangles of the static map where something drove; known where the truth is exact.
    pub swept_triangles: Option<u64>,
    /// What the source of masks said and could not be used.
    pub refusals: Refusals,
    /// What became of the detections.
    pub detections: DetectionCount,
}

/// Takes objects that leave the mapper and writes their meshes.
pub struct Kept {
    folder: PathBuf,
    mesh: MeshConfig,
    kept: Vec<KeptObject>,
    failed: Option<FolderError>,
}

impl ObjectSink for Kept {
    fn retire(&mut self, object: RetiredObject<'_, '_>) {
        // The run ends with the first failure; there is nothing to be done about more.
        if self.failed.is_none() {
            self.failed = self.take(&object).err();
        }
    }
}

impl Kept {
    fn take(&mut self, object: &RetiredObject<'_, '_>) -> Result<(), FolderError> {
        let summary = &object.summary;
        let mut triangles: Vec<Triangle> = Vec::new();
        object.volume.triangles(&self.mesh, &mut |triangle| triangles.push(triangle));
        if triangles.is_empty() {
            return Ok(());
        }
        let before = self.kept.iter().filter(|known| known.id == summary.id).count();
        let name = if before == 0 { summary.id.to_string() } else { format!("{}-{}", summary.id, before + 1) };
        let path = self.folder.join(format!("{name}.ply"));
        let written = std::fs::create_dir_all(&self.folder).and_then(|()| {
            let mut ply = PlyWriter::begin_in(&path, "the object's own frame: the camera's when it was first seen")?;
            triangles.iter().for_each(|one| ply.triangle(one.vertices.map(|vertex| (vertex.position_m, vertex.colour))));
            ply.finish()
        });
        written.map_err(|source| FolderError::Write { path, source })?;
        self.kept.push(KeptObject {
            id: summary.id,
            chain: summary.chain,
            name,
            class: summary.class,
            state: summary.state,
            frames: summary.frames,
            blocks: object.volume.pool().len(),
            triangles: triangles.len() as u64,
            portrait_png: portrait(&triangles),
        });
        self.thin_portraits();
        Ok(())
    }

    /// Lets the picture of the object fused least often go when there are too many.
    fn thin_portraits(&mut self) {
        let shown = self.kept.iter_mut().filter(|one| !one.portrait_png.is_empty());
        let mut shown: Vec<_> = shown.collect();
        if shown.len() > PORTRAITS
            && let Some(least) = shown.iter_mut().min_by_key(|one| one.frames)
        {
            least.portrait_png = Vec::new();
        }
    }
}

/// The objects of a run under way.
pub struct ObjectsAtWork {
    /// Takes retired objects.
    pub sink: Kept,
    /// Where each object was when it was fused: by track and chain.
    paths: BTreeMap<(u32, u32), Vec<(usize, Transform)>>,
    errors: ObjectErrors,
    swept: Option<Swept>,
}

impl ObjectsAtWork {
    /// Objects go into `objects` of the run folder; it is made with the first.
    pub fn new(folder: &RunFolder, plan: &Plan) -> Self {
        let sink = Kept {
            folder: folder.file("objects"),
            mesh: plan.config.mesh,
            kept: Vec::new(),
            failed: None,
        };
        Self { sink, paths: BTreeMap::new(), errors: ObjectErrors::default(), swept: None }
    }

    /// Notes a frame; returns the tracks seen in it.
    pub fn note(&mut self, frame: usize, mapper: &Mapper<'_>, images: &StereoImages, report: &Report) -> Vec<TrackReport> {
        let tracks: Vec<TrackReport> = mapper.tracks().filter(|track| track.seen).collect();
        for (summary, _) in mapper.objects().filter(|(summary, _)| summary.last_frame == report.frame) {
            self.paths.entry((summary.id, summary.chain)).or_default().push((frame, summary.t_world_object));
        }
        if let Some(truth) = &images.objects {
            self.errors.add(&tracks, &report.t_world_camera, truth);
            if images.exact.is_some() {
                let t_map_world = report.t_world_camera * truth.t_world_camera.inverse();
                let swept = self.swept.get_or_insert_default();
                truth.objects.iter().for_each(|object| swept.add(object, &t_map_world));
            }
        }
        tracks
    }

    /// Writes where the objects were, and sums up. Call it when the mapper has handed over its last object.
    pub fn finish(&mut self, rows: &[FrameRow]) -> Result<ObjectsRecord, FolderError> {
        if let Some(failed) = self.sink.failed.take() {
            return Err(failed);
        }
        for object in &self.sink.kept {
            let poses = self.paths.get(&(object.id, object.chain)).map_or(&[][..], Vec::as_slice);
            let path = self.sink.folder.join(format!("{}_kitti.txt", object.name));
            let mut text = Vec::new();
            let written = write_numbered(&mut text, poses).and_then(|()| std::fs::write(&path, text));
            written.map_err(|source| FolderError::Write { path, source })?;
        }
        let mut refusals = Refusals::default();
        rows.iter().for_each(|row| refusals.add(&row.refusals));
        Ok(ObjectsRecord {
            tracks: track_records(rows, &self.errors.tracks()),
            kept: std::mem::take(&mut self.sink.kept),
            figures: self.errors.figures(),
            swept_triangles: None,
            refusals,
            detections: rows.iter().fold(DetectionCount::default(), |sum, row| summed(sum, &row.report.instances.detections)),
        })
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
        beyond: a.beyond + b.beyond,
        no_room: a.no_room + b.no_room,
        covered: a.covered + b.covered,
    }
}

/// Every track over all frames.
fn track_records(rows: &[FrameRow], errors: &BTreeMap<u32, TrackErrors>) -> Vec<TrackRecord> {
    let mut seen = BTreeMap::<u32, Vec<(usize, &TrackReport)>>::new();
    for (row, track) in rows.iter().flat_map(|row| row.tracks.iter().map(move |track| (row, track))) {
        seen.entry(track.id).or_default().push((row.frame, track));
    }
    let record = |(id, seen): (u32, Vec<(usize, &TrackReport)>)| {
        let of = |state: State| seen.iter().filter(move |(_, track)| track.state == state);
        let states = [State::Uncertain, State::Static, State::Dynamic].map(|state| of(state).count());
        let state = match states {
            [_, 0, 0] => State::Uncertain,
            [_, still, moving] if moving > still => State::Dynamic,
            _ => State::Static,
        };
        let (first, last) = (seen.first()?, seen.last()?);
        Some(TrackRecord {
            id,
            class: last.1.class,
            first_frame: first.0,
            last_frame: last.0,
            frames: seen.len(),
            states,
            state,
            speed_m_s: median(of(state).filter_map(|(_, track)| track.speed_m_s.map(|[speed, _]| f64::from(speed)))),
            blocks: seen.iter().map(|(_, track)| track.blocks).max().unwrap_or_default(),
            errors: errors.get(&id).cloned(),
        })
    };
    seen.into_iter().filter_map(record).collect()
}
