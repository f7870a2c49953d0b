//! Two images of a pair in one file: side by side, or one above the other.

use crate::formats::{Decoded, Image};
use serde::{Deserialize, Serialize};

/// Arrangement of two images in one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stacking {
    /// The left image, then the right one.
    SideBySide,
    /// The left image above the right one.
    TopBottom,
}

impl Stacking {
    /// Returns the arrangement as the rest of a sentence.
    pub fn name(self) -> &'static str {
        match self {
            Self::SideBySide => "side by side",
            Self::TopBottom => "one above the other",
        }
    }

    /// The size of each of the two images in one of this size.
    pub fn size_of_one(self, (width, height): (usize, usize)) -> (usize, usize) {
        match self {
            Self::SideBySide => (width / 2, height),
            Self::TopBottom => (width, height / 2),
        }
    }

    /// Cuts an image in two; `None` where that is not even.
    pub fn split(self, both: &Decoded) -> Option<[Decoded; 2]> {
        let [left, right] = self.halves(&both.grey)?;
        let mut decoded =
            [Decoded { grey: left, colour: None }, Decoded { grey: right, colour: None }];
        if let Some(colour) = &both.colour {
            for (half, colour) in decoded.iter_mut().zip(self.halves(colour)?) {
                half.colour = Some(colour);
            }
        }
        Some(decoded)
    }

    fn halves<T: Copy>(self, both: &Image<T>) -> Option<[Image<T>; 2]> {
        let (width, height) = self.size_of_one((both.width(), both.height()));
        let (pixels, stride) = (both.pixels(), both.width());
        match self {
            Self::SideBySide if stride == 2 * width => {
                let half = |from: usize| {
                    let rows = pixels
                        .chunks_exact(stride)
                        .flat_map(|row| row.iter().skip(from).take(width).copied());
                    Image::new(width, height, rows.collect())
                };
                Some([half(0)?, half(width)?])
            }
            Self::TopBottom if both.height() == 2 * height => {
                let (top, bottom) = pixels.split_at_checked(width * height)?;
                Some([
                    Image::new(width, height, top.to_vec())?,
                    Image::new(width, height, bottom.to_vec())?,
                ])
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_images_in_one_come_apart_as_they_were() {
        let both = Decoded {
            grey: Image::new(4, 2, vec![1u8, 2, 3, 4, 5, 6, 7, 8]).unwrap(),
            colour: None,
        };
        let greys = |stacking: Stacking| {
            stacking.split(&both).map(|halves| halves.map(|half| half.grey.pixels().to_vec()))
        };
        assert_eq!(greys(Stacking::SideBySide), Some([vec![1, 2, 5, 6], vec![3, 4, 7, 8]]));
        assert_eq!(greys(Stacking::TopBottom), Some([vec![1, 2, 3, 4], vec![5, 6, 7, 8]]));
        let odd = Decoded { grey: Image::new(3, 1, vec![1u8, 2, 3]).unwrap(), colour: None };
        assert_eq!(Stacking::SideBySide.split(&odd), None);
        assert_eq!(Stacking::TopBottom.split(&odd), None);
    }
}
