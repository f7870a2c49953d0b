//! The size raw pairs are rectified to, on the command line.

use crate::formats::calibration::RectifiedSize;
use crate::request::ImageSize;

#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct RectifiedArgs {
    /// Size raw pairs are rectified to
    /// [default: the calibration's own, else all that both cameras see, at most 1920x1088]
    #[arg(long, value_name = "WxH")]
    rectified: Option<ImageSize>,
    /// Focal length raw pairs are rectified to, px
    /// [default: the least that leaves no pixel without image]
    #[arg(long, value_name = "PX", requires = "rectified")]
    rectified_focal: Option<f64>,
}

impl RectifiedArgs {
    /// These arguments over the size of the settings.
    pub fn over(self, settings: RectifiedSize) -> RectifiedSize {
        let Some(ImageSize(width, height)) = self.rectified else { return settings };
        let side = |side: usize| Some(u32::try_from(side).unwrap_or(u32::MAX));
        RectifiedSize {
            width_px: side(width),
            height_px: side(height),
            focal_px: self.rectified_focal.or(settings.focal_px),
        }
    }
}
