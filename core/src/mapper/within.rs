//! What a budget of work leaves of the stages that look at images.

use super::Config;
use crate::{
    Capacity,
    scene_flow::{self, SceneFlowConfig},
    stereo::{self, StereoBudget},
};

impl Config {
    /// The most that stereo matching looks for in a frame.
    pub(super) fn stereo_budget(&self, capacity: &Capacity) -> StereoBudget {
        StereoBudget {
            pixels: self.mapper.budget_of(stereo::most_pixels(capacity, &self.stereo)),
            points: self.mapper.budget_of(stereo::max_points(capacity)),
        }
    }

    /// Scene flow with as many features as the budget leaves.
    pub(super) fn scene_flow_within(&self, capacity: &Capacity) -> SceneFlowConfig {
        let [dense, sparse] = scene_flow::most_features(capacity);
        if self.mapper.work_budget >= 1.0 {
            return self.scene_flow;
        }
        // Both passes together are within it: every feature may belong to both.
        let all = self.mapper.budget_of(dense + sparse);
        let most = (all / 2).max(all.saturating_sub(sparse));
        let features_max = self.scene_flow.features_max.min(most as u32);
        SceneFlowConfig { features_max, ..self.scene_flow }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::StereoRig;

    #[test]
    fn the_features_of_both_passes_are_within_the_share() {
        let rig =
            StereoRig { focal_px: 200.0, center_u_px: 160.0, center_v_px: 48.0, baseline_m: 0.5 };
        let (capacity, mut config) = (Capacity::SMALL, Config::for_rig(rig));
        let bound = capacity.work(&config).features as f64;
        assert_eq!(config.scene_flow_within(&capacity), config.scene_flow);
        for share in [0.9, 0.75, 0.5, 0.25, 0.01] {
            config.mapper.work_budget = share;
            let most = config.scene_flow_within(&capacity).features_max as usize;
            // Of two images; the sparse pass keeps no more than a quarter of the capacity.
            let all = 2 * (most + most.min(capacity.features / 4));
            let share = f64::from(share) * bound;
            assert!(all as f64 <= share && all as f64 > 0.98 * share - 4.0, "{all} of {share}");
        }
    }
}
