//! Position of a camera that was lost: found again in the map's current segment, or at the origin
//! of another one.
//!
//! The guessed pose is refined by registering the frame's depth with the map (ICP, twice). The pose
//! from which the map has most of the image's edges is believed if it has enough of them, and fewer
//! half a metre ahead and behind, and two degrees around what is shown: between façades depth alone
//! does not hold a camera along the street, and a small part of the view lets it circle. Without
//! colour in the map no pose is believed.
//!
//! **Time.** Seven raycasts and two registrations, in the one frame that ends a loss. **Memory.**
//! The raycaster's.

use super::{localization::Localization, matched::MatchedFrame, static_map::StaticMap, work};
use crate::{
    egomotion::icp::{IcpConfig, IcpStatus},
    geometry::Transform,
    image::View,
    parallel::Executor,
};

/// Distance over which brightness is compared, px: wider than what fusion blurs.
const EDGE_PX: usize = 4;
/// Least correlation of edges. Right poses have 0.16 to 0.74 on 06 and r1405, those half a metre
/// aside up to 0.29.
const CORRELATION_MIN: f64 = 0.25;
/// Distance ahead and behind at which the map must look less like the image, m.
const ASIDE_M: f64 = 0.5;
/// Angle around what the map shows, to the left and to the right, at which it must, rad.
const ASIDE_RAD: f64 = 0.04;
/// Factor on signal to noise by which it must look less like it. Small images change little over
/// half a metre.
const SIGNAL_FACTOR: f64 = 1.07;
/// Least share of the image that the map must show.
const SHOWN_MIN: f64 = 0.1;
/// Registration with the map: a guess is off by more than a frame's motion, and much of the view
/// may be new.
const REGISTRATION: IcpConfig = IcpConfig {
    levels: 3,
    steps: 10,
    distance_m: 0.1,
    noise_px: 0.3,
    pairs_min: 0.5,
    step_max_m: 2.0,
};

impl Localization<'_> {
    /// Ends a loss after a motion was estimated: the camera is found, or a segment begins. Returns
    /// whether it is found. Where no map is yet, the guess is as good as any pose.
    pub(super) fn end_loss<E: Executor>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        static_map: &mut StaticMap<'_>,
        executor: &E,
    ) -> bool {
        if static_map.volume.pool().is_empty() {
            return false;
        }
        let found = static_map.relocalize(seen, self.camera.t_world_camera(), executor);
        // Found: the old segment goes on. Not found: another begins.
        match &found {
            Some(t_world_camera) => self.camera.relocalize(t_world_camera),
            None => self.camera.begin_segment(),
        }
        found.is_some()
    }
}

impl StaticMap<'_> {
    /// Finds the pose near a guessed one from which the map looks like the image.
    fn relocalize<E: Executor>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        guess: &Transform,
        executor: &E,
    ) -> Option<Transform> {
        let mut t_world_camera = *guess;
        let mut correlation = self.correlation_at(seen, &t_world_camera, executor)?;
        // Registration may run off: the best of all steps counts, not the last.
        let mut best = (correlation, t_world_camera, self.mean_depth_m());
        for _ in 0..work::REGISTRATIONS {
            let report = self.register(seen, &REGISTRATION);
            if report.status != IcpStatus::Tracked {
                break;
            }
            t_world_camera = (t_world_camera * report.t_current_previous.inverse()).normalized();
            correlation = self.correlation_at(seen, &t_world_camera, executor).unwrap_or(0.0);
            if correlation > best.0 {
                best = (correlation, t_world_camera, self.mean_depth_m());
            }
        }
        let (correlation, t_world_camera, depth_m) = best;
        // A pose is accepted only if poses a little to each side look less like the image: on a
        // plain wall all look alike.
        let is_less_like = |aside: &Transform| {
            let there =
                self.correlation_at(seen, &(t_world_camera * *aside).normalized(), executor);
            is_clearer(correlation, there.unwrap_or(0.0))
        };
        let ahead = |way_m: f64| Transform::from_translation([0.0, 0.0, way_m]);
        // Turned about the scene's middle, so that the view stays on it.
        let around = |angle_rad: f64| {
            ahead(depth_m) * Transform::new([0.0, angle_rad, 0.0], [0.0; 3]) * ahead(-depth_m)
        };
        let aside: [_; work::POSES_ASIDE] =
            [ahead(ASIDE_M), ahead(-ASIDE_M), around(ASIDE_RAD), around(-ASIDE_RAD)];
        (correlation >= CORRELATION_MIN && aside.iter().all(is_less_like)).then_some(t_world_camera)
    }

    /// Correlation of the map from a pose with the image; `None` where it shows too little of it.
    fn correlation_at<E: Executor>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        t_world_camera: &Transform,
        executor: &E,
    ) -> Option<f64> {
        let is_cast = self.cast(&seen.view(t_world_camera), executor);
        edge_correlation(self.raycaster.colour().filter(|_| is_cast)?, seen.frame.left)
    }

    /// Mean depth of what was cast last, m.
    fn mean_depth_m(&self) -> f64 {
        let depths = self
            .raycaster
            .depth_m()
            .into_iter()
            .flat_map(|depth_m| depth_m.pixels())
            .filter(|depth_m| **depth_m > 0.0);
        let (sum, count) = depths
            .fold((0.0, 0u32), |(sum, count), &depth_m| (sum + f64::from(depth_m), count + 1));
        sum / f64::from(count.max(1))
    }
}

/// Tells that one correlation says that signal to noise is larger by the factor than the other
/// says. Two images of one scene with noise of their own correlate by S / (S + N): near 1 a small
/// step of correlation is a large one of signal to noise.
fn is_clearer(correlation: f64, other: f64) -> bool {
    correlation * (1.0 - other) >= SIGNAL_FACTOR * other * (1.0 - correlation)
}

/// The correlation of brightness differences, across and down, of a picture with a grey image of
/// its size; `None` where the picture, which is black where it shows nothing, has too few.
fn edge_correlation(picture: View<'_, [u8; 3]>, grey: View<'_, u8>) -> Option<f64> {
    let (width, height) = (grey.width(), grey.height());
    let shown = |u: usize, v: usize| {
        let [red, green, blue] = picture.get(u, v)?.map(i64::from);
        // Black shows nothing of the map.
        (red + green + blue > 0).then_some((red + 2 * green + blue) / 4)
    };
    let seen = |u: usize, v: usize| grey.get(u, v).map(i64::from);
    // Sums of one image's differences, the other's, their squares and products: differences are
    // below 2^8, so sums fit.
    let (mut sums, mut squares, mut products, mut count) = ([0i64; 2], [0i64; 2], 0i64, 0i64);
    for v in (EDGE_PX..height.saturating_sub(EDGE_PX)).step_by(2) {
        // A quarter of the pixels is enough for a correlation.
        for u in (EDGE_PX..width.saturating_sub(EDGE_PX)).step_by(2) {
            for (before, after) in
                [([u - EDGE_PX, v], [u + EDGE_PX, v]), ([u, v - EDGE_PX], [u, v + EDGE_PX])]
            {
                let of_map = shown(after[0], after[1])
                    .zip(shown(before[0], before[1]))
                    .map(|(after, before)| after - before);
                let of_image = seen(after[0], after[1])
                    .zip(seen(before[0], before[1]))
                    .map(|(after, before)| after - before);
                let (Some(a), Some(b)) = (of_map, of_image) else { continue };
                sums = [sums[0] + a, sums[1] + b];
                squares = [squares[0] + a * a, squares[1] + b * b];
                products += a * b;
                count += 1;
            }
        }
    }
    // A view that shows little of the map proves nothing.
    let pixels = (width * height / 4) as f64;
    if (count as f64) < 2.0 * SHOWN_MIN * pixels {
        return None;
    }
    let n = count as f64;
    let [a, b] = sums.map(|sum| sum as f64);
    // Pearson's correlation from the sums.
    let variance = [squares[0] as f64 - a * a / n, squares[1] as f64 - b * b / n];
    let scale = libm::sqrt(variance[0] * variance[1]);
    (scale > 0.0).then(|| (products as f64 - a * b / n) / scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const WIDTH: usize = 64;
    const HEIGHT: usize = 32;

    #[test]
    fn a_small_step_of_a_high_correlation_is_clear() {
        assert!(is_clearer(0.7, 0.68) && !is_clearer(0.3, 0.29), "1.1 and 1.05 times the signal");
        assert!(is_clearer(0.3, 0.28) && is_clearer(0.3, -0.2) && !is_clearer(0.68, 0.7));
    }

    #[test]
    fn an_image_is_like_itself_brighter_or_darker_and_unlike_itself_moved() {
        let mut random = Random::new(3);
        // Noise has edges everywhere, so that a shift of 7 px correlates no more.
        let grey: [u8; WIDTH * HEIGHT] = core::array::from_fn(|_| 20 + random.below(100) as u8);
        let picture = |shift: usize, gain: u8| -> [[u8; 3]; WIDTH * HEIGHT] {
            core::array::from_fn(|at| [gain * grey[(at + shift) % (WIDTH * HEIGHT)]; 3])
        };
        let correlation = |pixels: &[[u8; 3]]| {
            let views = (
                View::new(pixels, WIDTH, HEIGHT).unwrap(),
                View::new(&grey, WIDTH, HEIGHT).unwrap(),
            );
            edge_correlation(views.0, views.1)
        };
        assert!(correlation(&picture(0, 1)).unwrap() > 0.999);
        // Twice the brightness has the same edges but for a factor, which the correlation divides
        // out.
        assert!(correlation(&picture(0, 2)).unwrap() > 0.999);
        assert!(correlation(&picture(7, 1)).unwrap().abs() < 0.2);
        assert_eq!(correlation(&[[0; 3]; WIDTH * HEIGHT]), None, "nothing is shown");
        assert_eq!(correlation(&[[90; 3]; WIDTH * HEIGHT]), None, "nothing is to be seen");
    }
}
