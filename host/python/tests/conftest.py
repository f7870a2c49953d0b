"""Where the command line and the real clips are."""

import csv
import json
import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def data():
    """The folder of real clips; tests that need it are skipped by name where it is missing."""
    folder = Path(os.environ.get("DYNVOX_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real clips at {folder}: set DYNVOX_DATA")
    return folder


@pytest.fixture(scope="session")
def binary():
    """The command line."""
    target = os.environ.get("CARGO_TARGET_DIR", str(ROOT / "target"))
    binary = Path(os.environ.get("DYNVOX", Path(target) / "release" / "dynvox"))
    if not binary.is_file():
        pytest.skip(f"no command line at {binary}: cargo build --release, or set DYNVOX")
    return binary


@pytest.fixture(scope="session")
def command_line(binary, tmp_path_factory):
    """Runs `dynvox run` and returns the digests of its frames and the summary; of a run that fails what it printed."""

    def run(*arguments):
        out = tmp_path_factory.mktemp("run") / "run"
        done = subprocess.run([binary, "run", *map(str, arguments), "--out", out, "--json"], capture_output=True, text=True)
        if done.returncode != 0:
            return done.stderr.removeprefix("error: ").strip()
        with open(out / "frames.csv", newline="") as file:
            digests = [int(row["digest"], 16) for row in csv.DictReader(file)]
        return digests, json.loads(done.stdout)

    return run
