"""Maps what two cameras of a Raspberry Pi 5 see: python live_picamera.py CALIBRATION [FRAMES]. Needs `apt install python3-picamera2`."""

import sys

from libcamera import controls
from picamera2 import Picamera2

import dynvox

SIZE, RATE_HZ = (640, 480), 20
frames = int(sys.argv[2]) if len(sys.argv) > 2 else None
rig = dynvox.read_calibration(sys.argv[1], image=SIZE)
cameras = [Picamera2(0), Picamera2(1)]
for camera, role in zip(cameras, (controls.rpi.SyncModeEnum.Server, controls.rpi.SyncModeEnum.Client)):
    main = {"size": SIZE, "format": "YUV420"}
    camera.configure(camera.create_video_configuration(main, controls={"FrameRate": RATE_HZ, "SyncMode": role}))
# The client waits for its server.
for camera in reversed(cameras):
    camera.start()


def capture(camera):
    """The next picture's grey and the time of its exposure, ns."""
    with camera.captured_request() as request:
        return request.make_array("main")[: SIZE[1], : SIZE[0]].copy(), request.get_metadata()["SensorTimestamp"]


with dynvox.Mapper(rig, planning="100x100x20") as mapper:
    left, right = map(capture, cameras)
    while True:
        # A pair was exposed within a quarter of a frame; of others the older picture has no partner.
        if abs(left[1] - right[1]) > 0.25e9 / RATE_HZ:
            left, right = (capture(cameras[0]), right) if left[1] < right[1] else (left, capture(cameras[1]))
            continue
        report = mapper.step(left[0], right[0], time_ns=left[1])
        print(report["frame"], report["t_world_camera"]["translation_m"], report["severity"])
        if report["frame"] + 1 == frames:
            break
        left, right = map(capture, cameras)
