"""A camera that was covered for long is found again in its map, or begins a segment of its own."""

import numpy as np

import dynvox

COVERED, UNCOVERED = 12, 24


def reports(seed_after):
    """Reports of a street until the camera is covered, and of another one or the same from when it sees again."""
    settings = {"street.width": 320, "street.height": 96, "street.speed_m_s": 3.0, "street.shake": 0.0, "volume.voxel_size_m": 0.1}
    streets = [dynvox.Dataset(None, frames=30, set={**settings, "street.traffic.mode": "none", "street.seed": seed}) for seed in (3, seed_after)]
    mapper = streets[0].mapper()
    for index, frames in enumerate(zip(*streets)):
        frame = frames[index >= COVERED]
        if COVERED <= index < UNCOVERED:
            frame = {key: np.zeros_like(frame[key]) for key in ("left", "right")}
        yield mapper.step(**frame)


def test_a_covered_camera_is_found_again():
    found = list(reports(3))
    assert [report["segment"] for report in found] == [0] * len(found)
    assert {report["pose"] for report in found[COVERED + 1 : UNCOVERED]} == {"Extrapolated"}
    # The frame that first sees is matched with the last before it; then a search takes four frames.
    position = [report["pose"] for report in found].index("Relocalized")
    assert UNCOVERED < position <= UNCOVERED + 4
    again = found[position]
    assert (again["pose"], again["severity"], again["fused"]) == ("Relocalized", "recovered", True)
    assert found[-1]["severity"] == "info"


def test_another_street_is_a_segment_of_its_own():
    found = list(reports(4))
    assert [report["segment"] for report in found[:COVERED]] == [0] * COVERED
    assert found[-1]["segment"] == 1
    began = next(report for report in found if report["segment"] == 1)
    assert began["fused"] and np.allclose(began["t_world_camera"]["translation_m"], 0.0)
