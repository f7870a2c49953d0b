"""Stereo dense mapping of streets with moving cars, for numpy. `__init__.pyi` describes every name."""

from collections import deque as _deque
from concurrent.futures import ThreadPoolExecutor as _ThreadPoolExecutor
from itertools import islice as _islice

import numpy as _np

from ._dynvox import Dataset as _Dataset
from ._dynvox import Detection, Error, InertialUnit, Mapper, Rig, __version__, diagnose, read_calibration

__all__ = [
    "Dataset",
    "Detection",
    "Error",
    "InertialUnit",
    "Mapper",
    "Rig",
    "__version__",
    "detections_of",
    "diagnose",
    "matrix",
    "read_calibration",
]

# Frames decoded ahead of the one in use, as in `dynvox run`.
_AHEAD = 2


class Dataset(_Dataset):
    """The frames that `dynvox run PATH` would map; the synthetic street without a path.

    Options are those of `dynvox run`, with underscores. A sequence of frames: `dataset[3]`, `len(dataset)`, `for frame in dataset` (decoded ahead).
    """

    def __iter__(self):
        with _ThreadPoolExecutor(1, "dynvox-reader") as reader:
            positions = iter(range(len(self)))
            waiting = _deque(reader.submit(self.__getitem__, at) for at in _islice(positions, _AHEAD))
            while waiting:
                frame = waiting.popleft().result()
                waiting.extend(reader.submit(self.__getitem__, at) for at in _islice(positions, 1))
                yield frame


def matrix(pose):
    """A pose of a report, `{"rotation": [x, y, z, w], "translation_m": [x, y, z]}`, as a matrix of 4 x 4."""
    x, y, z, w = pose["rotation"]
    of = _np.eye(4)
    of[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    of[:3, 3] = pose["translation_m"]
    return of


def detections_of(instances, class_names, scores=None):
    """Detections of an image of instances: pixel k shows instance k, of class `class_names[k - 1]`; 0 shows none."""
    instances = _np.asarray(instances)
    if instances.ndim != 2 or instances.dtype.kind not in "ui":
        raise Error(f"instances is {instances.dtype} of {instances.ndim} dimensions. Pass height x width integers")
    most = int(instances.max(initial=0))
    if most > len(class_names) or instances.min(initial=0) < 0:
        raise Error(f"instances has number {most}, and there are {len(class_names)} class names. Give one name for each instance")
    found = []
    for number, class_name in enumerate(class_names, start=1):
        mask = instances == number
        rows, columns = mask.any(axis=1).nonzero()[0], mask.any(axis=0).nonzero()[0]
        if rows.size:
            top, left = int(rows[0]), int(columns[0])
            within = _np.ascontiguousarray(mask[top : rows[-1] + 1, left : columns[-1] + 1])
            found.append(Detection(within, left, top, class_name, 1.0 if scores is None else float(scores[number - 1])))
    return found


def __dir__():
    return sorted(__all__)
