#!/usr/bin/env python3
"""Plants a disparity offset: copies a KITTI odometry sequence with its right images moved by cubic interpolation.

shift_right.py KITTI-ODOMETRY SEQUENCE SHIFT_PX OUT      (needs opencv-python)

OUT becomes an odometry folder that `dynvox run OUT --sequence SEQUENCE` maps; all but the right images are links.
A positive shift moves right images to the right: so much must be added to disparities then.
"""
import os
import sys

import cv2
import numpy as np

root, sequence, shift_px, out = sys.argv[1], sys.argv[2], float(sys.argv[3]), sys.argv[4]
source, target = os.path.join(root, "sequences", sequence), os.path.join(out, "sequences", sequence)
os.makedirs(os.path.join(target, "image_1"))
os.symlink(os.path.abspath(os.path.join(root, "poses")), os.path.join(out, "poses"))
for name in os.listdir(source):
    if name != "image_1":
        os.symlink(os.path.abspath(os.path.join(source, name)), os.path.join(target, name))
for name in sorted(os.listdir(os.path.join(source, "image_1"))):
    image = cv2.imread(os.path.join(source, "image_1", name), cv2.IMREAD_GRAYSCALE)
    rows, columns = np.indices(image.shape, dtype=np.float32)
    moved = cv2.remap(image, columns - np.float32(shift_px), rows, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    cv2.imwrite(os.path.join(target, "image_1", name), moved)
