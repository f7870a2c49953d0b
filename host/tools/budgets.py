#!/usr/bin/env python3
"""Budgets asked of `dynvox budget`: the share of each that is used, or the least that works. host/tools/budgets.py DYNVOX

host/tools/budgets.py DYNVOX FOLDER maps 200 frames of the street in six of them and prints what each bound refused.
"""
import json, pathlib, re, subprocess, sys

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


# Budget, image and voxel size of runs.
RUNS = [("8MiB", "320x96", "0.1"), ("32MiB", "640x480", "0.1"), ("48MiB", "752x480", "0.1"), ("100MiB", "1280x384", "0.05"),
        ("256MiB", "1280x720", "0.05"), ("1GiB", "1920x1080", "0.05")]


def mapped(folder, budget, image, voxel):
    """What each bound refused in 200 frames."""
    width, height = image.split("x")
    out = folder / f"{budget}-{image}"
    subprocess.run([sys.argv[1], "run", "--set", "street.frames=200", "--memory", budget, "--quiet", "--overwrite", "--out", out, "--set", f"street.width={width}",
                    "--set", f"street.height={height}", "--set", f"volume.voxel_size_m={voxel}"], check=True)
    summary = json.load(open(out / "summary.json"))
    uses = summary["capacity"]["bounds"]
    refused = [f"{name} {use['refused']:,} (needed {use['needed']:,})" for name, use in uses.items() if use["refused"]]
    return f"{summary['frames']} frames; refused: {', '.join(refused) or 'nothing'}"


if len(sys.argv) > 2:
    for run in RUNS:
        print(" ".join(run) + ": " + mapped(pathlib.Path(sys.argv[2]), *run), flush=True)
    sys.exit()

for voxel in ["0.05", "0.1"]:
    print(f"| voxel {voxel} m | " + " | ".join(IMAGES) + " |\n|---|" + "---|" * len(IMAGES))
    for budget in BUDGETS:
        print(f"| {budget} | " + " | ".join(cell(budget, image, voxel) for image in IMAGES) + " |")
    print()
