//! Paths of a request, which are absolute: a request means the same in every folder.

use super::{Exports, Poses, Request, Source};
use crate::input::InertialChoice;
use crate::input::depth::DepthChoice;
use crate::input::masks::MaskChoice;
use std::path::PathBuf;

impl Request {
    /// Makes every path absolute, seen from the current folder.
    ///
    /// # Errors
    /// The current folder is unknown.
    pub fn absolute(mut self) -> std::io::Result<Self> {
        for path in self.inputs_mut() {
            *path = std::path::absolute(&*path)?;
        }
        let Exports { instances, disparity, map_disparity, scene, .. } = &mut self.exports;
        let scene = scene.iter_mut().map(|scene| &mut scene.folder);
        for path in instances.iter_mut().chain(disparity).chain(map_disparity).chain(scene) {
            *path = std::path::absolute(&*path)?;
        }
        Ok(self)
    }

    /// Every path that is read: no output may contain one or lie within one.
    pub fn inputs(&self) -> Vec<PathBuf> {
        self.clone().inputs_mut().into_iter().map(|path| path.clone()).collect()
    }

    /// Every path that is written besides the run folder.
    pub fn saved_folders(&self) -> impl Iterator<Item = &PathBuf> {
        let Exports { instances, disparity, map_disparity, scene, .. } = &self.exports;
        let scene = scene.iter().map(|scene| &scene.folder);
        instances.iter().chain(disparity).chain(map_disparity).chain(scene)
    }

    /// Every path that is read.
    fn inputs_mut(&mut self) -> Vec<&mut PathBuf> {
        // A path that is read is added here, and no output may contain it.
        let Self { input, depth, masks, poses, fixes, storage, exports: _, .. } = self;
        let mut paths: Vec<&mut PathBuf> =
            input.calibration.iter_mut().chain(&mut input.inertial_calibration).collect();
        if let InertialChoice::File(path) = &mut input.inertial {
            paths.push(path);
        }
        if let Source::Recording(path) = &mut input.source {
            paths.push(path);
        }
        paths.extend(&mut input.ignore_mask);
        paths.extend(&mut storage.continues);
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
        paths.extend(fixes);
        paths
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_path_that_is_read_is_an_input_and_no_other() {
        let mut request = Request::default();
        request.input.source = Source::Recording("recording".into());
        request.input.calibration = vec!["left.yaml".into(), "right.yaml".into()];
        request.input.inertial = InertialChoice::File("imu.csv".into());
        request.input.inertial_calibration = vec!["camchain.yaml".into()];
        request.depth = "files:depth".parse().unwrap();
        request.masks.source = "files:masks".parse().unwrap();
        request.poses = Poses::File("poses.txt".into());
        request.fixes = Some("survey.csv".into());
        request.input.ignore_mask = Some("bonnet.png".into());
        request.storage.continues = Some("old".into());
        request.exports.instances = Some("saved".into());
        let inputs = request.inputs();
        for name in [
            "recording",
            "old",
            "left.yaml",
            "right.yaml",
            "imu.csv",
            "camchain.yaml",
            "depth",
            "masks",
            "poses.txt",
            "survey.csv",
            "bonnet.png",
        ] {
            assert!(inputs.iter().any(|path| path.ends_with(name)), "{name}: {inputs:?}");
        }
        // The folder of saved masks is an output.
        assert_eq!(inputs.len(), 11, "{inputs:?}");
        assert_eq!(request.saved_folders().count(), 1);
    }
}
