#!/usr/bin/env python3
"""Memory, snapshots and lost blocks of a run of many frames.

host/tools/long_run.py DYNVOX FOLDER [FRAMES [RUN OPTION ...]] renders 200 frames of the street with cars at 96 x 64 px into FOLDER once, links them to and fro as
a recording of FRAMES frames (100,000), maps it with the profile `tiny` (2,500 blocks, the others on disk) and a snapshot every 1,000 frames, and prints
resident memory along the run, the time that snapshots take, and blocks lost. FOLDER may be deleted afterwards.
"""
import csv, json, os, pathlib, shutil, subprocess, sys, time

dynvox, folder = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2])
frames, options = int(sys.argv[3]) if len(sys.argv) > 3 else 100_000, sys.argv[4:]
BASE, EVERY = 200, 1_000
STREET = ["street.width=96", "street.height=64", "street.speed_m_s=4.5"]
SETTINGS = ["volume.voxel_size_m=0.2", "volume.prune_lag=5"]


def settings(lines):
    return [part for line in lines for part in ("--set", line)]


def record():
    """The street to and fro, as links."""
    street, out = folder / "street", folder / "recording"
    if not street.exists():
        subprocess.run([dynvox, "synth", "--out", street, "--frames", str(BASE), *settings(STREET)], check=True, stdout=subprocess.DEVNULL)
    shutil.rmtree(out, ignore_errors=True)
    source, sequence = street / "sequences/00", out / "sequences/00"
    for name, ends in {"image_0": ["png"], "image_1": ["png"], "instances": ["png", "txt"]}.items():
        (sequence / name).mkdir(parents=True)
        for frame in range(frames):
            at = frame % (2 * BASE - 2)
            at = at if at < BASE else 2 * BASE - 2 - at
            for end in ends:
                os.link(source / name / f"{at:06}.{end}", sequence / name / f"{frame:06}.{end}")
    shutil.copy(source / "calib.txt", sequence / "calib.txt")
    (sequence / "times.txt").write_text("".join(f"{frame / 10:.1f}\n" for frame in range(frames)))
    return out


def run(recording):
    """Maps it; the seconds from the creation of each snapshot to its last name, and its bytes."""
    out = folder / "run"
    shutil.rmtree(out, ignore_errors=True)
    command = [dynvox, "run", recording, "--images", "grey", "--profile", "tiny", "--threads", "1", "--snapshot-every", str(EVERY), "--quiet",
               "--out", out, *settings(SETTINGS), *options]
    process, snapshots = subprocess.Popen(command), {}
    while process.poll() is None:
        time.sleep(0.2)
        try:
            inode, born, renamed, size = subprocess.run(["stat", "-c", "%i %.9W %.9Z %s", folder / ".run.partial/run.snapshot"],
                                                        capture_output=True, text=True, check=True).stdout.split()
        except subprocess.CalledProcessError:
            continue
        snapshots[inode, born] = (float(renamed) - float(born), int(size))
    assert process.returncode == 0, process.returncode
    return out, list(snapshots.values())


def median(values):
    return sorted(values)[len(values) // 2]


out, snapshots = run(record())
rows = list(csv.DictReader(open(out / "frames.csv")))
assert len(rows) == frames, len(rows)
resident = [int(row["rss_bytes"]) / 2**20 for row in rows]
for tenth in range(11):
    at = min(tenth * frames // 10, frames - 1)
    print(f"frame {at}: {resident[at]:.2f} MiB")
after = resident[frames // 5:]
print(f"from frame {frames // 5} on: {min(after):.2f} to {max(after):.2f} MiB")
for name, part in {"first": snapshots[: len(snapshots) // 5], "last": snapshots[-(len(snapshots) // 5):]}.items():
    if part:
        print(f"{name} fifth of {len(snapshots)} snapshots seen: median {1e3 * median([time for time, _ in part]):.1f} ms, "
              f"{median([size for _, size in part])} bytes")
summary = json.load(open(out / "summary.json"))
for key in ["evict", "health"]:
    print(key, json.dumps(summary[key]))
