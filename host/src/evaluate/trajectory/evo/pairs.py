"""Figures of evo 1.38 on pairs that are cut from estimate.txt and truth.txt: `python3 pairs.py`.

A pair says which rows of each file are kept (every STEP-th from FIRST to LAST, without those of a
gap) and by how many s the estimate's clock is late. Rows are 0.1 s apart, from 1000 s.
"""

import json
import pathlib

import numpy as np
from evo.core import metrics, sync
from evo.core.trajectory import PoseTrajectory3D
from evo.tools import file_interface

HERE = pathlib.Path(__file__).parent
WHOLE = {"first": 0, "last": 10_000, "step": 1, "gap": [0, 0]}
PAIRS = [
    ("the same rate", {}, {}, 0.0),
    ("half the rate", {"step": 2}, {}, 0.0),
    ("a third of the rate", {"step": 3}, {}, 0.0),
    ("truth at half the rate", {}, {"step": 2}, 0.0),
    ("two rates that meet each sixth time", {"step": 2}, {"step": 3}, 0.0),
    ("a late start", {"first": 20}, {}, 0.0),
    ("an early end", {"last": 30}, {}, 0.0),
    ("an overlap", {"last": 45}, {"first": 10}, 0.0),
    ("a gap", {"gap": [20, 40]}, {}, 0.0),
    ("gaps in both", {"gap": [10, 20]}, {"gap": [35, 50]}, 0.0),
    ("a clock that is 4 ms late", {}, {}, 0.004),
    ("no time in common", {"last": 20}, {"first": 30}, 0.0),
]


def kept(name, rows, late_s):
    path = file_interface.read_kitti_poses_file(HERE / name)
    at = range(rows["first"], min(rows["last"], path.num_poses), rows["step"])
    at = [row for row in at if not rows["gap"][0] <= row < rows["gap"][1]]
    times_s = np.array([1_000.0 + 0.1 * row + late_s for row in at])
    return PoseTrajectory3D(poses_se3=[path.poses_se3[row] for row in at], timestamps=times_s)


def figures(estimate, truth, late_s):
    estimate, truth = kept("estimate.txt", estimate, late_s), kept("truth.txt", truth, 0.0)
    try:
        truth, estimate = sync.associate_trajectories(truth, estimate, max_diff=0.01)
    except sync.SyncException:
        return 0, None
    estimate.align(truth)
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((truth, estimate))
    return truth.num_poses, float(error.get_statistic(metrics.StatisticsType.rmse))


rows = []
for name, estimate, truth, late_s in PAIRS:
    estimate, truth = WHOLE | estimate, WHOLE | truth
    poses, ate_m = figures(estimate, truth, late_s)
    rows.append({"name": name, "estimate": estimate, "truth": truth, "late_s": late_s,
                 "poses": poses, "ate_m": ate_m})
text = ",\n".join(json.dumps(row) for row in rows)
(HERE / "pairs.json").write_text(f"[\n{text}\n]\n")
