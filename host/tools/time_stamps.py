#!/usr/bin/env python3
"""Speeds and motion states at other frame rates, with irregular time stamps and with dropped frames, against those at 10 Hz.

host/tools/time_stamps.py DYNVOX FOLDER [SETTING=VALUE ...] renders twelve seconds of the street at 30 Hz into FOLDER once, links its frames as 10 Hz, 30 Hz,
irregular and 10 Hz without every seventh frame, maps each with exact masks, and prints the median speed of each moving object.
"""
import collections, csv, os, pathlib, shutil, statistics, subprocess, sys

dynvox, folder, settings = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3:]
FRAMES = 360
# Speeds are compared where both runs measured an object in so many frames.
MEASURED_MIN = 8
STEPS = [1, 3, 2, 4, 1, 5, 3, 2, 6, 3]  # of 1/30 s


def selections():
    """Frames of each dressing, by name."""
    ten = list(range(0, FRAMES, 3))
    irregular, at = [], 0
    while at < FRAMES:
        irregular.append(at)
        at += STEPS[len(irregular) % len(STEPS)]
    return {"10 Hz": ten, "30 Hz": list(range(FRAMES)), "irregular": irregular,
            "10 Hz, every seventh dropped": [frame for nth, frame in enumerate(ten) if nth % 7 != 6]}


def dress(name, frames):
    """The chosen frames under their numbers: they choose the rows of times.txt."""
    street, out = folder / "street/sequences/00", folder / name.replace(" ", "-").replace(",", "")
    shutil.rmtree(out, ignore_errors=True)
    sequence = out / "sequences/00"
    for images in ["image_0", "image_1", "instances"]:
        (sequence / images).mkdir(parents=True)
        for frame in frames:
            for source in street.glob(f"{images}/{frame:06}.*"):
                os.symlink(source.resolve(), sequence / images / source.name)
    for file in ["calib.txt", "times.txt"]:
        shutil.copy(street / file, sequence / file)
    return out


def overlap(a, b):
    width, height = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    if width <= 0 or height <= 0:
        return 0.0
    area = lambda box: (box[2] - box[0]) * (box[3] - box[1])
    return width * height / (area(a) + area(b) - width * height)


def truth():
    """Boxes, ids and speeds of the true objects, by frame."""
    street, frames = folder / "street/sequences/00", collections.defaultdict(list)
    for row in csv.DictReader(open(street / "objects.csv")):
        frames[int(row["frame"])].append((int(row["instance"]), int(row["id"]), row["moving"] == "1", float(row["speed_m_s"])))
    boxes = {}
    for frame in frames:
        for line in open(street / f"instances/{frame:06}.txt"):
            if not line.startswith("#"):
                word = line.split()
                boxes[frame, int(word[0])] = [float(value) for value in word[3:7]]
    return {frame: [(boxes[frame, one[0]], *one[1:]) for one in objects if (frame, one[0]) in boxes] for frame, objects in frames.items()}


def tracks(out, true, frames):
    """Speed and state by frame of the street, of each true object; `frames` are the street's that were mapped."""
    seen = collections.defaultdict(dict)
    for row in csv.DictReader(open(out / "tracks.csv")):
        frame, box = frames[int(row["frame"])], [float(row[key]) for key in ["x1", "y1", "x2", "y2"]]
        best = max(true.get(frame, []), key=lambda one: overlap(one[0], box), default=None)
        if best and overlap(best[0], box) > 0.4:
            seen[best[1]][frame] = (float(row["speed_m_s"]) if row["speed_m_s"] and row["measured"] == "1" else None, row["state"], best[2], best[3])
    return seen


def main():
    folder.mkdir(exist_ok=True)
    options = [word for setting in settings for word in ("--set", setting)]
    if not (folder / "street").exists():
        subprocess.run([dynvox, "synth", "--out", folder / "street", "--frames", str(FRAMES), "--set", "street.rate_hz=30", *options], check=True)
    true, found = truth(), {}
    for name, frames in selections().items():
        data = dress(name, frames)
        masks = data / "sequences/00/instances"
        subprocess.run([dynvox, "run", data, "--images", "grey", "--instances", f"files:{masks}", "--quiet", "--threads", "1", "--set", "volume.voxel_size_m=0.2", "--overwrite", "--out",
                        data / "run"], check=True)
        found[name] = tracks(data / "run", true, frames)
    plain = found["10 Hz"]
    for name, of in found.items():
        worst, same, shared = 0.0, 0, 0
        for truth_id, frames in sorted(plain.items()):
            common = [frame for frame in frames if frame in of.get(truth_id, {})]
            shared += len(common)
            same += sum(frames[frame][1] == of[truth_id][frame][1] for frame in common)
            speeds = [[of_run[frame][0] for frame in common if frames[frame][0] and of[truth_id][frame][0] and frames[frame][1] == "dynamic"
                       and of[truth_id][frame][1] == "dynamic"] for of_run in (frames, of.get(truth_id, {}))]
            if len(speeds[0]) >= MEASURED_MIN:
                ours, theirs = (statistics.median(values) for values in (speeds[1], speeds[0]))
                worst = max(worst, abs(ours / theirs - 1))
                true_m_s = statistics.median(frames[frame][3] for frame in common)
                print(f"{name}: object {truth_id}: {ours:.2f} m/s, {theirs:.2f} at 10 Hz, true {true_m_s:.2f}, in {len(speeds[0])} frames")
        print(f"{name}: speeds at most {100 * worst:.1f} % apart; {same} of {shared} states as at 10 Hz\n")


main()
