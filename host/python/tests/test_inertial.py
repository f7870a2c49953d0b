"""Samples of an inertial unit: of a data set, and of the caller's own."""

import numpy as np
import pytest

import dynvox

SWAYING = {"street.width": 320, "street.height": 96, "street.traffic.mode": "none", "street.sway_deg_s": 40, "street.inertial.rate_hz": 100}
# The street's unit looks ahead along x, to the left along y and up along z.
T_CAMERA_UNIT = [[0, -1, 0, 0.27], [0, 0, -1, -0.05], [1, 0, 0, -0.12], [0, 0, 0, 1]]


def street(frames=30, **options):
    return dynvox.Dataset(frames=frames, set=SWAYING, instances="none", **options)


def rig_of(dataset):
    rig = dataset.rig
    return dynvox.Rig(rig.focal_px, rig.center_u_px, rig.center_v_px, rig.baseline_m)


def black(frame):
    """The frame as a camera in the dark gives it."""
    return {**frame, "left": np.zeros_like(frame["left"]), "right": np.zeros_like(frame["right"])}


def test_a_data_set_hands_out_the_samples_of_its_unit():
    frames = list(street(4))
    first, counts = frames[0]["inertial"], [len(frame["inertial"][0]) for frame in frames]
    assert first[0].dtype == np.uint64 and first[1].shape == (counts[0], 6)
    assert counts[1:] == [10, 10, 10]
    times = np.concatenate([frame["inertial"][0] for frame in frames])
    assert (np.diff(times.astype(np.int64)) > 0).all() and times[-1] <= frames[-1]["time_ns"]
    # It stands upright: what holds it against gravity points along its z axis.
    assert abs(np.median(np.concatenate([frame["inertial"][1][:, 5] for frame in frames])) - 9.8) < 0.3
    assert "inertial" not in next(iter(street(1, inertial="none")))


def test_a_run_with_a_unit_has_the_bits_of_the_command_line(command_line):
    words = [f"--set={key}={value}" for key, value in SWAYING.items()]
    expected, _ = command_line("--frames=12", "--instances=none", *words)
    dataset = street(12)
    mapper = dataset.mapper()
    assert [mapper.step(**frame)["digest"] for frame in dataset] == expected


def test_a_mapper_with_the_caller_s_own_unit_turns_in_the_dark():
    dataset = street()
    unit = dynvox.InertialUnit(T_CAMERA_UNIT)
    mappers = {name: dynvox.Mapper(rig_of(dataset), memory="64MiB", threads=1, inertial_unit=of) for name, of in (("with", unit), ("without", None))}
    truth, errors = dataset.truth, {}
    for at, frame in enumerate(dataset):
        given = black(frame) if at >= 27 else frame
        for name, mapper in mappers.items():
            report = mapper.step(given["left"], given["right"], time_ns=given["time_ns"], inertial=given["inertial"])
            off = dynvox.matrix(report["t_world_camera"])[:3, :3].T @ truth[at][:3, :3]
            errors[name] = np.degrees(np.arccos(np.clip((np.trace(off) - 1) / 2, -1, 1)))
            if name == "without":
                assert report["inertial"] is None
            else:
                told = report["inertial"]
    assert told["trusted"] and told["turned"] and told["doubt"] is None and told["samples"] == 10
    up = np.array(told["vertical"]["up_world"])
    assert up[1] < -0.999, up
    assert errors["with"] < 0.3 * errors["without"] and errors["without"] > 1, errors


def test_samples_that_cannot_be_read_are_refused_with_what_to_pass():
    dataset = street(1)
    frame = next(iter(dataset))
    mapper = dynvox.Mapper(rig_of(dataset), memory="64MiB", threads=1, inertial_unit=dynvox.InertialUnit(np.eye(4)))
    rows = np.zeros((2, 6))
    for given, said in [
        (rows, "no pair"),
        ((np.array([0.5, 1.5]), rows), "no integers"),
        (([1, 2], np.zeros((2, 7))), "not of six numbers"),
        (([1, 2, 3], rows), "3 times and 2 rows"),
        (([-1, 2], rows), "below 0"),
        (([[1], [2]], rows), "more than one row"),
    ]:
        with pytest.raises(dynvox.Error, match=said):
            mapper.step(frame["left"], frame["right"], time_ns=5, inertial=given)
    report = mapper.step(frame["left"], frame["right"], time_ns=5, inertial=([], []))
    assert report["inertial"]["samples"] == 0
    assert mapper.step(frame["left"], frame["right"], time_ns=9, inertial=([6, 7], rows.tolist()))["inertial"]["samples"] == 2


def test_a_unit_that_cannot_be_mounted_so_is_refused():
    with pytest.raises(dynvox.Error, match="scaled or sheared"):
        dynvox.InertialUnit(2 * np.eye(4)[:3])
    with pytest.raises(dynvox.Error, match="inertial.turn_range must be a positive number"):
        dynvox.InertialUnit(np.eye(4), turn_range=0)
    with pytest.raises(dynvox.Error, match="has no turn_noise"):
        dynvox.InertialUnit(np.eye(4), turn_noise=1)
    with pytest.raises(dynvox.Error, match="turn_walk of an inertial unit is no number"):
        dynvox.InertialUnit(np.eye(4), turn_walk="small")
    assert repr(dynvox.InertialUnit(T_CAMERA_UNIT)) == "InertialUnit(at 0.270, -0.050, -0.120 m from the left camera)"
