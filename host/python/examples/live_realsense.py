"""Maps what a RealSense D4xx sees: python live_realsense.py [FRAMES]. Needs `pip install pyrealsense2`."""

import sys

import numpy as np
import pyrealsense2 as rs

import dynvox

frames = int(sys.argv[1]) if len(sys.argv) > 1 else None
config, pipeline = rs.config(), rs.pipeline()
for index in (1, 2):
    config.enable_stream(rs.stream.infrared, index, 640, 480, rs.format.y8, 30)
profile = pipeline.start(config)
# The projected dots stay with the camera and not with the scene.
profile.get_device().first_depth_sensor().set_option(rs.option.emitter_enabled, 0)

# The infrared pictures come rectified.
left, right = (profile.get_stream(rs.stream.infrared, index).as_video_stream_profile() for index in (1, 2))
lens = left.get_intrinsics()
rig = dynvox.Rig(lens.fx, lens.ppx, lens.ppy, abs(left.get_extrinsics_to(right).translation[0]))

try:
    with dynvox.Mapper(rig, planning="100x100x20") as mapper:
        while True:
            pair = pipeline.wait_for_frames()
            grey = [np.asanyarray(pair.get_infrared_frame(index).get_data()) for index in (1, 2)]
            report = mapper.step(*grey, time_ns=int(pair.get_timestamp() * 1e6))
            print(report["frame"], report["t_world_camera"]["translation_m"], report["severity"])
            if report["frame"] + 1 == frames:
                break
finally:
    pipeline.stop()
