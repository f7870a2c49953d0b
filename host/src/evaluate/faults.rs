//! Outcome of a run with a fault in its images: how wrong poses are that nothing warns of, what is
//! fused from them, and when all is well again.

use dynvox_core::geometry::Transform;
use dynvox_core::{PoseOrigin, Severity};
use serde::Serialize;

/// A pose further than this from the true one is wrong, m.
pub const WRONG_M: f64 = 0.3;
/// A pose turned further than this from the true one is wrong, degrees.
pub const WRONG_DEG: f64 = 2.0;

/// Estimated and true pose of a frame, with what the report says of it.
#[derive(Clone, Copy, Debug)]
pub struct EvaluatedFrame {
    /// The estimate, camera to world.
    pub t_world_camera: Transform,
    /// The truth, camera to world.
    pub true_t_world_camera: Transform,
    /// Source of the pose: measured, extrapolated, or given.
    pub pose: PoseOrigin,
    /// The worst event that was reported.
    pub severity: Severity,
    /// True if the frame was fused into the map.
    pub fused: bool,
    /// Segment of the map.
    pub segment: u32,
}

/// Consequences of a planted fault: unreported errors, wrong fusions, and recovery.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FaultOutcome {
    /// Largest distance from the true pose among frames that nothing is reported of, m.
    pub unreported_m: f64,
    /// Largest angle from the true pose among them, degrees.
    pub unreported_deg: f64,
    /// Frames with a wrong pose that nothing is reported of.
    pub unreported_frames: usize,
    /// Frames fused from a wrong pose.
    pub wrong_fused: usize,
    /// Frames whose pose was extrapolated.
    pub extrapolated: usize,
    /// Frames reported to affect the map.
    pub map_affected: usize,
    /// Frames from the first with the fault until all that follow are right and nothing is reported
    /// of them; `None` where the last is not.
    pub recovered_after: Option<usize>,
}

impl FaultOutcome {
    /// Evaluates frames; `first` is the first that a fault may have touched. Poses are compared
    /// from the frame before it on, so that drift until then does not count, and within a segment
    /// of the map from its first frame on.
    pub fn from_frames(frames: &[EvaluatedFrame], first: usize) -> Self {
        let Some(mut before) = frames.get(first.saturating_sub(1)) else { return Self::default() };
        let mut outcome = Self { recovered_after: Some(0), ..Self::default() };
        for (since, frame) in frames.iter().skip(first).enumerate() {
            // A new segment has a pose of its own: the jump to it is no error.
            if frame.segment != before.segment {
                before = frame;
            }
            let moved = before.t_world_camera.inverse() * frame.t_world_camera;
            let truly = before.true_t_world_camera.inverse() * frame.true_t_world_camera;
            let error = truly.inverse() * moved;
            let (distance_m, angle_deg) = (error.distance_m(), error.angle_rad().to_degrees());
            // Wrong means off the ground truth; reported means that the mapper said so.
            let (wrong, reported) = (
                distance_m > WRONG_M || angle_deg > WRONG_DEG,
                frame.severity >= Severity::MapAffected,
            );
            // What was reported may be wrong: only silence counts against the mapper.
            if !reported {
                outcome.unreported_m = outcome.unreported_m.max(distance_m);
                outcome.unreported_deg = outcome.unreported_deg.max(angle_deg);
                outcome.unreported_frames += usize::from(wrong);
            }
            outcome.wrong_fused += usize::from(wrong && frame.fused);
            outcome.extrapolated += usize::from(frame.pose == PoseOrigin::Extrapolated);
            outcome.map_affected += usize::from(reported);
            // Recovered after the last bad frame, unless that is the last of all.
            if wrong || reported {
                outcome.recovered_after = (first + since + 1 < frames.len()).then_some(since + 1);
            }
        }
        outcome
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// A camera that moves by 1 m a frame, each pose so many metres too far.
    fn run_with(frames: &[(f64, Severity)]) -> Vec<EvaluatedFrame> {
        let at = |z: f64| Transform::new(Vector3::zeros(), Vector3::new(0.0, 0.0, z));
        let frame = |(index, &(off_m, severity)): (usize, &(f64, Severity))| EvaluatedFrame {
            t_world_camera: at(index as f64 + off_m),
            true_t_world_camera: at(index as f64),
            pose: PoseOrigin::Estimated,
            severity,
            fused: true,
            segment: 0,
        };
        frames.iter().enumerate().map(frame).collect()
    }

    #[test]
    fn a_wrong_pose_counts_as_unreported_only_where_nothing_is_said() {
        let (info, affected) = (Severity::Info, Severity::MapAffected);
        let outcome = FaultOutcome::from_frames(
            // How far off each frame is, m, and what it reports; the fault is at frame 1.
            &run_with(&[(0.0, info), (0.1, info), (2.0, affected), (1.0, info), (0.2, info)]),
            1,
        );
        assert!((outcome.unreported_m - 1.0).abs() < 1e-9, "{outcome:?}");
        assert_eq!(
            (outcome.unreported_frames, outcome.wrong_fused, outcome.map_affected),
            (1, 2, 1)
        );
        // Frame 4 is the first that is close again: three frames after the fault.
        assert_eq!(outcome.recovered_after, Some(3));
        assert_eq!(
            FaultOutcome::from_frames(&run_with(&[(0.0, info), (0.0, info)]), 1).recovered_after,
            Some(0)
        );
        assert_eq!(
            FaultOutcome::from_frames(&run_with(&[(0.0, info), (9.0, info)]), 1).recovered_after,
            None
        );
    }

    #[test]
    fn a_segment_is_compared_with_its_first_pose() {
        let mut frames = run_with(&[
            (0.0, Severity::Info),
            (100.0, Severity::MapAffected),
            (100.1, Severity::MapAffected),
        ]);
        assert_eq!(FaultOutcome::from_frames(&frames, 1).wrong_fused, 2);
        // Each segment has a world of its own, and the first pose in it is its zero.
        frames[1..].iter_mut().for_each(|frame| frame.segment = 1);
        assert_eq!(FaultOutcome::from_frames(&frames, 1).wrong_fused, 0);
        // Back where the segment began, and so 100 m off.
        frames[2].t_world_camera = Transform::IDENTITY;
        assert_eq!(FaultOutcome::from_frames(&frames, 1).wrong_fused, 1);
    }

    #[test]
    fn drift_before_the_fault_does_not_count() {
        let outcome = FaultOutcome::from_frames(
            &run_with(&[(5.0, Severity::Info), (5.0, Severity::Info)]),
            1,
        );
        assert_eq!((outcome.unreported_m, outcome.unreported_frames), (0.0, 0));
    }
}
