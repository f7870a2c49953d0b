//! The street's reference line (the middle of the camera's lane): heading in closed form, position
//! by Gauss–Legendre quadrature.
//!
//! The heading is a bounded sum of sines, so that the street never meets itself however long it
//! gets. Positions are summed from the street's start segment by segment in one order: any frame,
//! asked for alone, finds the same bits.

use std::sync::{Mutex, PoisonError};

use dynvox_core::geometry::Transform;
use nalgebra::Vector3;

use super::config::StreetConfig;
use super::random::Rng;

/// Length of one segment of street, m: what is generated, cached and dropped together.
pub const SEGMENT_M: f64 = 24.0;

/// Length of a hill and the valley behind it, m.
const HILL_M: f64 = 60.0;

const TURN: f64 = 2.0 * core::f64::consts::PI;
const AMPLITUDE_RAD: [f64; 2] = [0.42, 0.15];
const WAVELENGTH_M: [f64; 2] = [330.0, 141.0];
/// Five-point rule on -1..1: abscissae and weights.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// The line's shape.
#[derive(Debug)]
pub struct Centerline {
    amplitude_rad: [f64; 2],
    phase_rad: [f64; 2],
    /// Steepest rise; 0 is level.
    hills: f64,
    /// A segment already walked to and its start: driving on costs nothing more. The sum is the
    /// same from there as from the start.
    walked: Mutex<(i64, Vector3<f64>)>,
}

impl Centerline {
    /// The centerline of a configured street.
    pub fn new(config: &StreetConfig) -> Self {
        let mut rng = Rng::new(config.seed, 0x0C0_0125E, 0);
        let amplitude_rad = if config.curvature { AMPLITUDE_RAD } else { [0.0; 2] };
        Self {
            amplitude_rad,
            phase_rad: [TURN * rng.unit(), TURN * rng.unit()],
            hills: config.hills,
            walked: Mutex::default(),
        }
    }

    /// Heading at arc length `s_m`, rad, positive to the right; 0 at the start.
    pub fn heading_rad(&self, s_m: f64) -> f64 {
        let wave = |k: usize| {
            let phase = self.phase_rad[k];
            self.amplitude_rad[k]
                * (libm::sin(TURN * s_m / WAVELENGTH_M[k] + phase) - libm::sin(phase))
        };
        if self.amplitude_rad[0] == 0.0 { 0.0 } else { wave(0) + wave(1) }
    }

    /// Height of the road over the street's start, m, and its rise: 0 both at the start.
    pub fn height(&self, s_m: f64) -> (f64, f64) {
        let phase = TURN * s_m / HILL_M;
        (self.hills * HILL_M / TURN * (1.0 - libm::cos(phase)), self.hills * libm::sin(phase))
    }

    fn advance(&self, from_m: f64, to_m: f64) -> Vector3<f64> {
        let (middle, half) = (0.5 * (from_m + to_m), 0.5 * (to_m - from_m));
        GAUSS.iter().fold(Vector3::zeros(), |sum, &(x, weight)| {
            let heading = self.heading_rad(middle + half * x);
            sum + Vector3::new(libm::sin(heading), 0.0, libm::cos(heading)) * (weight * half)
        })
    }

    /// The span of street from segment `first` to segment `last`, both included. Time: linear in
    /// the way from the last span when driving on, else from the street's start.
    pub fn span(&self, first: i64, last: i64) -> RoadSpan<'_> {
        let step = |segment: i64| {
            self.advance(segment as f64 * SEGMENT_M, (segment + 1) as f64 * SEGMENT_M)
        };
        // Both ways from the street's start, so that a segment's position does not depend on where
        // the span begins.
        let mut starts_m = Vec::new();
        let mut start = Vector3::zeros();
        for segment in (first..0).rev() {
            start -= step(segment);
            if segment <= last {
                starts_m.push(start);
            }
        }
        starts_m.reverse();
        // The last span's start is remembered: driving on costs a step, not the whole way.
        let mut walked = self.walked.lock().unwrap_or_else(PoisonError::into_inner);
        let (known, mut start) = if walked.0 <= first { *walked } else { Default::default() };
        for segment in known..=last {
            if segment == first {
                *walked = (segment, start);
            }
            if segment >= first {
                starts_m.push(start);
            }
            start += step(segment);
        }
        RoadSpan { centerline: self, first, starts_m }
    }
}

/// Positions along a part of the street.
pub struct RoadSpan<'a> {
    centerline: &'a Centerline,
    first: i64,
    starts_m: Vec<Vector3<f64>>,
}

impl RoadSpan<'_> {
    /// Position on the reference line.
    pub fn point(&self, s_m: f64) -> Vector3<f64> {
        let last = self.starts_m.len() as i64 - 1;
        let at = (libm::floor(s_m / SEGMENT_M) as i64 - self.first).clamp(0, last);
        self.starts_m[at as usize]
            + self.centerline.advance((at + self.first) as f64 * SEGMENT_M, s_m)
    }

    /// The frame that stands on the road at `s_m`, `lateral_m` to the right of the reference line,
    /// rotated by `yaw_rad` against it.
    pub fn t_street_local(&self, s_m: f64, lateral_m: f64, yaw_rad: f64) -> Transform {
        let heading = self.centerline.heading_rad(s_m);
        let right = Vector3::new(libm::cos(heading), 0.0, -libm::sin(heading));
        let mut pose = Transform::new(Vector3::new(0.0, heading + yaw_rad, 0.0), Vector3::zeros());
        pose.translation_m = (self.point(s_m) + right * lateral_m).into();
        // A flat street keeps the bits it had before there were hills.
        if self.centerline.hills != 0.0 {
            let (height_m, rise) = self.centerline.height(s_m);
            let rotation =
                |x: f64, y: f64| Transform::new(Vector3::new(x, y, 0.0), Vector3::zeros());
            // First the heading, then the slope along it, then the object's own turn.
            let tilted =
                rotation(0.0, heading) * rotation(libm::atan(rise), 0.0) * rotation(0.0, yaw_rad);
            pose.rotation = tilted.rotation;
            pose.translation_m[1] -= height_m;
        }
        pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hills_rise_as_steeply_as_they_say_and_frames_lie_on_them() {
        let config = StreetConfig { hills: 0.2, ..StreetConfig::default() };
        let centerline = Centerline::new(&config);
        let span = centerline.span(0, 4);
        let mut steepest = 0.0f64;
        for step in 0..800 {
            let s = f64::from(step) * 0.1;
            let (low, high) = (centerline.height(s), centerline.height(s + 0.01));
            // The rise is the derivative of the height.
            assert!(((high.0 - low.0) / 0.01 - low.1).abs() < 1e-3);
            steepest = steepest.max(low.1);
            // y points down.
            let pose = span.t_street_local(s, 0.0, 0.0);
            assert!((pose.translation_m[1] + low.0).abs() < 1e-9);
            let ahead = pose.rotate(Vector3::z());
            assert!(
                (ahead.y + libm::sin(libm::atan(low.1))).abs() < 1e-9,
                "the frame looks along the road"
            );
        }
        assert!((steepest - 0.2).abs() < 1e-3);
    }

    #[test]
    fn the_line_is_smooth_across_pieces_and_as_long_as_it_says() {
        let config = StreetConfig::default();
        let centerline = Centerline::new(&config);
        let span = centerline.span(-2, 12);
        let mut length = 0.0;
        for step in 0..2400 {
            let s = f64::from(step) * 0.1;
            let delta = span.point(s + 0.1) - span.point(s);
            let heading = centerline.heading_rad(s + 0.05);
            assert!(
                // The chord of 0.1 m is the tangent in its middle.
                (delta - Vector3::new(libm::sin(heading), 0.0, libm::cos(heading)) * 0.1).norm()
                    < 1e-6
            );
            length += delta.norm();
        }
        assert!((length - 240.0).abs() < 1e-3);
        assert_eq!(
            centerline.span(7, 8).point(180.0),
            span.point(180.0),
            "asked for alone, the same bits"
        );
    }
}
