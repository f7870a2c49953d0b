#!/usr/bin/env python3
"""The core's distance transform against SciPy's, on maps of runs and on random ones: squared distances must be equal, and how long each takes.

host/tools/distance_transform.py EXAMPLE MAP.pgm [...] takes the built example `distance_transform` of dynvox-core and binary PGM files, as `dynvox run --planning`
writes to planning/map.pgm. Needs numpy and scipy. Both sides of the obstacles are compared: SciPy transforms the map and its inverse. Ends with 1 where a
distance differs.
"""
import pathlib, subprocess, sys, tempfile, time
import numpy as np
from scipy.ndimage import distance_transform_edt

example, maps = sys.argv[1], sys.argv[2:]


def scipy_squared(obstacle):
    """Squared distance of each pixel to the nearest of the other kind; and the CPU seconds of both transforms."""
    begin = time.process_time()
    free = distance_transform_edt(~obstacle)
    inside = distance_transform_edt(obstacle)
    seconds = time.process_time() - begin
    return np.rint((free + inside) ** 2).astype(np.uint32), seconds


def read(path):
    magic, size, greatest, pixels = pathlib.Path(path).read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    return np.frombuffer(pixels, np.uint8).reshape(height, width)


worst, folder = 0, tempfile.TemporaryDirectory()
random = np.random.default_rng(19)
for name, side, share in [("random 1 %", 400, 0.01), ("random 30 %", 400, 0.3), ("random 0.01 %", 1000, 1e-4)]:
    path = pathlib.Path(folder.name) / f"{name.replace(' ', '_')}.pgm"
    grey = np.where(random.random((side, side)) < share, 0, 254).astype(np.uint8)
    path.write_bytes(f"P5\n{side} {side}\n255\n".encode() + grey.tobytes())
    maps.append(str(path))
for path in maps:
    grey = read(path)
    run = subprocess.run([example, path], capture_output=True, check=True)
    own = np.frombuffer(run.stdout, "<u4").reshape(grey.shape)
    squared, seconds = scipy_squared(grey < 100)
    differ = int((own != squared).sum())
    worst = max(worst, differ)
    print(f"{path}: {run.stderr.decode().strip()}, SciPy {1e3 * seconds:.3f} ms; {differ} of {grey.size} cells differ")
sys.exit(worst > 0)
