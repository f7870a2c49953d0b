//! Size to which raw pairs are rectified.

use dynvox_core::rectify::Sizing;
use dynvox_core::settings::{Range, Setting, Value::Number};
use serde::{Deserialize, Serialize};

/// Widest and highest image that raw pairs are rectified to unless a size is given: wider and
/// higher ones cost time and show nothing that was not seen.
pub const LARGEST_PX: [u32; 2] = [1_920, 1_088];

/// Size to which raw pairs are rectified. Without one it is the calibration's own, else the largest
/// rectangle that both cameras see whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RectifiedSize {
    /// Width, px; with `height_px` or not at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width_px: Option<u32>,
    /// Height, px.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_px: Option<u32>,
    /// Focal length, px, with a size only; the least that leaves no pixel without image when
    /// absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_px: Option<f64>,
}

type Row = Setting<RectifiedSize>;

impl RectifiedSize {
    /// Least side, px.
    const LEAST_PX: u32 = 32;
    /// Largest side, px.
    const MAX_PX: u32 = 4_096;

    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("rectify.width_px", "px", |c| Number(c.width_px.map(f64::from)))
            .range(Range::Within(Self::LEAST_PX as f32, Self::MAX_PX as f32))
            .text("Width of rectified images; with `height_px` or not at all."),
        Row::user("rectify.height_px", "px", |c| Number(c.height_px.map(f64::from)))
            .range(Range::Within(Self::LEAST_PX as f32, Self::MAX_PX as f32))
            .text("Height of rectified images."),
        Row::user("rectify.focal_px", "px", |c| Number(c.focal_px)).range(Range::POSITIVE).text(
            "Focal length of rectified images, with a size only; the least that leaves no pixel \
             without image when absent.",
        ),
    ];

    /// The core's own, or what is wrong, in one sentence.
    ///
    /// # Errors
    /// Sizes out of range, or one figure without the other.
    pub fn sizing(&self) -> Result<Sizing, String> {
        let sides = Self::LEAST_PX..=Self::MAX_PX;
        match (self.width_px, self.height_px, self.focal_px) {
            (None, None, None) => {
                let [max_width, max_height] = LARGEST_PX;
                Ok(Sizing::Automatic { max_width, max_height })
            }
            (Some(width), Some(height), _)
                if !(sides.contains(&width) && sides.contains(&height)) =>
            {
                Err(format!(
                    "the rectified size {width} x {height} px must lie within {} to {} px a side",
                    Self::LEAST_PX,
                    Self::MAX_PX
                ))
            }
            (Some(_), Some(_), Some(focal_px)) if !(focal_px.is_finite() && focal_px > 0.0) => {
                Err(format!("the rectified focal length {focal_px} px must be a positive number"))
            }
            (Some(width), Some(height), focal_px) => Ok(Sizing::Given { width, height, focal_px }),
            (None, None, Some(_)) => {
                Err("a rectified focal length needs a rectified size".to_owned())
            }
            _ => Err("a rectified size needs width and height".to_owned()),
        }
    }
}
