"""Errors are exceptions with the sentences of the command line; the stubs describe what is there."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import dynvox


@pytest.mark.parametrize(
    ("path", "options"),
    [
        ("/nowhere", {}),
        (None, {"memory": "1MiB"}),
        (None, {"profile": "gigantic"}),
        (None, {"start": 5000}),
        (None, {"threads": 0}),
        (None, {"set": {"volume.voxel_sise_m": 0.1}}),
        (None, {"set": {"volume.voxel_size_m": "wide"}}),
        (None, {"sequence": "06"}),
        (None, {"instances": "files:/nowhere"}),
        (None, {"egomotion": "file:/nowhere.txt"}),
    ],
)
def test_the_sentence_is_that_of_the_command_line(command_line, path, options):
    settings = options.get("set", {})
    words = [f"--{key}={value}" for key, value in options.items() if key != "set"]
    words += [f"--set={key}={value}" for key, value in settings.items()]
    printed = command_line(*([path] if path else []), *words)
    with pytest.raises(dynvox.Error) as error:
        dynvox.Dataset(path, **options).mapper()
    assert str(error.value) == printed.splitlines()[0]


def test_options_that_are_none_are_named():
    with pytest.raises(dynvox.Error, match="there is no option frame. Did you mean frames\\? Give one of path, world, sequence"):
        dynvox.Dataset(frame=3)
    with pytest.raises(dynvox.Error, match="read frame by frame has no exports.record"):
        dynvox.Dataset(mcap=True)
    with pytest.raises(dynvox.Error, match="exclude each other"):
        dynvox.Dataset(memory="64MiB", profile="tiny")
    with pytest.raises(dynvox.Error, match="is not a number of bytes"):
        dynvox.Dataset(memory="lots")
    rig = dynvox.Rig(200, 160, 48, 0.5)
    with pytest.raises(dynvox.Error, match="a mapper alone has no input.sequence"):
        dynvox.Mapper(rig, sequence="06")
    with pytest.raises(dynvox.Error, match="is not a number of bytes"):
        dynvox.Mapper(rig, memory="lots")
    with pytest.raises(dynvox.Error, match="Give each frame its detections"):
        dynvox.Mapper(rig, instances="files:masks")
    with pytest.raises(dynvox.Error, match="Give each frame its pose"):
        dynvox.Mapper(rig, image=(320, 96), egomotion="file:poses.txt")
    with pytest.raises(dynvox.Error, match="has no picture yet"):
        dynvox.Mapper(rig).tracks
    with pytest.raises(dynvox.Error, match="focal_px must be"):
        dynvox.Rig(0, 160, 48, 0.5)
    with pytest.raises(IndexError):
        dynvox.Dataset(frames=3)[3]
    assert dynvox.Dataset(frames=3)[-1]["left"].shape == (192, 640)


def test_every_option_of_a_run_has_a_name_in_python(binary):
    """What both lack are files and words of the command line."""
    of_the_command_line = set("out overwrite json quiet resume snapshot-every rss-limit-mib threads live continue help help-all version".split())
    with pytest.raises(dynvox.Error) as error:
        dynvox.Dataset(nonsense=1)
    named = set(str(error.value).split("Give one of ")[1].replace("_", "-").split(", ")) - {"path"}
    text = subprocess.run([binary, "run", "--help-all"], capture_output=True, text=True, check=True).stdout
    options = set(re.findall(r"^ {2,8}(?:-\w, )?--([a-z0-9-]+)", text, re.MULTILINE))
    assert options and options - of_the_command_line == named


def test_the_calibration_of_raw_cameras(data):
    folder = data / "kitti-raw"
    file = next(folder.rglob("calib_cam_to_cam.txt"))
    rig = dynvox.read_calibration(file)
    assert rig.raw_size == (1392, 512) and rig.size is not None and 0.5 < rig.baseline_m < 0.6
    assert dynvox.Mapper(rig, memory="256MiB").slab_bytes <= 256 << 20
    rectified = dynvox.read_calibration(data / "kitti-odometry/sequences/06/calib.txt")
    assert rectified.raw_size is None and rectified.size is None
    with pytest.raises(dynvox.Error, match="cannot be read"):
        dynvox.read_calibration("/nowhere.yaml")


def test_the_stubs_name_what_is_there_and_nothing_else():
    stub = ast.parse((Path(dynvox.__file__).parent / "__init__.pyi").read_text())
    typed_only = {"Pose", "Track", "Region", "Raycast", "Plan", "Finding", "Frame"}
    described = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef | ast.FunctionDef)}
    assert set(described) - typed_only | {"__version__"} == set(dynvox.__all__)
    for name in ("Rig", "Detection", "Mapper", "Dataset"):
        stubbed = {node.name for node in described[name].body if isinstance(node, ast.FunctionDef)} - {"__new__", "__enter__", "__exit__"}
        there = {member for kind in getattr(dynvox, name).__mro__[:-1] for member in vars(kind)}
        there = {member for member in there if not member.startswith("_") or member in ("__len__", "__getitem__", "__iter__")}
        assert stubbed == there, name
    assert (Path(dynvox.__file__).parent / "py.typed").is_file()


def test_the_example_runs():
    example = Path(__file__).parents[1] / "examples/street.py"
    done = subprocess.run([sys.executable, example], capture_output=True, text=True)
    assert done.returncode == 0 and "digest" in done.stdout, done.stderr
