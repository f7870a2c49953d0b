//! Where masks come from, and the folder that a run saves them to.

use crate::input::masks::{self, MaskChoice};
use crate::input::{FrameSource, InputError};
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct InstancesArgs {
    /// Source of instance masks: auto (files where the data set has them, and motion), motion
    /// (moving objects are found by their motion alone), none, files:DIR (PNG and list), mots:DIR
    /// or FILE (KITTI-MOTS), mnc:DIR, coco:FILE, yolo:DIR, boxes:FILE (KITTI labels, MOT), ids:DIR
    /// (PNG of numbers), onnx:FILE[,FILE] (networks), exact or noisy[:SEED] (the synthetic street)
    #[arg(long, default_value = "auto", value_name = "SOURCE")]
    pub instances: MaskChoice,
    /// Take masks in every K-th frame of the data set alone, as of a slow network; tracks carry on
    /// in between
    #[arg(long, default_value = "1", value_name = "K")]
    instances_every: NonZeroUsize,
    /// Save every frame's instance masks to a new folder, for --instances files:DIR; those found by
    /// motion go to DIR/motion
    #[arg(long, value_name = "DIR", conflicts_with_all = ["snapshot_every", "scale"])]
    pub save_instances: Option<PathBuf>,
}

impl InstancesArgs {
    /// Lays the masks over a data set.
    pub fn attach(
        &self,
        dataset: Box<dyn FrameSource>,
    ) -> Result<Box<dyn FrameSource>, InputError> {
        masks::attach(dataset, &self.instances, self.instances_every)
    }

    /// Whether the masks are found by the mapper, if at all.
    pub fn need_no_recording(&self) -> bool {
        matches!(self.instances, MaskChoice::Auto | MaskChoice::None | MaskChoice::Motion)
    }

    /// Whether the masks come with a stream's pairs, or of them.
    pub fn fits_stream(&self) -> bool {
        matches!(
            self.instances,
            MaskChoice::Auto | MaskChoice::None | MaskChoice::Motion | MaskChoice::Networks(_)
        )
    }
}
