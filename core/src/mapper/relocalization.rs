//! Position of a camera that was lost: found again in the map's current segment, or at the origin
//! of another one.
//!
//! The guessed pose is refined by registering the frame's depth with the map (ICP, twice). The pose
//! from which the map has most of the image's edges is believed if it has enough of them, and fewer
//! half a metre ahead and behind, and two degrees around what is shown: between façades depth alone
//! does not hold a camera along the street, and a small part of the view lets it circle. Without
//! colour in the map no pose is believed.
//!
//! **Time.** The search takes four frames with an estimated motion, each compared with the map as
//! it sees it: a registration in each of the first two, poses ahead and behind in the third, poses
//! around in the fourth. A frame takes at most [`PICTURES`] pictures of half the width and height,
//! which is where edges are compared, and a registration at a quarter of it. Until the search ends
//! the pose counts as a guess, and nothing is fused. **Memory.** The raycaster's.

use super::{
    PoseOrigin,
    localization::Localization,
    matched::MatchedFrame,
    search::Search,
    static_map::StaticMap,
    work::{PICTURE_EVERY, PICTURES},
};
use crate::{
    egomotion::icp::{IcpConfig, IcpStatus},
    geometry::Transform,
    image::View,
    parallel::Executor,
};

/// Distance over which brightness is compared, px: wider than what fusion blurs.
const EDGE_PX: usize = 4;
// Both ends of a difference are pixels of the picture.
const _: () = assert!(EDGE_PX.is_multiple_of(PICTURE_EVERY));
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
    /// Takes the next step of the search for a camera that was lost, in a frame whose motion was
    /// estimated. Returns the origin of the pose that follows: the camera is searched for on, is
    /// found, or begins a segment, as it does where the map is still empty.
    pub(super) fn search_on<E: Executor>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        static_map: &mut StaticMap<'_>,
        executor: &E,
    ) -> PoseOrigin {
        let step = core::mem::take(&mut self.search);
        if step == Search::Off {
            return self.origin(true);
        }
        let guess = *self.camera.t_world_camera();
        // A step leads to a pose and to the next step, or ends the search.
        let found = match step {
            Search::Off => None,
            Search::Guess => static_map
                .register_pose(seen, &guess, executor)
                .map(|found| (Search::Registered, found)),
            Search::Registered => static_map
                .register_pose(seen, &guess, executor)
                .filter(|found| found.correlation >= CORRELATION_MIN)
                .map(|found| (Search::Along, found)),
            Search::Along => {
                let aside = |_| [ASIDE_M, -ASIDE_M].map(ahead);
                static_map
                    .confirm_pose(seen, &guess, aside, executor)
                    .map(|found| (Search::Around, found))
            }
            Search::Around => {
                let aside =
                    |depth_m| [ASIDE_RAD, -ASIDE_RAD].map(|angle_rad| around(depth_m, angle_rad));
                static_map
                    .confirm_pose(seen, &guess, aside, executor)
                    .map(|found| (Search::Off, found))
            }
        };
        match found {
            // The pose moves on with the camera until the next step is due.
            Some((next, found)) => {
                self.camera.relocalize(&found.t_world_camera);
                self.search = next;
                if next == Search::Off { PoseOrigin::Relocalized } else { PoseOrigin::Extrapolated }
            }
            None => {
                self.camera.begin_segment();
                self.origin(true)
            }
        }
    }
}

/// Pose, and correlation of the map from it with the image.
struct ComparedPose {
    t_world_camera: Transform,
    correlation: f64,
}

/// A way along the view, m.
fn ahead(way_m: f64) -> Transform {
    Transform::from_translation([0.0, 0.0, way_m])
}

/// A turn about the scene's middle, so that the view stays on it.
fn around(depth_m: f64, angle_rad: f64) -> Transform {
    ahead(depth_m) * Transform::new([0.0, angle_rad, 0.0], [0.0; 3]) * ahead(-depth_m)
}

impl StaticMap<'_> {
    /// Registers the frame's depth with the map from a pose. Returns the pose from which the map
    /// looks more like the image: registration may run off. `None` where the map shows too little.
    fn register_pose<E: Executor>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        guess: &Transform,
        executor: &E,
    ) -> Option<ComparedPose> {
        let guessed = self.compare_pose(seen, guess, executor)?;
        let report = self.register(seen, &REGISTRATION, PICTURE_EVERY);
        if report.status != IcpStatus::Tracked {
            return Some(guessed);
        }
        let t_world_camera = (*guess * report.t_current_previous.inverse()).normalized();
        let registered = self.compare_pose(seen, &t_world_camera, executor);
        Some(registered.filter(|pose| pose.correlation > guessed.correlation).unwrap_or(guessed))
    }

    /// Confirms a pose if the map looks enough like the image from there, and less from two poses
    /// aside: on a plain wall all look alike. Those follow from the mean depth in view, m.
    fn confirm_pose<E: Executor>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        t_world_camera: &Transform,
        aside: impl Fn(f64) -> [Transform; PICTURES - 1],
        executor: &E,
    ) -> Option<ComparedPose> {
        let found = self
            .compare_pose(seen, t_world_camera, executor)
            .filter(|found| found.correlation >= CORRELATION_MIN)?;
        let aside = aside(self.mean_depth_m());
        let is_less_like = |aside: &Transform| {
            let t_world_aside = (*t_world_camera * *aside).normalized();
            let there = self.compare_pose(seen, &t_world_aside, executor);
            is_clearer(found.correlation, there.map_or(0.0, |there| there.correlation))
        };
        aside.iter().all(is_less_like).then_some(found)
    }

    /// Compares the map from a pose with the image; `None` where it shows too little of it.
    fn compare_pose<E: Executor>(
        &mut self,
        seen: &MatchedFrame<'_, '_>,
        t_world_camera: &Transform,
        executor: &E,
    ) -> Option<ComparedPose> {
        let view = seen.view(t_world_camera).thinned(PICTURE_EVERY)?;
        let is_cast = self.cast(&view, executor);
        let picture = self.raycaster.colour().filter(|_| is_cast)?;
        let correlation = edge_correlation(picture, seen.frame.left)?;
        Some(ComparedPose { t_world_camera: *t_world_camera, correlation })
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

/// The correlation of brightness differences, across and down, of a picture that has every
/// [`PICTURE_EVERY`]-th pixel with a grey image; `None` where the picture, which is black where it
/// shows nothing, has too few.
fn edge_correlation(picture: View<'_, [u8; 3]>, grey: View<'_, u8>) -> Option<f64> {
    let (width, height) = (grey.width(), grey.height());
    let shown = |u: usize, v: usize| {
        let [red, green, blue] = picture.get(u / PICTURE_EVERY, v / PICTURE_EVERY)?.map(i64::from);
        // Black shows nothing of the map.
        (red + green + blue > 0).then_some((red + 2 * green + blue) / 4)
    };
    let seen = |u: usize, v: usize| grey.get(u, v).map(i64::from);
    // Sums of one image's differences, the other's, their squares and products: differences are
    // below 2^8, so sums fit.
    let (mut sums, mut squares, mut products, mut count) = ([0i64; 2], [0i64; 2], 0i64, 0i64);
    for v in (EDGE_PX..height.saturating_sub(EDGE_PX)).step_by(PICTURE_EVERY) {
        // A quarter of the pixels is enough for a correlation.
        for u in (EDGE_PX..width.saturating_sub(EDGE_PX)).step_by(PICTURE_EVERY) {
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
        // Of every second column and row.
        let picture = |shift: usize, gain: u8| -> [[u8; 3]; WIDTH * HEIGHT / 4] {
            core::array::from_fn(|at| {
                let (u, v) = (2 * (at % (WIDTH / 2)), 2 * (at / (WIDTH / 2)));
                [gain * grey[(v * WIDTH + u + shift) % (WIDTH * HEIGHT)]; 3]
            })
        };
        let correlation = |pixels: &[[u8; 3]]| {
            let views = (
                View::new(pixels, WIDTH / 2, HEIGHT / 2).unwrap(),
                View::new(&grey, WIDTH, HEIGHT).unwrap(),
            );
            edge_correlation(views.0, views.1)
        };
        assert!(correlation(&picture(0, 1)).unwrap() > 0.999);
        // Twice the brightness has the same edges but for a factor, which the correlation divides
        // out.
        assert!(correlation(&picture(0, 2)).unwrap() > 0.999);
        assert!(correlation(&picture(7, 1)).unwrap().abs() < 0.2);
        assert_eq!(correlation(&[[0; 3]; WIDTH * HEIGHT / 4]), None, "nothing is shown");
        assert_eq!(correlation(&[[90; 3]; WIDTH * HEIGHT / 4]), None, "nothing is to be seen");
    }
}
