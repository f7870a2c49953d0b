//! Paths of a request, which are absolute: a request means the same in every folder.

use super::{Poses, Request, Source};
use crate::input::depth::DepthChoice;
use crate::input::masks::MaskChoice;
use std::path::PathBuf;

impl Request {
    /// Makes every path absolute, seen from the current folder.
    ///
    /// # Errors
    /// The current folder is unknown.
    pub fn absolute(mut self) -> std::io::Result<Self> {
        for path in self.paths_mut() {
            *path = std::path::absolute(&*path)?;
        }
        Ok(self)
    }

    /// Every path that is read or written.
    fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        // All parts are named: a new path does not compile until it is decided here.
        let Self { input, depth, masks, poses, exports, .. } = self;
        let mut paths: Vec<&mut PathBuf> = input.calibration.iter_mut().collect();
        if let Source::Recording(path) = &mut input.source {
            paths.push(path);
        }
        match depth {
            DepthChoice::Files(_, path) => paths.push(path),
            DepthChoice::Elas | DepthChoice::Exact => {}
        }
        match &mut masks.source {
            MaskChoice::Files(_, path) => paths.push(path),
            MaskChoice::Networks(files) => paths.extend(files),
            MaskChoice::Auto
            | MaskChoice::None
            | MaskChoice::Motion
            | MaskChoice::Exact
            | MaskChoice::Noisy(_) => {}
        }
        if let Poses::File(path) = poses {
            paths.push(path);
        }
        paths.extend(&mut exports.instances);
        paths.extend(&mut exports.map_disparity);
        paths
    }
}
