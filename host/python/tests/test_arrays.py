"""What goes in is borrowed, what comes out agrees with itself."""

import numpy as np
import pytest

import dynvox
from dynvox import _dynvox


@pytest.fixture(scope="module")
def street():
    dataset = dynvox.Dataset(frames=6, instances="exact", memory="96MiB")
    mapper = dataset.mapper()
    reports = [mapper.step(**frame) for frame in dataset]
    return dataset, mapper, reports


def test_the_core_reads_the_arrays_own_memory():
    grey = np.zeros((96, 320), np.uint8)
    assert _dynvox._borrowed(grey) == (grey.ctypes.data, 320)
    # A part of a larger picture: rows of 512 pixels, from row 3 and column 5 on.
    larger = np.zeros((200, 512), np.uint8)
    part = larger[3:99, 5:325]
    assert _dynvox._borrowed(part) == (larger.ctypes.data + 3 * 512 + 5, 512)
    every_second_row = larger[::2, :320]
    assert _dynvox._borrowed(every_second_row) == (larger.ctypes.data, 1024)
    colour = np.zeros((96, 320, 3), np.uint8)
    assert _dynvox._borrowed(colour) == (colour.ctypes.data, 320)
    # Both pictures of a camera that delivers them side by side.
    both = np.zeros((96, 640, 3), np.uint8)
    assert _dynvox._borrowed(both[:, 320:]) == (both.ctypes.data + 3 * 320, 640)


def test_parts_of_arrays_and_read_only_files_give_the_bits_of_whole_arrays(tmp_path):
    dataset = dynvox.Dataset(frames=3)
    whole, parts = dataset.mapper(), dataset.mapper()
    for frame in dataset:
        height, width = frame["left"].shape
        both = np.empty((height, 2 * width), np.uint8)
        both[:, :width], both[:, width:] = frame["left"], frame["right"]
        both.tofile(tmp_path / "both")
        both = np.memmap(tmp_path / "both", np.uint8, "r", shape=both.shape)
        rest = {key: value for key, value in frame.items() if key not in ("left", "right")}
        parts.step(both[:, :width], both[:, width:], **rest)
        whole.step(**frame)
        assert parts.digest == whole.digest


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda image: image.astype(np.float32), "left has values of float32, and uint8 is needed"),
        (lambda image: image.T, "frame 0 was refused: its images differ in size"),
        (lambda image: image[:, ::2], "frame 0 was refused: its images differ in size"),
        (lambda image: image.tolist(), "left is no numpy array"),
        (lambda image: image[None], "left has the shape"),
        (lambda image: image[:0], "left has the shape"),
        (lambda image: image[0], "left has the shape"),
        (lambda image: image[:, :-1], "frame 0 was refused: its images differ in size"),
    ],
)
def test_arrays_that_cannot_be_borrowed_are_refused(change, sentence):
    image = np.zeros((96, 320), np.uint8)
    mapper = dynvox.Mapper(dynvox.Rig(200, 160, 48, 0.5), memory="16MiB")
    with pytest.raises(dynvox.Error, match=sentence):
        mapper.step(change(image), image)
    assert mapper.step(image, image)["frame"] == 0


def test_colours_whose_rows_are_not_whole_pixels_apart_are_copied():
    bytes_of = np.zeros((96, 320 * 3 + 1), np.uint8)
    colour = np.lib.stride_tricks.as_strided(bytes_of, (96, 320, 3), (320 * 3 + 1, 3, 1))
    address, stride = _dynvox._borrowed(colour)
    assert address != bytes_of.ctypes.data and stride == 320


def test_a_frame_has_tracks_triangles_and_a_picture(street):
    dataset, mapper, reports = street
    width, height = dataset.size
    assert [report["frame"] for report in reports] == list(range(6)) and reports[0]["severity"] == "info"
    assert np.allclose(dynvox.matrix(reports[-1]["t_world_camera"]), mapper.t_world_camera)
    assert np.linalg.norm(mapper.t_world_camera[:3, 3] - dataset.truth[-1][:3, 3]) < 0.1
    assert mapper.disparity_q8.shape == (height, width) and (mapper.disparity_q8 > 0).mean() > 0.5
    assert mapper.confidence is None
    positions_m, colours = mapper.triangles()
    assert positions_m.shape == colours.shape == (len(positions_m), 3, 3) and len(positions_m) > 100_000
    view = mapper.raycast()
    shown = view["depth_m"] > 0
    assert view["depth_m"].shape == (height, width) and shown.mean() > 0.4 and (view["weight"][shown] > 0).mean() > 0.9
    tracks = mapper.tracks
    assert tracks and all(track["class_name"] in ("car", "person", "rider", "van", "truck") for track in tracks)
    for track in (track for track in tracks if track["blocks"] > 0):
        positions_m, colours = mapper.triangles(track["id"])
        centre = np.array(track["center_world_m"])
        assert len(positions_m) > 100 and np.linalg.norm(positions_m.reshape(-1, 3).mean(axis=0) - centre) < 3.0
    assert set(np.unique(view["object"])) <= {0} | {track["id"] for track in tracks}
    with pytest.raises(dynvox.Error, match="track 999 has no reconstructed object"):
        mapper.triangles(999)
    footprint = mapper.footprint()
    assert sum(region["bytes"] for region in footprint) == mapper.slab_bytes <= 96 << 20
    assert "voxel_size_m" in mapper.config_toml


def test_a_pose_is_a_matrix_or_what_a_report_has(street):
    _, mapper, reports = street
    by_report = mapper.raycast(reports[0]["t_world_camera"], objects=False)
    by_matrix = mapper.raycast(np.eye(4)[:3], objects=False)
    by_list = mapper.raycast(np.eye(4).tolist(), objects=False)
    assert np.array_equal(by_report["depth_m"], by_matrix["depth_m"]) and np.array_equal(by_list["depth_m"], by_matrix["depth_m"])
    thinned = mapper.raycast(np.eye(4), objects=False, every=4)
    assert np.array_equal(thinned["depth_m"], by_matrix["depth_m"][::4, ::4])
    with pytest.raises(dynvox.Error, match="cannot be read as a pose"):
        mapper.raycast(np.eye(3))
    with pytest.raises(dynvox.Error, match="is not finite"):
        mapper.raycast(np.full((4, 4), np.nan))


def test_instances_become_detections():
    instances = np.zeros((96, 320), np.uint16)
    instances[10:30, 20:60], instances[40:90, 100:200] = 2, 3
    found = dynvox.detections_of(instances, ["car", "van", "person"], [0.9, 0.8, 0.7])
    assert [(of.class_name, round(of.score, 1), of.left, of.top, of.mask.shape) for of in found] == [
        ("van", 0.8, 20, 10, (20, 40)),
        ("person", 0.7, 100, 40, (50, 100)),
    ]
    mapper = dynvox.Mapper(dynvox.Rig(200, 160, 48, 0.5), memory="16MiB", instances="none")
    image = np.zeros((96, 320), np.uint8)
    assert mapper.step(image, image, detections=found)["tracking"]["detections"]["given"] == 2
    with pytest.raises(dynvox.Error, match="2 class names"):
        dynvox.detections_of(instances, ["car", "van"])
    with pytest.raises(dynvox.Error, match='no class "teapot"'):
        dynvox.Detection(np.ones((2, 2), bool), 0, 0, "teapot")
    with pytest.raises(dynvox.Error, match="no dynvox.Detection"):
        mapper.step(image, image, detections=[1])


def test_triangles_are_those_of_the_map_on_disk(command_line):
    dataset = dynvox.Dataset(frames=6)
    mapper = dataset.mapper()
    for frame in dataset:
        mapper.step(**frame)
    mapper.finish()
    _, summary = command_line("--frames=6", "--map-objects=none")
    assert len(mapper.triangles()[0]) == summary["map"]["triangles"]


def test_a_scan_of_lidar(data):
    dataset = dynvox.Dataset(data / "kitti-odometry", sequence="r1405", frames=30)
    scans = [scan for scan in map(dataset.lidar, range(len(dataset))) if scan is not None]
    assert scans and all(scan.shape[1] == 3 and scan.dtype == np.float32 for scan in scans)


def test_a_planner_gets_the_window_around_the_camera():
    dataset = dynvox.Dataset(frames=6, planning="100x100x16", memory="96MiB")
    mapper = dataset.mapper()
    for frame in dataset:
        mapper.step(**frame)
    digest = mapper.digest
    plan = mapper.plan()
    assert plan["occupancy"].shape == plan["distance_m"].shape == plan["height_m"].shape == (100, 100)
    assert plan["occupancy"].dtype == np.int8 and set(np.unique(plan["occupancy"])) == {-1, 0, 100}
    assert (plan["distance_m"][plan["occupancy"] == 100] < 0).all()
    assert (plan["distance_m"][plan["occupancy"] == 0] > 0).all()
    assert abs(plan["cell_m"] - 0.2) < 1e-6
    # Up in the window is against the first camera's y, ahead is along its z.
    assert np.allclose(plan["t_world_corner"][:3, 1:3], [[0, 0], [0, -1], [1, 0]], atol=1e-3)
    assert np.nanmedian(plan["height_m"]) < 0.5
    assert plan["report"]["free"] > 100 and mapper.digest == digest
    with pytest.raises(dynvox.Error, match="no window for planners. Make it with planning="):
        dynvox.Dataset(frames=1).mapper().plan()
