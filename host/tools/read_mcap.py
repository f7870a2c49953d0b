#!/usr/bin/env python3
"""Reads a run's recording back with the `mcap` package of PyPI and compares it with the rest of the run folder.

host/tools/read_mcap.py RUN_FOLDER      (needs mcap, jsonschema, numpy, pillow)

Every message must satisfy the schema in the file; times, poses, figures and the sizes of images must be those of frames.csv, trajectory_tum.txt and
summary.json; topics must have as many messages as the run has frames. Prints a line for each topic.
"""
import base64, collections, csv, io, json, pathlib, sys

import jsonschema
import numpy as np
from mcap.reader import make_reader
from PIL import Image

folder = pathlib.Path(sys.argv[1])
rows = list(csv.DictReader(open(folder / "frames.csv")))
poses = np.loadtxt(folder / "trajectory_tum.txt", ndmin=2)
SCHEMAS = {
    "/tf": "foxglove.FrameTransform", "/camera/pose": "foxglove.PoseInFrame", "/camera/left/image": "foxglove.CompressedImage",
    "/camera/left/calibration": "foxglove.CameraCalibration", "/camera/disparity": "foxglove.CompressedImage",
    "/objects": "foxglove.SceneUpdate", "/figures": None, "/map/seen": "foxglove.PointCloud", "/trajectory": "foxglove.PosesInFrame",
    "/planning/grid": "foxglove.Grid",
}
EVERY_FRAME = [topic for topic in SCHEMAS if topic not in ("/map/seen", "/planning/grid", "/trajectory")]
counts, bytes_of, times, validators, failures = collections.Counter(), collections.Counter(), collections.defaultdict(list), {}, []


def require(holds, sentence):
    if not holds:
        failures.append(sentence)


def numbers(value, names):
    return [value[name] for name in names]


with open(folder / "run.mcap", "rb") as file:
    reader = make_reader(file, validate_crcs=True)
    summary = reader.get_summary()
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        topic, text = channel.topic, json.loads(message.data)
        if schema.id not in validators:
            validators[schema.id] = jsonschema.Draft202012Validator(json.loads(schema.data))
            known = SCHEMAS.get(topic)
            require(topic in SCHEMAS and (known is None or schema.name == known), f"{topic} has the schema {schema.name}")
            require((schema.encoding, channel.message_encoding) == ("jsonschema", "json"), f"{topic} is {channel.message_encoding}")
        for error in validators[schema.id].iter_errors(text):
            failures.append(f"{topic}: {error.message}")
        if topic == "/tf" and text["child_frame_id"] == "world":
            # The world as driven in that after all loops, with keyframes.
            topic = "/tf closed"
        at = counts[topic]
        counts[topic] += 1
        bytes_of[topic] += len(message.data)
        times[topic].append(message.log_time)
        if topic == "/camera/pose":
            given = numbers(text["pose"]["position"], "xyz") + numbers(text["pose"]["orientation"], "xyzw")
            same = min(np.abs(np.array(given) - poses[at][1:]).max(), np.abs(np.array(given)[3:] + poses[at][4:]).max())
            require(same < 1e-6, f"the pose of frame {at} differs by {same}")
        if topic in ("/camera/left/image", "/camera/disparity"):
            image = Image.open(io.BytesIO(base64.b64decode(text["data"])))
            image.load()
            require(image.width > 0 and image.format == text["format"].upper(), f"{topic} {at} is {image.format}, not {text['format']}")
        if topic == "/planning/grid":
            cells = np.frombuffer(base64.b64decode(text["data"]), np.dtype([("distance_m", "<f4"), ("height_m", "<f4"), ("occupancy", "i1"), ("", "V3")]))
            require(cells.size % text["column_count"] == 0 and set(cells["occupancy"]) <= {-1, 0, 100}, f"{topic} {at} has other cells")
            require(bool(np.all(cells["distance_m"][cells["occupancy"] == 100] < 0)), f"{topic} {at}: an obstacle has a distance above 0")
        if topic == "/map/seen":
            points = len(base64.b64decode(text["data"])) / text["point_stride"]
            require(points > 0 and points == int(points), f"{topic} has {points} points")

frame_times = [round(float(row["time_s"]) * 1e9) for row in rows]
for topic in EVERY_FRAME:
    require(counts[topic] == len(rows), f"{topic} has {counts[topic]} messages, and the run {len(rows)} frames")
    apart = max((abs(a - b) for a, b in zip(times[topic], frame_times)), default=0)
    require(apart <= 1_000, f"{topic} is {apart} ns off the times of frames.csv")
require(counts["/map/seen"] == -(-len(rows) // 10), f"/map/seen has {counts['/map/seen']} messages")
require(counts["/planning/grid"] in (0, counts["/map/seen"]), f"/planning/grid has {counts['/planning/grid']} messages")
require(counts["/trajectory"] == 1, f"/trajectory has {counts['/trajectory']} messages")
require(summary.statistics.message_count == sum(counts.values()), "the statistics count other messages")
require(counts["/tf closed"] <= len(rows), f"the closed world has {counts['/tf closed']} transforms")
for topic, count in sorted(counts.items()):
    print(f"{topic:<26}{count:>6} messages {bytes_of[topic]:>10} bytes, {times[topic][0] / 1e9:.3f} to {times[topic][-1] / 1e9:.3f} s")
print("\n".join(failures[:20]) or f"{sum(counts.values())} messages in {len(summary.chunk_indexes)} chunks, as the run folder has it")
sys.exit(bool(failures))
