"""The scripts for live cameras map what a simulated device shows: modules of the same names and calls, and the synthetic street before the lenses."""

import runpy
import sys
from contextlib import contextmanager
from datetime import timedelta
from functools import cache
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from conftest import ROOT

import dynvox

FRAMES = 4
EXAMPLES = ROOT / "host/python/examples"


@cache
class Street:
    """The pairs that a device sees, with its cameras."""

    def __init__(self, width, height):
        self.dataset = dynvox.Dataset(frames=FRAMES, set={"street.width": width, "street.height": height}, planning="100x100x20")
        self.rig, self.pairs = self.dataset.rig, [(frame["left"], frame["right"]) for frame in self.dataset]
        # Synthetic pictures come in colour; the cameras here are grey.
        self.pairs = [tuple(grey(picture) for picture in pair) for pair in self.pairs]
        assert self.pairs[0][0].shape == (height, width)

    @cache
    def expected(self):
        """What the command line's defaults make of the same pairs, as the scripts print it."""
        rig = self.rig
        mapper = dynvox.Mapper(dynvox.Rig(rig.focal_px, rig.center_u_px, rig.center_v_px, rig.baseline_m), planning="100x100x20")
        reports = [mapper.step(*pair, time_ns=time_ns(index)) for index, pair in enumerate(self.pairs)]
        return [f"{report['frame']} {report['t_world_camera']['translation_m']} {report['severity']}" for report in reports]


def grey(picture):
    if picture.ndim == 2:
        return picture
    red, green, blue = (picture[..., channel].astype(np.uint32) for channel in range(3))
    return ((77 * red + 150 * green + 29 * blue + 128) >> 8).astype(np.uint8)


def time_ns(index):
    return 5_000_000_000 + index * 100_000_000


def run(monkeypatch, capsys, script, arguments, modules):
    for name, module in modules.items():
        fake = ModuleType(name)
        vars(fake).update(vars(module))
        monkeypatch.setitem(sys.modules, name, fake)
    monkeypatch.setattr(sys, "argv", [script, *map(str, arguments)])
    runpy.run_path(str(EXAMPLES / script), run_name="__main__")
    return capsys.readouterr().out.splitlines()


def numbers(lines):
    """Frame, position and severity of each line: a device's numbers are rounded to 32 bits."""
    parsed = []
    for line in lines:
        frame, rest = line.split(" ", 1)
        position, severity = rest.rsplit(")", 1) if ")" in rest else rest.rsplit("]", 1)
        parsed.append((int(frame), [float(part) for part in position.strip("([").split(",")], severity.strip()))
    return parsed


def same(lines, street):
    assert len(lines) == FRAMES
    for (frame, position, severity), (right_frame, right_position, right_severity) in zip(numbers(lines), numbers(street.expected())):
        assert (frame, severity) == (right_frame, right_severity)
        np.testing.assert_allclose(position, right_position, atol=1e-3)
    assert numbers(lines)[-1][1][2] > 1.0, "the camera drove on"


class Stops(Exception):
    """A device that is asked for more than it has."""


class Oak:
    """depthai, version 3: cameras, rectification on the device, pairs in one message."""

    def __init__(self, street):
        self.street, self.linked, self.started = street, {}, False
        node = SimpleNamespace(Camera="camera", StereoDepth="stereo", Sync="sync")
        self.module = SimpleNamespace(
            node=node,
            CameraBoardSocket=SimpleNamespace(CAM_B="left", CAM_C="right"),
            ImgFrame=SimpleNamespace(Type=SimpleNamespace(GRAY8="gray8")),
            Pipeline=lambda: self,
        )

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.started = False

    def create(self, node):
        return getattr(self, f"create_{node}")()

    def create_camera(self):
        def request(socket, size, kind):
            assert size == (640, 400) and kind == "gray8"
            return socket

        return SimpleNamespace(build=lambda socket: SimpleNamespace(requestOutput=lambda size, kind: request(socket, size, kind)))

    def create_stereo(self):
        def link(side):
            return SimpleNamespace(link=lambda to: self.linked.update({to: side}))

        def build(left, right):
            assert (left, right) == ("left", "right")
            return SimpleNamespace(rectifiedLeft=link("left"), rectifiedRight=link("right"))

        return SimpleNamespace(build=build)

    def create_sync(self):
        return SimpleNamespace(inputs={"left": "in left", "right": "in right"}, out=SimpleNamespace(createOutputQueue=lambda: SimpleNamespace(get=self.get)))

    def start(self):
        assert self.linked == {"in left": "left", "in right": "right"}
        self.started, self.next = True, 0

    def isRunning(self):
        return self.started

    def get(self):
        if self.next == FRAMES:
            raise Stops
        pair, at = self.street.pairs[self.next], time_ns(self.next)
        self.next += 1
        return {
            side: SimpleNamespace(getCvFrame=lambda picture=picture: picture, getTimestampDevice=lambda: timedelta(microseconds=at // 1000))
            for side, picture in zip(("left", "right"), pair)
        }

    def getDefaultDevice(self):
        return SimpleNamespace(readCalibration=lambda: self)

    def getCameraIntrinsics(self, socket, width, height):
        assert (socket, width, height) == ("right", 640, 400)
        rig = self.street.rig
        return [[rig.focal_px, 0.0, rig.center_u_px], [0.0, rig.focal_px, rig.center_v_px], [0.0, 0.0, 1.0]]

    def getBaselineDistance(self, one, other, useSpecTranslation):
        assert {one, other} == {"left", "right"} and not useSpecTranslation
        return 100 * self.street.rig.baseline_m


def test_an_oak_d_is_mapped(monkeypatch, capsys):
    street = Street(640, 400)
    oak = Oak(street)
    same(run(monkeypatch, capsys, "live_oak.py", [FRAMES], {"depthai": oak.module}), street)
    assert not oak.started, "the device is given back"


class RealSense:
    """pyrealsense2: one pipeline with two infrared streams, rectified on the device."""

    def __init__(self, street):
        self.street, self.streams, self.options, self.running, self.next = street, {}, {}, False, 0
        self.module = SimpleNamespace(
            config=lambda: self,
            pipeline=lambda: self,
            stream=SimpleNamespace(infrared="infrared"),
            format=SimpleNamespace(y8="y8"),
            option=SimpleNamespace(emitter_enabled="emitter"),
        )

    def enable_stream(self, kind, index, width, height, form, rate):
        assert (kind, width, height, form) == ("infrared", 640, 480, "y8")
        self.streams[index] = rate

    def start(self, config):
        assert config is self and set(self.streams) == {1, 2}
        self.running = True
        return self

    def stop(self):
        self.running = False

    def get_device(self):
        return SimpleNamespace(first_depth_sensor=lambda: SimpleNamespace(set_option=lambda option, value: self.options.update({option: value})))

    def get_stream(self, kind, index):
        rig = self.street.rig
        lens = SimpleNamespace(fx=rig.focal_px, fy=rig.focal_px, ppx=rig.center_u_px, ppy=rig.center_v_px)
        # The translation of points from the left to the right camera.
        extrinsics = SimpleNamespace(translation=[-rig.baseline_m, 0.0, 0.0])
        video = SimpleNamespace(get_intrinsics=lambda: lens, get_extrinsics_to=lambda other: extrinsics)
        return SimpleNamespace(as_video_stream_profile=lambda: video)

    def wait_for_frames(self):
        assert self.running and self.options == {"emitter": 0}
        if self.next == FRAMES:
            raise Stops
        pair, at = self.street.pairs[self.next], time_ns(self.next)
        self.next += 1
        return SimpleNamespace(
            get_infrared_frame=lambda index: SimpleNamespace(get_data=lambda: memoryview(np.ascontiguousarray(pair[index - 1]))),
            get_timestamp=lambda: at / 1e6,
        )


def test_a_realsense_is_mapped_and_given_back(monkeypatch, capsys):
    street = Street(640, 480)
    device = RealSense(street)
    same(run(monkeypatch, capsys, "live_realsense.py", [FRAMES], {"pyrealsense2": device.module}), street)
    assert not device.running
    # A device that fails is given back, too.
    broken = RealSense(street)
    with pytest.raises(Stops):
        run(monkeypatch, capsys, "live_realsense.py", [], {"pyrealsense2": broken.module})
    assert not broken.running


class Pi:
    """picamera2: two cameras whose pictures are paired by their times."""

    def __init__(self, street, lost):
        self.street, self.lost, self.started = street, lost, []
        modes = SimpleNamespace(Server="server", Client="client")
        self.controls = SimpleNamespace(rpi=SimpleNamespace(SyncModeEnum=modes))
        self.module = SimpleNamespace(Picamera2=lambda number: Camera(self, number))


class Camera:
    def __init__(self, device, number):
        self.device, self.number = device, number
        self.frames = [index for index in range(FRAMES) if index not in device.lost[number]]

    def create_video_configuration(self, main, controls):
        assert main == {"size": (640, 480), "format": "YUV420"}
        return controls

    def configure(self, controls):
        self.role = controls["SyncMode"]
        assert controls["FrameRate"] == 20

    def start(self):
        self.device.started.append(self.role)

    @contextmanager
    def captured_request(self):
        assert self.device.started == ["client", "server"]
        if not self.frames:
            raise Stops
        index = self.frames.pop(0)
        picture = self.device.street.pairs[index][self.number]
        height, width = picture.shape
        # Rows are padded, and colours follow below.
        planes = np.full((height * 3 // 2, width + 64), 7, np.uint8)
        planes[:height, :width] = picture
        yield SimpleNamespace(
            make_array=lambda stream: {"main": planes}[stream],
            # Cameras in step are still some microseconds apart.
            get_metadata=lambda: {"SensorTimestamp": time_ns(index) + 40_000 * self.number},
        )


def calibration(street, folder):
    rig = street.rig
    path = folder / "calib.txt"
    numbers = [f"{rig.focal_px} 0 {rig.center_u_px} {x} 0 {rig.focal_px} {rig.center_v_px} 0 0 0 1 0" for x in (0, -rig.focal_px * rig.baseline_m)]
    path.write_text(f"P0: {numbers[0]}\nP1: {numbers[1]}\n")
    return path


def test_two_cameras_of_a_pi_are_mapped(monkeypatch, capsys, tmp_path):
    street = Street(640, 480)
    pi = Pi(street, lost=[(), ()])
    modules = {"picamera2": pi.module, "libcamera": SimpleNamespace(controls=pi.controls)}
    same(run(monkeypatch, capsys, "live_picamera.py", [calibration(street, tmp_path), FRAMES], modules), street)


def test_pictures_of_a_pi_without_a_partner_are_left_out(monkeypatch, capsys, tmp_path):
    street = Street(640, 480)
    pi = Pi(street, lost=[(1,), (2,)])
    modules = {"picamera2": pi.module, "libcamera": SimpleNamespace(controls=pi.controls)}
    lines = run(monkeypatch, capsys, "live_picamera.py", [calibration(street, tmp_path), 2], modules)
    # Frames 0 and 3 have both pictures: 0.3 s and 2.7 m lie between them.
    assert [frame for frame, _, _ in numbers(lines)] == [0, 1]
    assert 2.0 < numbers(lines)[1][1][2] < 3.4
