//! Sub-pixel refinement: the patch around the feature in the previous left image is found again in
//! the other three images (inverse-compositional Lucas-Kanade; Baker & Matthews, *Lucas-Kanade 20
//! Years On*, IJCV 2004), for translation, gain and offset.
//!
//! Pixels and sums are integers (so their order is free and they vectorise); only the 2 x 2 step is
//! in floats. The patch is sampled at sixteenths of a pixel; the step taken there is not rounded,
//! so the result is finer than the sampling.

use super::matches::Match;
use crate::parallel::Work;

/// Side of a patch, px.
const SIDE: usize = 8;
const HALF: f64 = 4.0;
const AREA: f64 = (SIDE * SIDE) as f64;
/// Most steps per image.
const STEPS: usize = 8;
/// A patch farther than this from where the circle put it is lost, px.
const FARTHEST_PX: f64 = 1.75;
/// A step below this is the last one, px.
pub(super) const SMALL_STEP_PX: f64 = 0.06;
/// Largest last step if a motion was supposed, px: the rest of the way errs towards that motion in
/// every patch alike, and would confirm it.
const GUESSED_STEP_PX: f64 = 0.01;
/// Correlation with the template below which a patch that no descriptor vouches for is another.
const ALIKE_MIN: f64 = 0.8;
/// Smallest eigenvalue of a patch's structure matrix (of doubled gradients) below which it cannot
/// be placed.
const TEXTURE_MIN: f64 = 2_000.0;

/// The middle of the patch around a pixel, px: the patch reaches a pixel farther up and to the
/// left. As the camera comes nearer a patch grows about its middle, so that the middle alone stays
/// the same scene point; the pixel would move off it by half a pixel's share of that growth.
pub(super) fn middle(pixel: [f32; 2]) -> [f32; 2] {
    pixel.map(|px| px - 0.5)
}

/// One whole image, rows `width` apart.
#[derive(Clone, Copy)]
pub(super) struct Pixels<'a> {
    pub data: &'a [u8],
    pub width: usize,
}

/// A patch, its gradients and what is needed to solve for its movement.
pub(super) struct Template {
    pixel: [[i16; SIDE]; SIDE],
    along: [[i16; SIDE]; SIDE],
    down: [[i16; SIDE]; SIDE],
    /// Mean of pixel, along, down.
    mean: [f64; 3],
    /// Share of the pixels' own pattern in each gradient: gain must not look like movement.
    share: [f64; 2],
    /// Inverse of the structure matrix: uu, uv, vv.
    inverse: [f64; 3],
    /// Smaller eigenvalue of the gradients' matrix.
    texture: f64,
    /// Sum of squares of the pixels about their mean.
    pattern: f64,
}

#[inline(always)]
fn sum_products(a: &[[i16; SIDE]; SIDE], b: &[[i16; SIDE]; SIDE]) -> i32 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(&a, &b)| i32::from(a) * i32::from(b)).sum()
}

#[inline(always)]
fn sum(a: &[[i16; SIDE]; SIDE]) -> i32 {
    a.as_flattened().iter().map(|&a| i32::from(a)).sum()
}

impl Template {
    /// The patch centred on pixel (u, v); `None` too near the border or where nothing can be
    /// placed.
    pub(super) fn extract(image: Pixels<'_>, u: usize, v: usize) -> Option<Self> {
        // Gradients need one more pixel around the patch.
        let (left, top) = (u.checked_sub(SIDE / 2 + 1)?, v.checked_sub(SIDE / 2 + 1)?);
        if left + SIDE + 2 > image.width {
            return None;
        }
        let row = |y: usize| image.data.get((top + y) * image.width + left..)?.get(..SIDE + 2);
        let (mut pixel, mut along, mut down) =
            ([[0; SIDE]; SIDE], [[0; SIDE]; SIDE], [[0; SIDE]; SIDE]);
        for (y, ((pixel, along), down)) in
            pixel.iter_mut().zip(&mut along).zip(&mut down).enumerate()
        {
            let (above, here, below) = (row(y)?, row(y + 1)?, row(y + 2)?);
            for (((pixel, along), down), ((above, here), below)) in pixel
                .iter_mut()
                .zip(along)
                .zip(down)
                .zip(above.get(1..)?.iter().zip(here.windows(3)).zip(below.get(1..)?))
            {
                if let [before, here, after] = *here {
                    *pixel = i16::from(here);
                    *along = i16::from(after) - i16::from(before);
                    *down = i16::from(*below) - i16::from(*above);
                }
            }
        }
        // Gain and offset between images are removed by regression on the patch's own pattern.
        let mean = [sum(&pixel), sum(&along), sum(&down)].map(|sum| f64::from(sum) / AREA);
        let spread =
            |a, b, mean_a: f64, mean_b: f64| f64::from(sum_products(a, b)) - AREA * mean_a * mean_b;
        let pattern = spread(&pixel, &pixel, mean[0], mean[0]);
        if pattern <= 0.0 {
            return None;
        }
        let with =
            [spread(&pixel, &along, mean[0], mean[1]), spread(&pixel, &down, mean[0], mean[2])];
        // What is left of the gradients after that regression determines the shift.
        let uu = spread(&along, &along, mean[1], mean[1]) - with[0] * with[0] / pattern;
        let uv = spread(&along, &down, mean[1], mean[2]) - with[0] * with[1] / pattern;
        let vv = spread(&down, &down, mean[2], mean[2]) - with[1] * with[1] / pattern;
        // The smaller eigenvalue is large only where both directions have texture.
        let determinant = uu * vv - uv * uv;
        let texture = 0.5 * (uu + vv - libm::sqrt((uu - vv) * (uu - vv) + 4.0 * uv * uv));
        if !(texture > TEXTURE_MIN && determinant > 0.0) {
            return None;
        }
        let inverse = [vv / determinant, -uv / determinant, uu / determinant];
        Some(Self {
            pixel,
            along,
            down,
            mean,
            share: with.map(|with| with / pattern),
            inverse,
            texture,
            pattern,
        })
    }

    /// Finds the patch in another image, beginning at (u, v); the first step below `small_step_px`
    /// is the last one.
    #[inline(always)]
    pub(super) fn find(
        &self,
        image: Pixels<'_>,
        [u, v]: [f32; 2],
        small_step_px: f64,
    ) -> Option<[f32; 2]> {
        let begin = [f64::from(u), f64::from(v)];
        let mut at = begin;
        for _ in 0..STEPS {
            // Sixteenths of a pixel of the patch's corner; begin is an integer inside the image and
            // `at` within 2 px of it.
            let corner = at.map(|x| libm::floor(16.0 * (x - HALF) + 0.5) as i32);
            // One step of inverse composition: the template's gradients are reused.
            let error = self.error(image, corner)?;
            let step = self.step(&error);
            let next = [
                f64::from(corner[0]) / 16.0 + HALF - step[0],
                f64::from(corner[1]) / 16.0 + HALF - step[1],
            ];
            let step_squared =
                (next[0] - at[0]) * (next[0] - at[0]) + (next[1] - at[1]) * (next[1] - at[1]);
            // A patch that wanders off has found another one.
            let far = |i: usize| {
                libm::fabs(
                    next.get(i).copied().unwrap_or(0.0) - begin.get(i).copied().unwrap_or(0.0),
                )
            };
            if !(far(0) <= FARTHEST_PX && far(1) <= FARTHEST_PX) {
                return None;
            }
            at = next;
            if step_squared < small_step_px * small_step_px {
                return Some(at.map(|x| x as f32));
            }
        }
        None
    }

    /// The middle of the patch near a position in another image, found with the shortest last step;
    /// `None` where it is lost, or what is found is not alike.
    #[inline(never)]
    pub(super) fn find_alike(&self, image: Pixels<'_>, at: [f32; 2]) -> Option<[f32; 2]> {
        self.find(image, at, GUESSED_STEP_PX).filter(|&at| self.is_alike(image, at)).map(middle)
    }

    /// The middles of the patch in three other images; `None` where it is lost in one.
    #[inline(always)]
    fn find_all(&self, sought: [(Pixels<'_>, [f32; 2]); 3]) -> Option<[[f32; 2]; 3]> {
        let mut found = [[0.0; 2]; 3];
        for (found, (image, at)) in found.iter_mut().zip(sought) {
            *found = middle(self.find(image, at, SMALL_STEP_PX)?);
        }
        Some(found)
    }

    /// Returns true if another image shows the patch at a position: its pattern there must be the
    /// template's, independent of brightness and contrast.
    fn is_alike(&self, image: Pixels<'_>, at: [f32; 2]) -> bool {
        let corner = at.map(|x| libm::floor(16.0 * (f64::from(x) - HALF) + 0.5) as i32);
        let Some(error) = self.error(image, corner) else { return false };
        let total = f64::from(sum(&error));
        let with = (f64::from(sum_products(&self.pixel, &error)) - self.mean[0] * total) / 32.0;
        // Not by `sum_products`: a square of 13 bits, 64 times over, is 32 bits.
        let squares: f64 =
            error.as_flattened().iter().map(|&error| f64::from(error) * f64::from(error)).sum();
        let own = (squares - total * total / AREA) / 1024.0;
        // Covariance with the template, and the patch's own variance.
        let (both, there) = (self.pattern + with, self.pattern + 2.0 * with + own);
        both > 0.0 && both * both > ALIKE_MIN * ALIKE_MIN * self.pattern * there
    }

    /// The image minus the template, in 1/32 grey levels, with the patch's corner at `corner`
    /// sixteenths of a pixel.
    #[inline(always)]
    fn error(&self, image: Pixels<'_>, corner: [i32; 2]) -> Option<[[i16; SIDE]; SIDE]> {
        let (left, top) =
            (usize::try_from(corner[0] >> 4).ok()?, usize::try_from(corner[1] >> 4).ok()?);
        let (along, down) = ((corner[0] & 15) as u16, (corner[1] & 15) as u16);
        if left + SIDE + 1 > image.width {
            return None;
        }
        // Bilinear in sixteenths of a pixel: first along each row, then down.
        let mut rows = image.data.get(top * image.width + left..)?.chunks(image.width.max(1));
        let mut blend = || -> Option<[u16; SIDE]> {
            let row = rows.next()?.get(..SIDE + 1)?;
            let mut out = [0; SIDE];
            for ((out, &a), &b) in out.iter_mut().zip(row).zip(row.get(1..)?) {
                *out = u16::from(a) * (16 - along) + u16::from(b) * along;
            }
            Some(out)
        };
        let mut above = blend()?;
        let mut error = [[0; SIDE]; SIDE];
        for (error, pixel) in error.iter_mut().zip(&self.pixel) {
            let below = blend()?;
            for (((error, &pixel), &a), &b) in error.iter_mut().zip(pixel).zip(&above).zip(&below) {
                // At most 255 x 256 / 8 = 8,160 either way, which fits 16 bits.
                *error = ((a * (16 - down) + b * down) >> 3) as i16 - 32 * pixel;
            }
            above = below;
        }
        Some(error)
    }

    /// Returns the step of the template that explains the error, px.
    #[inline(always)]
    fn step(&self, error: &[[i16; SIDE]; SIDE]) -> [f64; 2] {
        let total = f64::from(sum(error));
        let pattern = f64::from(sum_products(&self.pixel, error)) - self.mean[0] * total;
        let along = f64::from(sum_products(&self.along, error))
            - self.mean[1] * total
            - self.share[0] * pattern;
        let down = f64::from(sum_products(&self.down, error))
            - self.mean[2] * total
            - self.share[1] * pattern;
        // Gradients are doubled and errors in 1/32 grey levels.
        let scale = 2.0 / 32.0;
        [
            scale * (self.inverse[0] * along + self.inverse[1] * down),
            scale * (self.inverse[1] * along + self.inverse[2] * down),
        ]
    }
}

/// The patch around a match's current left position, which is a whole pixel, found again near where
/// the match says it is in the other three images; `None` where it is lost.
pub(super) fn find_back(m: &Match, images: Images<'_>) -> Option<Match> {
    let [u, v] = m.current_left.map(|x| x as usize);
    let template = Template::extract(images.current_left, u, v)?;
    let find = |image, at| template.find_alike(image, at);
    let found = Match {
        previous_left: find(images.previous_left, m.previous_left)?,
        previous_right: find(images.previous_right, m.previous_right)?,
        current_left: middle(m.current_left),
        current_right: find(images.current_right, m.current_right)?,
    };
    // Without a positive disparity the point would lie at infinity or behind the camera.
    let valid = found.previous_disparity_px() > 0.0 && found.current_disparity_px() > 0.0;
    valid.then_some(found)
}

/// The four images.
#[derive(Clone, Copy)]
pub(super) struct Images<'a> {
    pub previous_left: Pixels<'a>,
    pub previous_right: Pixels<'a>,
    pub current_left: Pixels<'a>,
    pub current_right: Pixels<'a>,
}

/// Refines those of a band's matches that are supported.
pub(super) struct RefineSupported<'a> {
    pub images: Images<'a>,
    pub matches: &'a mut [Match],
    /// 1 where a match is supported; 0 afterwards where its patch is lost.
    pub supported: &'a mut [u8],
    /// Scores of the matches: how precisely each can be placed.
    pub score: &'a mut [f32],
}

impl Work for RefineSupported<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let all = self.matches.iter_mut().zip(self.supported).zip(self.score);
        // Without support a match is not worth refining.
        for ((m, supported), score) in all.filter(|((_, supported), _)| **supported == 1) {
            *score = 0.0;
            match refine(m, self.images) {
                Some(better) => (*m, *score) = better,
                // A match that cannot be refined counts as unsupported.
                None => *supported = 0,
            }
        }
    }
}

/// Refines one match that is still at whole pixels. Returns it with its texture (the better it can
/// be placed, the larger), or `None` when the patch is lost in one of the images or loses its
/// positive disparity.
#[inline(always)]
pub(super) fn refine(m: &Match, images: Images<'_>) -> Option<(Match, f32)> {
    let [u, v] = m.previous_left.map(|x| x as usize);
    let template = Template::extract(images.previous_left, u, v)?;
    let sought = [
        (images.previous_right, m.previous_right),
        (images.current_left, m.current_left),
        (images.current_right, m.current_right),
    ];
    let [previous_right, current_left, current_right] = template.find_all(sought)?;
    let refined = Match {
        previous_left: middle(m.previous_left),
        previous_right,
        current_left,
        current_right,
    };
    // Without a positive disparity the point would lie at infinity or behind the camera.
    let valid = refined.previous_disparity_px() > 0.0 && refined.current_disparity_px() > 0.0;
    valid.then_some((refined, template.texture as f32))
}
