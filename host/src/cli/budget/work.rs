//! The most work of any step, unit by unit.

use crate::report::text::grouped;
use crate::request::Settings;
use dynvox_core::geometry::StereoRig;
use dynvox_core::{Capacity, WorkUnits};
use serde_json::json;

/// A unit of work, as the table explains it.
struct Unit {
    /// Name in reports.
    name: &'static str,
    /// Stage that does the work.
    stage: &'static str,
    /// Bound, in the words of capacity and settings.
    formula: &'static str,
}

const fn unit(name: &'static str, stage: &'static str, formula: &'static str) -> Unit {
    Unit { name, stage, formula }
}

/// Every unit, in the order of [`WorkUnits::named`].
const UNITS: [Unit; WorkUnits::COUNT] = [
    unit("stereo_pixels", "stereo", "image_width x matched rows (stereo.second_rows_from)"),
    unit("support_candidates", "stereo", "lattice points of the image"),
    unit("triangles", "stereo", "2 images x 2 for each lattice point"),
    unit("features", "scene flow", "2 images x (features + features / 4)"),
    unit(
        "compared_descriptors",
        "scene flow",
        "sparse pass: features x reach; dense pass: 600 x features and a sample",
    ),
    unit("circles", "scene flow", "features + features / 4"),
    unit(
        "cast_pixels",
        "egomotion",
        "3 x every second column and row; with mapper.egomotion icp all pixels once",
    ),
    unit("block_requests", "allocate", "rays of every second pixel x blocks on a ray"),
    unit("moved_blocks", "allocate", "2 for each request"),
    unit("fused_voxels", "fuse", "visible_blocks x 512"),
    unit("pruned_voxels", "prune", "least of blocks, volume.prune_blocks_per_frame, x 512"),
];

/// Any rig: no bound depends on it.
const RIG: StereoRig =
    StereoRig { focal_px: 500.0, center_u_px: 320.0, center_v_px: 240.0, baseline_m: 0.5 };

/// Prints the bounds of a capacity, under settings such as `volume.prune_blocks_per_frame=500`.
pub fn show(
    (name, capacity): (&str, &Capacity),
    sets: &[String],
    as_json: bool,
) -> anyhow::Result<()> {
    let config = Settings::resolve(None, sets)?.config(RIG, None);
    let bound = capacity.work(&config).named();
    let rows = UNITS.iter().zip(bound).map(|(unit, (_, most))| (unit, most));
    if as_json {
        let units: Vec<_> = rows
            .map(|(Unit { name, stage, formula }, most)| {
                json!({ "unit": name, "stage": stage, "most": most, "formula": formula })
            })
            .collect();
        let value = json!({ "capacity": name, "work": units });
        outln!("{}", serde_json::to_string_pretty(&value)?);
        return Ok(());
    }
    outln!("Most work of any step of {name}, on any input\n");
    outln!("{:<12}{:<20}{:>16}  formula", "stage", "unit", "most a step");
    for (Unit { name, stage, formula }, most) in rows {
        outln!("{stage:<12}{name:<20}{:>16}  {formula}", grouped(most));
    }
    outln!(
        "\nWhat a step did is in the columns work_* of frames.csv. Not counted: \
         hypotheses of motions, keyframes compared, voxels of objects."
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_of_a_report_is_explained_in_order() {
        let named = WorkUnits::default().named().map(|(name, _)| name);
        assert_eq!(UNITS.each_ref().map(|unit| unit.name), named);
    }
}
