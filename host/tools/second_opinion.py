#!/usr/bin/env python3
"""What a second matcher says where this one doubts: `second_opinion.py PAIRS DISPARITIES`.

PAIRS is a folder of KITTI 2012's layout (image_0, image_1, disp_noc), DISPARITIES what `dynvox evaluate stereo PAIRS --out DISPARITIES` wrote. The second matcher is OpenCV's semi-global
one over the whole image, along eight paths, with its check from left to right and its speckle filter. Needs numpy and opencv-python-headless.
"""
import pathlib
import sys

import cv2
import numpy as np

pairs, disparities = map(pathlib.Path, sys.argv[1:])
rows = {}


def count(name, shown, disparity, truth):
    known = truth > 0
    row = rows.setdefault(name, np.zeros(3))
    row += [known.sum(), (shown & known).sum(), (shown & known & (np.abs(disparity - truth) > 3)).sum()]


for path in sorted((pairs / "disp_noc").glob("*_10.png")):
    truth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) / 256
    raw = cv2.imread(str(disparities / path.name), cv2.IMREAD_UNCHANGED)
    ours, filled = raw / 256, raw % 2 == 1
    measured = (raw > 0) & ~filled
    left, right = (cv2.imread(str(pairs / folder / path.name), cv2.IMREAD_GRAYSCALE) for folder in ("image_0", "image_1"))
    matcher = cv2.StereoSGBM_create(0, 128, 5, 200, 800, 1, 63, 10, 200, 2, cv2.STEREO_SGBM_MODE_HH)
    theirs = matcher.compute(left, right) / 16
    answers = theirs > 0
    agree = np.abs(ours - theirs) <= 1.5
    count("ours, all", raw > 0, ours, truth)
    count("ours, measured", measured, ours, truth)
    count("ours, filled", filled, ours, truth)
    count("theirs where ours is filled", answers & filled, theirs, truth)
    count("theirs where ours has none", answers & (raw == 0), theirs, truth)
    both = np.where(measured, ours, np.where(answers, theirs, 0))
    count("ours measured, else theirs", both > 0, both, truth)
    count("ours measured, theirs agrees", measured & answers & agree, ours, truth)
    count("ours measured, theirs has none", measured & ~answers, ours, truth)
    count("ours measured, theirs disagrees: ours", measured & answers & ~agree, ours, truth)
    count("ours measured, theirs disagrees: theirs", measured & answers & ~agree, theirs, truth)

print(f"{'':42}{'covered':>10}{'> 3 px':>10}")
for name, (known, shown, wrong) in rows.items():
    print(f"{name:42}{100 * shown / known:8.2f} %{100 * wrong / max(shown, 1):8.2f} %")
