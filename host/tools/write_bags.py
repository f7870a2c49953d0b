#!/usr/bin/env python3
"""Writes the street's frames as recordings of ROS 2 by other tools: `mcap` and `rosbags` of PyPI.

host/tools/write_bags.py STREET OUT      (needs mcap, rosbags, numpy, pillow)

STREET is a folder of `dynvox synth`. OUT gets mcap.mcap (the mcap package: CDR written by rosbags' type system) and rosbags/ (a bag of
rosbags with MCAP storage), raw mono8 images and CameraInfo; `dynvox run` on each must give the digest of `dynvox run STREET --images grey`.
"""
import pathlib, sys

import numpy as np
from mcap.writer import Writer as McapWriter
from PIL import Image
from rosbags.rosbag2 import StoragePlugin, Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

street, out = pathlib.Path(sys.argv[1]) / "sequences/00", pathlib.Path(sys.argv[2])
out.mkdir(parents=True)
types = get_typestore(Stores.ROS2_HUMBLE)
of = lambda name: types.types[name]
TIME, HEADER, IMAGE = of("builtin_interfaces/msg/Time"), of("std_msgs/msg/Header"), of("sensor_msgs/msg/Image")
INFO, ROI = of("sensor_msgs/msg/CameraInfo"), of("sensor_msgs/msg/RegionOfInterest")
projections = [[float(word) for word in line.split()[1:]] for line in open(street / "calib.txt") if line[:3] in ("P0:", "P1:")]
times = [float(line) for line in open(street / "times.txt")]


def messages():
    """Topic, type, time in ns and message of everything, in the order of time."""
    for frame, time_s in enumerate(times):
        ns = round(time_s * 1e9)
        header = HEADER(stamp=TIME(sec=ns // 10**9, nanosec=ns % 10**9), frame_id="camera")
        for side, name in enumerate(["left", "right"]):
            pixels = np.asarray(Image.open(street / f"image_{side}/{frame:06}.png").convert("L"))
            height, width = pixels.shape
            p = np.array(projections[side])
            info = INFO(header=header, height=height, width=width, distortion_model="plumb_bob", d=np.zeros(5), k=p.reshape(3, 4)[:, :3].flatten(),
                        r=np.eye(3).flatten(), p=p, binning_x=0, binning_y=0,
                        roi=ROI(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False))
            image = IMAGE(header=header, height=height, width=width, encoding="mono8", is_bigendian=0, step=width, data=pixels.flatten())
            yield f"/stereo/{name}/camera_info", "sensor_msgs/msg/CameraInfo", ns, info
            yield f"/stereo/{name}/image_rect", "sensor_msgs/msg/Image", ns, image


with open(out / "mcap.mcap", "wb") as file:
    writer = McapWriter(file)
    writer.start(profile="ros2", library="mcap of PyPI")
    channels = {}
    for topic, kind, ns, message in messages():
        if topic not in channels:
            schema = writer.register_schema(name=kind, encoding="ros2msg", data=types.generate_msgdef(kind)[0].encode())
            channels[topic] = writer.register_channel(topic=topic, message_encoding="cdr", schema_id=schema)
        writer.add_message(channel_id=channels[topic], log_time=ns, publish_time=ns, data=bytes(types.serialize_cdr(message, kind)))
    writer.finish()

with BagWriter(out / "rosbags", version=9, storage_plugin=StoragePlugin.MCAP) as bag:
    connections = {}
    for topic, kind, ns, message in messages():
        if topic not in connections:
            connections[topic] = bag.add_connection(topic, kind, typestore=types)
        bag.write(connections[topic], ns, types.serialize_cdr(message, kind))
