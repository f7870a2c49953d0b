#!/usr/bin/env python3
"""Budgets asked of `dynvox budget`: the share of each that is used, or the least that works. docs/budgets.py DYNVOX"""
import json, re, subprocess, sys

IMAGES = ["320x96", "640x480", "752x480", "1280x384", "1280x720", "1920x1080"]
BUDGETS = ["8MiB", "16MiB", "32MiB", "48MiB", "64MiB", "100MiB", "256MiB", "1GiB"]
SIZES = {"MiB": 1 << 20, "GiB": 1 << 30}


def cell(budget, image, voxel):
    run = subprocess.run([sys.argv[1], "budget", "--memory", budget, "--image", image, "--voxel", voxel, "--json"], capture_output=True, text=True)
    if run.returncode:
        least = int(re.search(r"the least that works is (\d+) bytes", run.stderr)[1])
        return f"least {least / (1 << 20):.1f} MiB"
    asked = float(budget[:-3]) * SIZES[budget[-3:]]
    of = json.loads(run.stdout)
    assert of["bytes"] <= asked
    return f"{100 * of['bytes'] / asked:.1f} %, {of['capacity']['blocks']:,}"


for voxel in ["0.05", "0.1"]:
    print(f"| voxel {voxel} m | " + " | ".join(IMAGES) + " |\n|---|" + "---|" * len(IMAGES))
    for budget in BUDGETS:
        print(f"| {budget} | " + " | ".join(cell(budget, image, voxel) for image in IMAGES) + " |")
    print()
