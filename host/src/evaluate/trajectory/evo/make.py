"""Writes figures.json from truth.txt and estimate.txt with evo (https://github.com/MichaelGrupp/evo, 1.38.1): python3 make.py

The two trajectories are 60 frames of the synthetic street, true and as dynvox estimated them:
  dynvox run --profile small --frames 60 --set street.width=320 --set street.height=96 --set street.frames=60 --set street.noise_sigma=3
"""

import copy
import json
import math

import numpy as np
from evo.core import lie_algebra as lie, metrics
from evo.tools import file_interface

truth = file_interface.read_kitti_poses_file("truth.txt")
estimate = file_interface.read_kitti_poses_file("estimate.txt")

aligned = copy.deepcopy(estimate)
aligned.align(truth, correct_scale=False)
ape = metrics.APE(metrics.PoseRelation.translation_part)
ape.process_data((truth, aligned))


def rpe(relation):
    metric = metrics.RPE(relation, delta=1, delta_unit=metrics.Unit.frames, all_pairs=False)
    metric.process_data((truth, estimate))
    return metric.get_statistic(metrics.StatisticsType.rmse)


def pieces(lengths, step):
    """The benchmark's relative errors, on evo's SE(3)."""
    t, e = truth.poses_se3, estimate.poses_se3
    travelled = np.concatenate([[0], np.cumsum([np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in zip(t, t[1:])])])
    rows = []
    for length in lengths:
        found = []
        for first in range(0, len(t), step):
            last = next((i for i in range(first, len(t)) if travelled[i] >= travelled[first] + length), None)
            if last is None:
                continue
            error = lie.relative_se3(lie.relative_se3(e[first], e[last]), lie.relative_se3(t[first], t[last]))
            found.append((np.linalg.norm(error[:3, 3]) / length * 100, math.degrees(lie.so3_log_angle(error[:3, :3])) / length))
        if found:
            rows.append([length, *np.mean(found, axis=0), len(found)])
    return rows


rows = pieces([5, 10, 20, 30, 40, 50], 1)
count = sum(row[3] for row in rows)
json.dump(
    {
        "ate_m": ape.get_statistic(metrics.StatisticsType.rmse),
        "rpe_t_m": rpe(metrics.PoseRelation.translation_part),
        "rpe_r_deg": rpe(metrics.PoseRelation.rotation_angle_deg),
        "t_err_percent": sum(row[1] * row[3] for row in rows) / count,
        "r_err_deg_per_m": sum(row[2] * row[3] for row in rows) / count,
        "pieces": rows,
    },
    open("figures.json", "w"),
    indent=1,
)
