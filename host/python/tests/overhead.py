"""What a step costs beside the core: python tests/overhead.py [DATASET] [SEQUENCE]

The wall time of `Mapper.step` less that of the core's step within it: arrays are checked, the interpreter is released and taken, and the report becomes
dictionaries.
"""

import sys
import time

import numpy as np

import dynvox

path, sequence = (sys.argv[1:] + [None, None])[:2]
dataset = dynvox.Dataset(path, sequence=sequence, frames=40, threads=1)
mapper = dataset.mapper()
beside_s, core_s = [], []
for at in range(len(dataset)):
    frame = dataset[at]
    began = time.perf_counter()
    mapper.step(**frame)
    whole = time.perf_counter() - began
    core_s.append(mapper.step_seconds)
    beside_s.append(whole - mapper.step_seconds)
# The first step makes the mapper's threads and touches its memory.
beside, core = np.median(beside_s[1:]), np.median(core_s[1:])
width, height = dataset.size
print(f"{dataset.name}, {len(dataset)} frames of {width} x {height} px: core {core * 1e3:.2f} ms, beside it {beside * 1e6:.0f} us, {beside / core:.3%}")
print(f"longest beside it {max(beside_s[1:]) * 1e6:.0f} us")
