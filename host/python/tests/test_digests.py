"""The bits are the command line's, frame by frame."""

import os
import threading
import time

import numpy as np
import pytest

import dynvox

# Frames of each clip: all of them with DYNVOX_FRAMES=1000.
FRAMES = int(os.environ.get("DYNVOX_FRAMES", "12"))


def digests(dataset):
    mapper = dataset.mapper()
    return [mapper.step(**frame)["digest"] for frame in dataset]


def compare(command_line, path, **options):
    options = {"frames": FRAMES, **options}
    # The command line's words and the keywords come from the same pairs.
    words = [f"--{key.replace('_', '-')}={value}" for key, value in options.items()]
    expected, summary = command_line(*([path] if path else []), *words)
    mapped = digests(dynvox.Dataset(path, **options))
    assert mapped == expected and len(mapped) > 1
    return summary


def test_street(command_line):
    compare(command_line, None)


def test_street_in_little_memory_with_blocks_evicted_and_loaded(command_line):
    summary = compare(command_line, None, memory="18MiB", threads=1, frames=20)
    assert summary["evict"]["stored"] > 0 and summary["evict"]["loaded"] > 0, summary["evict"]


def test_street_with_masks_depth_and_noise(command_line):
    compare(command_line, None, instances="noisy", depth="exact")


def test_kitti_06(command_line, data):
    compare(command_line, data / "kitti-odometry", sequence="06")


def test_kitti_06_with_given_poses_from_the_tenth_frame_on(command_line, data):
    compare(command_line, data / "kitti-odometry", sequence="06", egomotion=f"file:{data / 'kitti-odometry/poses/06.txt'}", start=10, stride=2)


def test_kitti_0003_in_colour_with_masks(command_line, data):
    compare(command_line, data / "kitti-tracking", sequence="0003")


def test_raw_kitti_cameras(command_line, data):
    compare(command_line, data / "kitti-raw/2011_09_26", sequence="2011_09_26_drive_1405_extract", frames=min(FRAMES, 5))


def test_colour_pictures_alone_give_the_bits_of_their_grey_and_colour(data):
    dataset = dynvox.Dataset(data / "kitti-tracking", sequence="0003", frames=3, instances="none")
    grey, alone = dataset.mapper(), dataset.mapper()
    for frame in dataset:
        assert grey.step(**frame)["digests"]["stereo"] == alone.step(frame["colour"], frame["right"])["digests"]["stereo"]
        assert grey.digest == alone.digest


def test_a_mapper_of_a_rig_gives_the_bits_of_the_data_set():
    dataset = dynvox.Dataset(frames=4)
    rig = dataset.rig
    mapper = dynvox.Mapper(
        dynvox.Rig(rig.focal_px, rig.center_u_px, rig.center_v_px, rig.baseline_m), memory="256MiB", frame_interval_s=dataset.frame_interval_s
    )
    assert [mapper.step(**frame)["digest"] for frame in dataset] == digests(dataset)


def test_a_snapshot_continues_bit_for_bit_evicted_blocks_included(tmp_path):
    dataset = dynvox.Dataset(frames=20, memory="18MiB", threads=1)
    mapper = dataset.mapper()
    frames = list(dataset)
    for frame in frames[:14]:
        report = mapper.step(**frame)
    snapshot = mapper.snapshot()
    rest = [mapper.step(**frame)["digest"] for frame in frames[14:]]
    restored = dataset.mapper()
    restored.restore(snapshot)
    assert [restored.step(**frame)["digest"] for frame in frames[14:]] == rest
    assert np.array_equal(restored.triangles()[0], mapper.triangles()[0])
    assert report["frame"] == 13
    other = dynvox.Dataset(frames=2, memory="24MiB").mapper()
    with pytest.raises(dynvox.Error, match="another capacity"):
        other.restore(snapshot)
    with pytest.raises(dynvox.Error, match="damaged|cannot be read"):
        other = dataset.mapper()
        other.restore(snapshot[:1000] + bytes([snapshot[1000] ^ 1]) + snapshot[1001:])
    lost = dynvox.Dataset(frames=2, memory="18MiB", threads=1, stream=False).mapper()
    with pytest.raises(dynvox.Error, match="stream=True"):
        lost.restore(snapshot)
    kept = tmp_path / "map.blocks"
    filed = dynvox.Dataset(frames=20, memory="18MiB", threads=1, stream=kept).mapper()
    filed.restore(snapshot)
    assert [filed.step(**frame)["digest"] for frame in frames[14:]] == rest and kept.stat().st_size > 1000


def test_other_threads_run_during_a_step():
    dataset = dynvox.Dataset(frames=2, threads=1)
    mapper, frame = dataset.mapper(), dataset[0]
    turns, done = [], threading.Event()

    def count():
        while not done.is_set():
            turns.append(time.perf_counter())
            time.sleep(0.001)

    other = threading.Thread(target=count)
    other.start()
    begin = time.perf_counter()
    mapper.step(**frame)
    end = time.perf_counter()
    done.set()
    other.join()
    # A held interpreter would let the other thread run before and after, never within.
    quarter = (end - begin) / 4
    assert any(begin + quarter < turn < end - quarter for turn in turns)
