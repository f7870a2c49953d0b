//! What stands around a vehicle in truth, as directions that could have been told.

use super::{BODY_M, REACH_M};
use crate::synth::FlownView;
use dynvox_onboard::{Direction, SECTOR_DEG, SECTORS};

/// Nearer than this a ray has met a surface, m.
const MET_M: f64 = 0.05;
/// Most steps of a ray.
const STEPS_MAX: usize = 200;

/// State of all directions ahead, out to `far_m`. Behind nothing is looked for.
pub fn directions(view: &FlownView<'_>, far_m: f64) -> [Direction; SECTORS] {
    std::array::from_fn(|sector| {
        let is_ahead = (sector as f64 * SECTOR_DEG).to_radians().cos() > 0.0;
        let distance_m = if is_ahead { distance_m(view, sector, far_m) } else { far_m };
        if distance_m < far_m {
            Direction::Obstacle { distance_m: distance_m as f32 }
        } else {
            Direction::Free
        }
    })
}

/// Distance to the first surface along the middle of a direction, at most `far_m`, at the vehicle's
/// height and at its upper and lower ends.
pub fn distance_m(view: &FlownView<'_>, sector: usize, far_m: f64) -> f64 {
    let angle_rad = (sector as f64 * SECTOR_DEG).to_radians();
    let (right, ahead) = (angle_rad.sin(), angle_rad.cos());
    let along = |down_m: f64| ray_m(view, far_m, |at_m| [right * at_m, down_m, ahead * at_m]);
    [-BODY_M, 0.0, BODY_M].map(along).into_iter().fold(far_m, f64::min)
}

/// Length of a ray to the first surface, at most `far_m`. A step is as long as nothing is nearer.
fn ray_m(view: &FlownView<'_>, far_m: f64, point: impl Fn(f64) -> [f64; 3]) -> f64 {
    let mut at_m = 0.0;
    for _ in 0..STEPS_MAX {
        let clearance_m = view.clearance_m(point(at_m), REACH_M);
        if clearance_m < MET_M || at_m >= far_m {
            break;
        }
        at_m += clearance_m;
    }
    at_m.min(far_m)
}
