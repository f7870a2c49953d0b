//! What the page has not seen yet.

use super::map::{DrawnRegion, MapRegion};
use hashbrown::HashMap;
use serde::Serialize;
use std::sync::Arc;

/// Positions of the path at most; a longer one ends there on the page.
const MAX_PATH: usize = 100_000;
/// Bytes of all regions at most: beyond them those drawn longest ago are taken off the page.
const MAX_REGION_BYTES: usize = 48 << 20;

/// Figures of a frame.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LiveFigures {
    /// Number of the frame.
    pub frame: usize,
    /// Frames mapped.
    pub frames: usize,
    /// Frames in all, if they are known.
    pub of: Option<usize>,
    /// Time of the step, ms.
    pub step_ms: f64,
    /// Severity of the frame, as in `frames.csv`.
    pub severity: &'static str,
    /// Cause of the severity; empty without one.
    pub cause: String,
    /// Share of the block pool in use, 0 to 1.
    pub pool: f64,
    /// Objects seen that move.
    pub moving: u32,
    /// Position of the camera in the world, m, and its orientation (x, y, z, w).
    pub pose: [f64; 7],
}

/// Pictures of a frame, as files; empty if missing.
#[derive(Default)]
pub struct LivePictures {
    /// Left image (JPEG).
    pub left: Vec<u8>,
    /// Disparity (JPEG).
    pub disparity: Vec<u8>,
    /// Masks, to lie on the left image (PNG).
    pub masks: Vec<u8>,
}

/// A region on the page.
struct ShownRegion {
    id: u32,
    version: u64,
    bytes: Arc<[u8]>,
    triangles: usize,
}

/// State of the page.
#[derive(Default)]
pub struct News {
    /// Grows with every change.
    version: u64,
    figures: LiveFigures,
    path: Vec<[f32; 3]>,
    regions: HashMap<MapRegion, ShownRegion>,
    region_bytes: usize,
    pictures: [Arc<[u8]>; 3],
    pictures_version: u64,
}

/// News since a version.
#[derive(Serialize)]
struct Answer<'n> {
    version: u64,
    figures: &'n LiveFigures,
    /// Positions that the page does not have yet.
    path: &'n [[f32; 3]],
    pictures: u64,
    triangles: usize,
    /// Numbers of regions that changed.
    regions: Vec<u32>,
}

impl News {
    pub(super) fn add_frame(&mut self, figures: LiveFigures) {
        if self.path.len() < MAX_PATH {
            let [x, y, z, ..] = figures.pose;
            self.path.push([x, y, z].map(|metres| metres as f32));
        }
        self.figures = figures;
        self.version += 1;
    }

    pub(super) fn set_pictures(&mut self, LivePictures { left, disparity, masks }: LivePictures) {
        self.pictures = [left, disparity, masks].map(Into::into);
        self.pictures_version += 1;
        self.version += 1;
    }

    pub(super) fn add_regions(&mut self, drawn: Vec<DrawnRegion>) {
        self.version += 1;
        for DrawnRegion { region, triangles, bytes } in drawn {
            let id = self.regions.len() as u32;
            let shown = ShownRegion { id, version: self.version, bytes, triangles };
            self.region_bytes += shown.bytes.len();
            if let Some(before) = self.regions.remove(&region) {
                self.region_bytes -= before.bytes.len();
                self.regions.insert(region, ShownRegion { id: before.id, ..shown });
            } else {
                self.regions.insert(region, shown);
            }
        }
        while self.region_bytes > MAX_REGION_BYTES {
            let oldest = self
                .regions
                .values_mut()
                .filter(|shown| !shown.bytes.is_empty())
                .min_by_key(|shown| (shown.version, shown.id));
            let Some(oldest) = oldest else { break };
            self.region_bytes -= oldest.bytes.len();
            // Its number stays, so that the page takes it off.
            (oldest.bytes, oldest.triangles, oldest.version) = (Arc::default(), 0, self.version);
        }
    }

    /// News for a page that has seen a version and so many positions of the path, as JSON.
    pub(super) fn since(&self, version: u64, positions: usize) -> Vec<u8> {
        let changed = self.regions.values().filter(|shown| shown.version > version);
        let answer = Answer {
            version: self.version,
            figures: &self.figures,
            path: self.path.get(positions..).unwrap_or_default(),
            pictures: self.pictures_version,
            triangles: self.regions.values().map(|shown| shown.triangles).sum(),
            regions: changed.map(|shown| shown.id).collect(),
        };
        serde_json::to_vec(&answer).unwrap_or_default()
    }

    /// Bytes of a region; `None` for an unknown number.
    pub(super) fn region(&self, id: u32) -> Option<Arc<[u8]>> {
        let mut shown = self.regions.values();
        shown.find(|shown| shown.id == id).map(|shown| Arc::clone(&shown.bytes))
    }

    /// A picture: left image, disparity, masks.
    pub(super) fn picture(&self, number: usize) -> Option<Arc<[u8]>> {
        self.pictures.get(number).filter(|bytes| !bytes.is_empty()).map(Arc::clone)
    }
}
