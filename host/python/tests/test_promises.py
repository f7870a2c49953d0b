"""What the stub promises: pictures, poses, files, processes, names. Each promise has a test by name."""

import ast
import os
import pathlib
import pickle
import re
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import dynvox

WIDTH, HEIGHT = 320, 96
RIG = dynvox.Rig(200, 160, 48, 0.5)
SMALL = {"street.width": WIDTH, "street.height": HEIGHT, "volume.voxel_size_m": 0.1}

# Words that make a sentence of the stub a promise, and the test of each promise by its beginning.
WORDS = re.compile(r"\b(only|never|must|nothing|unless|equal|belongs|frees|every later call|untouched|run while)\b", re.IGNORECASE)
PROMISES = {
    "Rigs of equal numbers are equal": "test_rigs_are_equal_by_their_numbers_and_survive_pickle",
    "Rigs of equal numbers": "test_rigs_are_equal_by_their_numbers_and_survive_pickle",
    "Its number, from 1, never used again": "test_tracks_have_numbers_of_their_own",
    "Other threads of Python run while": "test_other_threads_run_while_a_mapper_is_made",
    "It belongs to the process": "test_a_forked_child_is_told_whose_mapper_it_has",
    "A file that this mapper did not make is never overwritten": "test_a_file_of_the_user_is_never_overwritten",
    "The first ten pairs are examined": "test_pictures_are_examined_as_on_the_command_line",
    "None unless the setting `stereo.min_confidence`": "test_confidence_is_there_when_it_is_asked_for",
    "Nothing is copied whose pixels lie": "test_a_view_that_is_not_dense_is_copied",
    "A pose must be a rigid motion": "test_poses_that_are_no_rigid_motion_within_the_map_are_refused",
    "`fused` in the report is true only if": "test_fused_is_true_only_if_something_was_fused",
    "Reports, plans and objects are in the world as driven": "test_a_position_moves_the_closed_world_alone",
    "Frees the memory; every later call": "test_a_closed_mapper_says_so",
    "The mapper must have been made with the same rig": "test_a_mapper_with_a_file_survives_its_own_restore",
    "A file of `stream` that this mapper did not make": "test_a_file_of_the_user_is_never_overwritten",
}


def pair(shift=0):
    """A textured pair whose disparity is 10 px; `shift` moves the camera along its rows."""
    noise = np.random.default_rng(7).integers(0, 255, (HEIGHT, WIDTH + 400)).astype(np.float32)
    smooth = (noise + np.roll(noise, 1, 0) + np.roll(noise, 1, 1) + np.roll(np.roll(noise, 1, 0), 1, 1)) / 4
    smooth = smooth.astype(np.uint8)
    return [np.ascontiguousarray(smooth[:, at : at + WIDTH]) for at in (shift, shift + 10)]


def mapper(**options):
    return dynvox.Mapper(RIG, **{"memory": "32MiB", "threads": 1, **options})


def street(frames=8):
    return list(dynvox.Dataset(frames=frames, set={**SMALL, "street.traffic.mode": "none"}))


def street_rig():
    rig = dynvox.Dataset(frames=1, set=SMALL).rig
    return dynvox.Rig(rig.focal_px, rig.center_u_px, rig.center_v_px, rig.baseline_m)


def moved(x):
    pose = np.eye(4)
    pose[0, 3] = x
    return pose


def documented():
    stub = ast.parse((Path(dynvox.__file__).parent / "__init__.pyi").read_text())
    return [(node, ast.get_docstring(node)) for node in ast.walk(stub) if isinstance(node, ast.ClassDef | ast.FunctionDef)]


def test_each_promise_of_the_stub_has_a_test_by_name():
    promises = []
    for _, text in documented():
        sentences = re.split(r"(?<=\.)\s+", " ".join((text or "").split()))
        promises += [sentence for sentence in sentences if WORDS.search(sentence)]
    assert len(promises) >= 8
    for promise in promises:
        assert any(promise.startswith(beginning) for beginning in PROMISES), f"no test is named for: {promise}"
    for test in PROMISES.values():
        assert callable(globals().get(test)), test


def test_every_public_name_explains_itself():
    assert sorted(dir(dynvox)) == sorted(dynvox.__all__)
    stub = {node.name: (node, text) for node, text in documented()}
    for name in set(dynvox.__all__) - {"__version__"}:
        assert getattr(dynvox, name).__doc__, name
    for name in ("Rig", "Detection", "Mapper", "Dataset"):
        for member in vars(getattr(dynvox, name)):
            if not member.startswith("_"):
                assert getattr(getattr(dynvox, name), member).__doc__, f"{name}.{member}"
    step = " ".join(dynvox.Mapper.step.__doc__.split())
    wanted = next(ast.get_docstring(node) for node in stub["Mapper"][0].body if getattr(node, "name", "") == "step")
    assert step == " ".join(wanted.split())


def test_a_mapper_with_a_file_survives_its_own_restore(tmp_path):
    path, plain = tmp_path / "map.blocks", mapper()
    streamed = mapper(stream=path)
    for shift in range(3):
        streamed.step(*pair(shift)), plain.step(*pair(shift))
    snapshot = streamed.snapshot()
    streamed.step(*pair(9))
    streamed.restore(snapshot)
    assert streamed.step(*pair(3))["frame"] == 3
    plain.step(*pair(3))
    assert streamed.digest == plain.digest
    # After a damaged snapshot it is as it was made, its file its own.
    with pytest.raises(dynvox.Error, match="damaged|cannot be read"):
        streamed.restore(snapshot[:-100] + bytes(100))
    assert streamed.step(*pair(0))["frame"] == 0 and path.is_file()


def test_a_mapper_with_a_file_survives_a_refused_first_pair(tmp_path):
    left, right = pair()
    streamed = mapper(stream=tmp_path / "map.blocks")
    with pytest.raises(dynvox.Error, match="differ in size"):
        streamed.step(left, right[:, :-1])
    assert [streamed.step(left, right)["frame"], streamed.step(left, right)["frame"]] == [0, 1]


def test_a_file_of_the_user_is_never_overwritten(tmp_path):
    source = mapper()
    source.step(*pair())
    snapshot = source.snapshot()
    thesis, link = tmp_path / "thesis.txt", tmp_path / "link"
    thesis.write_text("years of work")
    link.symlink_to(thesis)
    for path in (thesis, link):
        late = mapper(stream=path)
        with pytest.raises(dynvox.Error, match="exists. Name another file"):
            late.restore(snapshot)
        with pytest.raises(dynvox.Error, match="exists. Name another file"):
            mapper(stream=str(path), image=(WIDTH, HEIGHT))
    # A link that takes the place of the mapper's own file is replaced, and its target stays.
    own = tmp_path / "own"
    streamed = mapper(stream=own)
    streamed.step(*pair())
    own.unlink()
    own.symlink_to(thesis)
    streamed.restore(snapshot)
    assert thesis.read_text() == "years of work" and not own.is_symlink()
    # So is a file that another mapper made.
    with pytest.raises(dynvox.Error, match="exists"):
        mapper(stream=own).restore(snapshot)


def test_pictures_are_examined_as_on_the_command_line():
    frames, rig = street(), street_rig()
    pairs = [(frame["left"], frame["right"]) for frame in frames]
    exchanged = [(right, left) for left, right in pairs]
    apart = [(np.ascontiguousarray(left[12:]), np.ascontiguousarray(right[:-12])) for left, right in pairs]
    same = [(left, left) for left, _ in pairs]
    black = [(left * 0, right * 0) for left, right in pairs]

    def first(pairs, **options):
        made = dynvox.Mapper(rig, memory="32MiB", threads=1, **options)
        for left, right in pairs:
            made.step(left, right)
        return made.warnings

    assert first(pairs) == []
    with pytest.raises(dynvox.Error, match="exchanged.*force=True maps them nevertheless"):
        first(exchanged)
    with pytest.raises(dynvox.Error, match="not rectified"):
        first(apart)
    with pytest.raises(dynvox.Error, match="both cameras show the same image"):
        first(same)
    # A camera may begin in the dark: named, and mapped.
    assert "black" in first(black)[0]
    assert "exchanged" in first(exchanged, force=True)[0]
    found = {kind: dynvox.diagnose(rig, of) for kind, of in {"exchanged": exchanged, "same_image": same, "black": black}.items()}
    for fault, findings in found.items():
        assert [(finding["fault"], finding["refused"]) for finding in findings] == [(fault, True)]
    assert dynvox.diagnose(rig, frames) == []
    millimetres = dynvox.Rig(rig.focal_px, rig.center_u_px, rig.center_v_px, 540.0)
    assert [finding["fault"] for finding in dynvox.diagnose(millimetres, pairs)] == ["baseline"]


def test_a_refused_pair_is_not_mapped_and_a_good_one_may_follow():
    left, right = pair()
    made = mapper()
    with pytest.raises(dynvox.Error, match="same image"):
        made.step(left, left)
    assert made.step(left, right)["frame"] == 0 and made.warnings == []


def test_poses_that_are_no_rigid_motion_within_the_map_are_refused():
    transposed = np.eye(4)
    transposed[3, :3] = [5, 6, 7]
    sheared = np.eye(4)
    sheared[0, 1] = 0.1
    wrong = {
        "transposed": [transposed],
        "scaled or sheared": [np.diag([s, s, s, 1.0]) for s in (1.005, 1.01, 1.05, 0.9)] + [sheared, np.zeros((3, 4))],
        "mirrored": [np.diag([-1.0, 1, 1, 1]), np.diag([1.0, -1, 1, 1])],
        "beyond the map": [moved(x) for x in (3e4, -3e4, 1e9, 1e300)],
        "not finite": [moved(np.nan), moved(np.inf)],
    }
    for sentence, poses in wrong.items():
        for pose in poses:
            made = mapper()
            with pytest.raises(dynvox.Error, match=sentence):
                made.step(*pair(), t_world_camera=pose)
            assert made.step(*pair(), t_world_camera=np.eye(4, dtype=np.float32))["frame"] == 0
    for pose in (np.diag([1.0001] * 3 + [1]), np.round(np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0], 3)):
        pose = np.hstack([pose[:3, :3] * np.sign(np.linalg.det(pose[:3, :3])), np.zeros((3, 1))])
        assert mapper().step(*pair(), t_world_camera=pose)["frame"] == 0


def test_fused_is_true_only_if_something_was_fused():
    black = np.zeros((HEIGHT, WIDTH), np.uint8)
    empty = mapper().step(black, black, t_world_camera=np.eye(4))
    assert (empty["fused"], empty["allocate"]["made"]) == (False, 0)
    full = mapper().step(*pair(), t_world_camera=np.eye(4))
    assert full["fused"] and full["allocate"]["made"] > 0


def test_tracks_have_numbers_of_their_own():
    made = mapper(instances="none")
    mask = np.ones((24, 40), bool)
    for frame in range(3):
        made.step(*pair(), detections=[dynvox.Detection(mask, 60, 20), dynvox.Detection(mask, 200, 20)])
    assert [track["id"] for track in made.tracks] == [1, 2]


FORKED = """
import os, sys, dynvox, numpy as np
from pathlib import Path
rng = np.random.default_rng(0)
wide = rng.integers(0, 255, (96, 340), dtype=np.uint8)
left, right = np.ascontiguousarray(wide[:, :320]), np.ascontiguousarray(wide[:, 10:330])
mapper = dynvox.Mapper(dynvox.Rig(200, 160, 48, 0.5), memory="32MiB", threads=2, **({"stream": sys.argv[2]} if len(sys.argv) > 2 else {}))
mapper.step(left, right)
before = mapper.snapshot()
child = os.fork()
if child == 0:
    try:
        mapper.step(left, right)
    except dynvox.Error as error:
        sys.exit(7 if f"belongs to process {os.getppid()}" in str(error) else 8)
    sys.exit(9)
status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
assert mapper.snapshot() == before and mapper.step(left, right)["frame"] == 1
print(status)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork on this system")
def test_a_forked_child_is_told_whose_mapper_it_has(tmp_path):
    for more in ([], [str(tmp_path / "map.blocks")]):
        done = subprocess.run([sys.executable, "-c", FORKED, "x", *more], capture_output=True, text=True, timeout=120)
        assert (done.returncode, done.stdout.strip()) == (0, "7"), done.stderr


def test_other_threads_run_while_a_mapper_is_made():
    gaps, stop = [], threading.Event()

    def tick():
        last = time.perf_counter()
        while not stop.is_set():
            time.sleep(0.001)
            now = time.perf_counter()
            gaps.append(now - last)
            last = now

    clock = threading.Thread(target=tick)
    clock.start()
    time.sleep(0.05)
    gaps.clear()
    made = dynvox.Mapper(dynvox.Rig(700, 600, 180, 0.54), image=(1242, 375), memory="1GiB")
    ticks = len(gaps)
    stop.set()
    clock.join()
    # Were the interpreter held, the other thread would have come to its turn once at most.
    assert made.slab_bytes > 1 << 29 and ticks > 2


def test_a_view_that_is_not_dense_is_copied():
    left, right = pair()
    expected = mapper()
    expected.step(left, right)
    wide = [np.repeat(picture, 2, axis=1)[:, ::2] for picture in (left, right)]
    flipped = [picture[::-1, ::-1][::-1, ::-1] for picture in (left, right)]
    columns = [np.asfortranarray(picture) for picture in (left, right)]
    for views in (wide, flipped, columns):
        made = mapper()
        made.step(*views)
        assert made.digest == expected.digest


def test_colours_of_opencv_are_taken():
    left, right = pair()
    colour = np.stack([left, left // 2, left // 3], axis=2)
    digests = []
    for given, options in ((colour, {}), (colour[..., ::-1], {"channels": "bgr"}), (np.ascontiguousarray(colour[..., ::-1])[..., ::-1], {})):
        made = mapper(**options)
        made.step(left, right, colour=given)
        digests.append(made.digest)
    assert len(set(digests)) == 1
    with pytest.raises(dynvox.Error, match='channels is "rgba". Give "rgb" or "bgr"'):
        mapper(channels="rgba")


def test_a_closed_mapper_says_so():
    with mapper() as made:
        made.step(*pair())
    for call in (lambda: made.step(*pair()), made.snapshot, lambda: made.tracks, made.finish):
        with pytest.raises(dynvox.Error, match="the mapper is closed. Make another one"):
            call()
    made.close()


def test_rigs_are_equal_by_their_numbers_and_survive_pickle():
    rig, same, other = RIG, dynvox.Rig(200, 160, 48, 0.5), dynvox.Rig(201, 160, 48, 0.5)
    assert rig == same and hash(rig) == hash(same) and rig != other and rig != 3
    assert pickle.loads(pickle.dumps(rig)) == rig
    of_street = dynvox.Dataset(frames=1).rig
    assert pickle.loads(pickle.dumps(of_street)) == of_street and of_street.size == (640, 192)


def test_the_rig_of_raw_cameras_survives_pickle(tmp_path):
    camera = textwrap.dedent(
        """
        cam{at}:
          camera_model: pinhole
          distortion_model: radtan
          distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]
          intrinsics: [458.6, 457.3, 367.2, 248.4]
          resolution: [752, 480]
        """
    )
    motion = "  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, -0.11]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, 0.0, 0.0, 1.0]\n"
    file = tmp_path / "camchain.yaml"
    file.write_text(camera.format(at=0) + camera.format(at=1).rstrip() + "\n" + motion)
    rig = dynvox.read_calibration(file)
    again = pickle.loads(pickle.dumps(rig))
    assert again == rig and again.raw_size == (752, 480) and again.size == rig.size


def test_the_home_folder_and_paths_are_expanded(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    for path in ("~/nowhere", pathlib.Path("~/nowhere"), b"~/nowhere"):
        with pytest.raises(dynvox.Error, match=re.escape(str(tmp_path / "nowhere"))):
            dynvox.Dataset(path)
    with pytest.raises(dynvox.Error, match=re.escape(str(tmp_path / "nowhere.yaml"))):
        dynvox.read_calibration("~/nowhere.yaml")
    mapper(stream=pathlib.Path("~/map.blocks"), image=(WIDTH, HEIGHT))
    assert (tmp_path / "map.blocks").is_file()
    with pytest.raises(dynvox.Error, match=re.escape(str(tmp_path / "masks"))):
        dynvox.Dataset(instances="files:~/masks", frames=1).mapper()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"memry": "32MiB"}, "there is no option memry. Did you mean memory\\? Give one of "),
        ({"zzz": 1}, "there is no option zzz. Give one of "),
        ({"set": {"volume.voxel_size_m": np.array([0.1])}}, "the option volume.voxel_size_m: is an array|volume.voxel_size_m"),
        ({"set": {"volume.voxel_size_m": float("nan")}}, "not finite"),
        ({"set": {1: 2}}, "1 is no name of an option"),
        ({"memory": object()}, "memory"),
        ({"memory": 1 << 80}, "64 bits"),
        ({"stream": 5}, "stream is no path"),
    ],
)
def test_odd_options_are_refused(options, sentence):
    with pytest.raises(dynvox.Error, match=sentence):
        mapper(**options, image=(WIDTH, HEIGHT))


def test_numbers_of_numpy_are_numbers():
    made = mapper(set={"volume.voxel_size_m": np.float32(0.125)}, memory=np.int64(32 << 20), image=(WIDTH, HEIGHT))
    assert "voxel_size_m = 0.125" in made.config_toml and made.slab_bytes <= 32 << 20


def test_confidence_is_there_when_it_is_asked_for():
    left, right = pair()
    plain, asked = mapper(), mapper(set={"stereo.min_confidence": 1})
    for each in (plain, asked):
        each.step(left, right)
    assert plain.confidence is None
    confidence = asked.confidence
    assert confidence.shape == (HEIGHT, WIDTH) and np.array_equal(confidence > 0, asked.disparity_q8 > 0) and (confidence > 0).mean() > 0.3
    asked.step(left, right, disparity_q8=asked.disparity_q8)
    assert asked.confidence is None


def test_a_position_moves_the_closed_world_alone():
    made = mapper(keyframes=50)
    for at in range(12):
        report = made.step(*pair(6 * at))
    driven = made.t_world_camera
    assert np.array_equal(made.t_closed_driven, np.eye(4)) and driven[0, 3] > 2
    made.add_position(driven[:3, 3] + [0.05, 0, 0], [1e-3] * 3)
    with pytest.raises(dynvox.Error, match="no keyframe without a fix"):
        made.add_position([0, 0, 0], [1, 1, 1])
    assert np.array_equal(made.t_world_camera, driven)
    moved = 0
    for at in range(12, 24):
        report = made.step(*pair(6 * at))
        moved += report["world_moved"]
    assert moved == 1 and made.t_closed_driven[0, 3] == pytest.approx(0.05, abs=0.02)
    # Its own motion is as before: 0.3 m a step.
    assert made.t_world_camera[0, 3] - driven[0, 3] == pytest.approx(12 * 0.3, abs=0.1)
    # The newest keyframe has no fix yet: a vertical off the one as driven tilts the closed world alone.
    up = [0, -1, 0]
    with pytest.raises(dynvox.Error, match="no rigid motion"):
        made.add_vertical([0, 0, 0], up, 0.001)
    made.add_vertical([np.sin(0.004), -np.cos(0.004), 0], up, 0.0005)
    for at in range(24, 36):
        made.step(*pair(6 * at))
    # Motions count as well, by their errors.
    assert 0.0002 < abs(made.t_closed_driven[1, 0]) < 0.004
    with pytest.raises(dynvox.Error, match="without an error"):
        made.add_fix(made.t_world_camera, np.zeros((6, 6)))
    with pytest.raises(dynvox.Error, match="keyframes"):
        mapper(image=(WIDTH, HEIGHT)).add_position([0, 0, 0], [1, 1, 1])
