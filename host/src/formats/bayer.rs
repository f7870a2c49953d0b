//! Mosaics of colour filters: each pixel has seen one colour.

use super::Image;
use super::picture::Picture;
use serde::{Deserialize, Serialize};

/// Rows and columns looked at to tell a mosaic: every so many.
const STRIDE: usize = 3;
/// Difference of neighbours compared with that of pixels two apart, above which a picture is a
/// mosaic. In pictures of anything else neighbours are more alike.
const MOSAIC_RATIO: f64 = 1.25;
/// Difference of neighbours below which a picture says nothing, in shares of its range.
const MIN_SHARE: f64 = 0.01;

/// Colours of the square of two by two pixels that repeats, row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum BayerPattern {
    /// Red, green; green, blue.
    Rggb,
    /// Green, red; blue, green.
    Grbg,
    /// Green, blue; red, green.
    Gbrg,
    /// Blue, green; green, red.
    Bggr,
}

impl BayerPattern {
    /// The pattern of a name: `rggb`.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "rggb" => Self::Rggb,
            "grbg" => Self::Grbg,
            "gbrg" => Self::Gbrg,
            "bggr" => Self::Bggr,
            _ => return None,
        })
    }

    /// Column and row of the red pixel.
    fn red(self) -> (usize, usize) {
        match self {
            Self::Rggb => (0, 0),
            Self::Grbg => (1, 0),
            Self::Gbrg => (0, 1),
            Self::Bggr => (1, 1),
        }
    }
}

/// A sample of 8 or 16 bit.
pub trait Sample: Copy + Default + Into<u32> {
    /// The mean of samples, by their sum and number.
    fn mean(sum: u32, count: u32) -> Self;
}

impl Sample for u8 {
    fn mean(sum: u32, count: u32) -> Self {
        (sum / count.max(1)) as Self
    }
}

impl Sample for u16 {
    fn mean(sum: u32, count: u32) -> Self {
        (sum / count.max(1)) as Self
    }
}

impl Picture {
    /// The picture in colour, of a grey one that is a mosaic.
    ///
    /// # Errors
    /// It is in colour already. The reason completes a sentence that begins with the picture.
    pub fn demosaiced(self, pattern: BayerPattern) -> Result<Self, String> {
        let picture = match &self {
            Self::Grey(image) => colours(image, pattern).map(Self::Colour),
            Self::DeepGrey(image) => colours(image, pattern).map(Self::DeepColour),
            Self::Colour(_) | Self::DeepColour(_) => {
                return Err("it is in colour, so that --bayer says nothing of it".to_owned());
            }
        };
        picture.ok_or_else(|| "it has no pixels".to_owned())
    }

    /// Note for a grey picture that is surely a mosaic.
    pub fn mosaic_note(&self) -> Option<String> {
        let patterns = names(self.mosaic()?);
        Some(format!(
            "the images look like mosaics of colour filters: --bayer {patterns} makes colours of \
             them (red and blue cannot be told apart)"
        ))
    }

    /// The two patterns that a grey picture may have if it is surely a mosaic. Red and blue look
    /// alike in it.
    pub fn mosaic(&self) -> Option<[BayerPattern; 2]> {
        match self {
            Self::Grey(image) => mosaic_of(image),
            Self::DeepGrey(image) => mosaic_of(image),
            Self::Colour(_) | Self::DeepColour(_) => None,
        }
    }
}

fn names([first, second]: [BayerPattern; 2]) -> String {
    let name = |pattern: BayerPattern| format!("{pattern:?}").to_lowercase();
    format!("{} or {}", name(first), name(second))
}

fn colours<T: Sample>(image: &Image<T>, pattern: BayerPattern) -> Option<Image<[T; 3]>> {
    let size = (image.width(), image.height());
    Image::new(size.0, size.1, demosaiced(image.pixels(), size, pattern))
}

/// Colours of a mosaic: each the mean of the pixel's neighbours of that colour, itself included.
pub fn demosaiced<T: Sample>(
    samples: &[T],
    (width, height): (usize, usize),
    pattern: BayerPattern,
) -> Vec<[T; 3]> {
    let (red_u, red_v) = pattern.red();
    let channel = |u: usize, v: usize| match ((u + red_u) % 2, (v + red_v) % 2) {
        (0, 0) => 0,
        (1, 1) => 2,
        _ => 1,
    };
    let pixel = |u: usize, v: usize| {
        let own = channel(u, v);
        let (mut sums, mut counts) = ([0u32; 3], [0u32; 3]);
        for v in v.saturating_sub(1)..(v + 2).min(height) {
            for u in u.saturating_sub(1)..(u + 2).min(width) {
                let at = channel(u, v);
                sums[at] += samples.get(v * width + u).copied().unwrap_or_default().into();
                counts[at] += 1;
            }
        }
        let mut rgb = [T::default(); 3];
        for (at, value) in rgb.iter_mut().enumerate() {
            *value = T::mean(sums[at], counts[at]);
        }
        rgb[own] = samples.get(v * width + u).copied().unwrap_or_default();
        rgb
    };
    (0..height).flat_map(|v| (0..width).map(move |u| (u, v))).map(|(u, v)| pixel(u, v)).collect()
}

/// Differences of pixels at some distances.
#[derive(Default)]
struct Differences {
    /// Sum over neighbours in a row or column.
    near: f64,
    /// Sum over pixels two apart in a row or column.
    far: f64,
    /// Sums over both diagonals of squares, by the parity of the first pixel's column and row.
    diagonal: [f64; 2],
    count: f64,
}

fn mosaic_of<T: Sample>(image: &Image<T>) -> Option<[BayerPattern; 2]> {
    let (width, height) = (image.width(), image.height());
    let at = |u: usize, v: usize| {
        let sample: u32 = image.get(u, v).unwrap_or_default().into();
        f64::from(sample)
    };
    let mut sums = Differences::default();
    let mut largest = 0.0;
    for v in (0..height.saturating_sub(2)).step_by(STRIDE) {
        for u in (0..width.saturating_sub(2)).step_by(STRIDE) {
            let here = at(u, v);
            largest = if here > largest { here } else { largest };
            sums.near += (here - at(u + 1, v)).abs() + (here - at(u, v + 1)).abs();
            sums.far += (here - at(u + 2, v)).abs() + (here - at(u, v + 2)).abs();
            let even = (u + v) % 2;
            sums.diagonal[even] += (here - at(u + 1, v + 1)).abs();
            sums.diagonal[1 - even] += (at(u + 1, v) - at(u, v + 1)).abs();
            sums.count += 2.0;
        }
    }
    let sure = sums.near > MOSAIC_RATIO * sums.far && sums.near > MIN_SHARE * largest * sums.count;
    // Both greens of a square are alike, red and blue are not.
    let [main, other] = sums.diagonal;
    sure.then_some(if main < other {
        [BayerPattern::Grbg, BayerPattern::Gbrg]
    } else {
        [BayerPattern::Rggb, BayerPattern::Bggr]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [BayerPattern; 4] =
        [BayerPattern::Rggb, BayerPattern::Grbg, BayerPattern::Gbrg, BayerPattern::Bggr];

    /// A smooth picture in colour, and the mosaic that a camera sees of it.
    fn mosaic(pattern: BayerPattern) -> (impl Fn(usize, usize) -> [u16; 3], Image<u16>) {
        let colour = |u: usize, v: usize| {
            [900 + 12 * u as u16, 2_000 + 9 * v as u16, 300 + 4 * (u + v) as u16]
        };
        let (red_u, red_v) = pattern.red();
        let seen = |u: usize, v: usize| {
            let channel = match ((u + red_u) % 2, (v + red_v) % 2) {
                (0, 0) => 0,
                (1, 1) => 2,
                _ => 1,
            };
            colour(u, v)[channel]
        };
        let pixels = (0..30 * 40).map(|at| seen(at % 40, at / 40)).collect();
        (colour, Image::new(40, 30, pixels).unwrap())
    }

    #[test]
    fn colours_of_a_mosaic_are_those_of_the_scene() {
        for pattern in ALL {
            let (colour, image) = mosaic(pattern);
            let Ok(Picture::DeepColour(seen)) = Picture::DeepGrey(image).demosaiced(pattern) else {
                panic!("{pattern:?} has no colours")
            };
            for (u, v) in [(1, 1), (20, 17), (7, 12), (38, 28)] {
                let (seen, scene) = (seen.get(u, v).unwrap(), colour(u, v));
                let apart = seen.iter().zip(scene).map(|(a, b)| a.abs_diff(b)).max();
                assert!(apart <= Some(24), "{pattern:?} at {u}, {v}: {seen:?} for {scene:?}");
            }
        }
    }

    #[test]
    fn a_mosaic_is_told_from_other_pictures_and_its_greens_from_red_and_blue() {
        for pattern in ALL {
            let (_, image) = mosaic(pattern);
            let found = Picture::DeepGrey(image).mosaic().unwrap();
            assert!(found.contains(&pattern), "{pattern:?}: {found:?}");
        }
        let grey = |value: fn(usize, usize) -> usize| {
            let pixels = (0..30 * 40).map(|at| value(at % 40, at / 40) as u8).collect();
            Picture::Grey(Image::new(40, 30, pixels).unwrap())
        };
        let mut random = dynvox_core::random::Random::new(3);
        let noise = (0..30 * 40).map(|_| random.below(256) as u8).collect();
        for (what, picture) in [
            ("black", grey(|_, _| 0)),
            ("a slope", grey(|u, v| 3 * u + v)),
            ("stripes", grey(|u, _| 200 * (u / 3 % 2))),
            ("a weak pattern of noise", grey(|u, v| 200 + (u + v) % 2)),
            ("noise", Picture::Grey(Image::new(40, 30, noise).unwrap())),
        ] {
            assert_eq!(picture.mosaic(), None, "{what}");
        }
    }

    #[test]
    fn a_picture_in_colour_is_no_mosaic() {
        let colour = Picture::Colour(Image::new(2, 2, vec![[1, 2, 3]; 4]).unwrap());
        assert_eq!(colour.mosaic(), None);
        let refused = colour.demosaiced(BayerPattern::Rggb).unwrap_err();
        assert!(refused.contains("in colour"), "{refused}");
    }
}
