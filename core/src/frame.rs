//! What the mapper takes, frame by frame.

use crate::{geometry::Transform, image::View, instances::Detection};

/// One stereo frame as the core takes it: rectified, equal sizes, 8 bit.
#[derive(Clone, Copy, Debug)]
pub struct StereoFrame<'a> {
    /// Left grey image.
    pub left: View<'a, u8>,
    /// Right grey image.
    pub right: View<'a, u8>,
    /// Left image in colour, for fusion; grey is fused where it is absent.
    pub colour: Option<View<'a, [u8; 3]>>,
    /// Semantic class of each left pixel, an index into `VolumeConfig::class_weight`; all weights are 1 where it is absent.
    pub class: Option<View<'a, u8>>,
    /// Disparity of each left pixel in 1/256 px, 0 none, from elsewhere: it takes the place of the pair's own. Motion still needs both
    /// images. Values no pair of this width can have are refused and counted.
    pub disparity_q8: Option<View<'a, u16>>,
    /// Where the left camera is, camera to world, from elsewhere: it takes the place of the camera's own egomotion. Give it with every frame,
    /// in one world.
    pub t_world_camera: Option<Transform>,
    /// What a detector saw in the left image, in any order; empty where there is none.
    pub detections: &'a [Detection<'a>],
}
