#!/usr/bin/env python3
"""Seeded accidents against the program: is a file of the user's lost, does an exit code lie?

    host/tools/accidents.py target/release/dynvox --trials 2000 [--seed 1] [--jobs 2] [--keep DIR]

Each trial makes a folder with files of a user, puts something in the way of the output (a link, a
foreign file, a recording inside the output), or lets something happen during the run (a signal, a
full disk, a closed descriptor, a second run), and then checks:

- no file, link or folder of the user's has changed, and nothing was written among them;
- exit code 0 means complete results, 4 means results with a reason, any other no new results;
- what was mapped is there, unless the process was killed without a snapshot; a run that was killed
  with one resumes to the same digest;
- nothing panicked, and every failure has a sentence.

One line is printed for each finding, and at the end the number of trials of each kind. The exit code
is 1 if there was a finding. `--names 500` checks names instead: that none commands the terminal, and
that each is quoted in printed commands. Kinds that need rights this user does not have (a tmpfs) are counted as
left out.
"""

import argparse
import collections
import concurrent.futures
import hashlib
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

STREET = ["--set", "street.width=160", "--set", "street.height=64"]
RUN = ["--profile", "tiny", "--images", "grey", "--threads", "1"]
PATIENCE_S = 600


def digest_of(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def state_of(root):
    """Every entry below a folder: links by their target, files by content."""
    state = {}
    for folder, folders, files in os.walk(root):
        for name in folders + files:
            path = pathlib.Path(folder, name)
            key = str(path.relative_to(root))
            if path.is_symlink():
                state[key] = "link to " + os.readlink(path)
            else:
                state[key] = "folder" if path.is_dir() else digest_of(path)
    return state


class Trial:
    """A folder with a user's files, and what is done in it."""

    def __init__(self, program, recording, seed, root):
        self.program, self.recording, self.seed = program, recording, seed
        self.random = random.Random(seed)
        self.root = pathlib.Path(root)
        self.findings = []
        self.user = self.root / "user"
        (self.user / "papers").mkdir(parents=True)
        for name in ["papers/thesis.tex", "notes.txt", "summary.json", "map.ply"]:
            (self.user / name).write_text(f"{name} {self.random.random()}\n")
        (self.user / "latest").symlink_to("papers/thesis.tex")
        self.watched = {}
        self.out = self.root / "res"

    def watch(self, path):
        """Notes a file or folder of the user's, to be found unchanged."""
        path = pathlib.Path(path)
        if path.is_symlink():
            self.watched[path] = "link to " + os.readlink(path)
        else:
            self.watched[path] = state_of(path) if path.is_dir() else digest_of(path)

    def check_user(self):
        for path, before in self.watched.items():
            if path.is_symlink():
                now = "link to " + os.readlink(path)
            elif path.is_dir():
                now = state_of(path)
            else:
                now = digest_of(path) if path.exists() else "missing"
            if now != before:
                self.find(f"{path.name} of the user's has changed")

    def find(self, what):
        self.findings.append(what)

    def args(self, *more, out=None):
        return ["run", str(self.recording), *RUN, "--out", str(out or self.out), *more]

    def start(self, args, limits="", **given):
        given = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **given}
        command = ["bash", "-c", f'{limits} exec "$0" "$@"', str(self.program), *args]
        return subprocess.Popen(command, cwd=self.root, **given)

    def run(self, args, limits="", **given):
        process = self.start(args, limits, **given)
        out, err = process.communicate(timeout=PATIENCE_S)
        err = (err or b"").decode(errors="replace")
        if "panicked" in err or "memory allocation" in err:
            self.find(f"panic: {err.strip().splitlines()[0]}")
        return process.returncode, err

    def summary(self, out=None):
        try:
            return json.loads(((out or self.out) / "summary.json").read_text())
        except (OSError, ValueError):
            return None

    def check_run(self, code, err, before=None, told=True):
        """Compares an exit code with the results at the target."""
        summary = self.summary()
        is_new = summary is not None and summary != before
        if code == 0:
            if not is_new or summary.get("incomplete"):
                self.find("exit code 0 without complete results")
            elif not (self.out / "map.ply").is_file():
                self.find("exit code 0 without a map")
        elif code == 4:
            kept = [p for p in self.root.glob(".res.partial/frames.csv")]
            if is_new and not summary.get("incomplete"):
                self.find("exit code 4 without a reason")
            if not is_new and not kept:
                self.find("exit code 4 without results")
        elif is_new and told:
            self.find(f"exit code {code} with new results: {err.strip()[-200:]}")
        if code > 0 and told and "error: " not in err:
            self.find(f"exit code {code} without a sentence: {err.strip()[-200:]}")

    def earlier(self):
        """Results of an earlier run at the target."""
        code, err = self.run(self.args("--quiet"))
        if code:
            self.find(f"an ordinary run failed: {err.strip()[-200:]}")
        return self.summary()

    def foreign_names(self):
        return self.random.choice(["thesis.tex", "map.ply.bak", "pictures/mine.jpg", ".hidden", "x y"])


def link_as_partial(trial):
    link = trial.root / ".res.partial"
    link.symlink_to(trial.random.choice([trial.user, trial.user / "notes.txt", "nowhere"]))
    trial.watch(link)
    code, err = trial.run(trial.args(*trial.random.choice([[], ["--overwrite"]])))
    trial.check_run(code, err)


def folder_as_partial(trial):
    shutil.copytree(trial.user, trial.root / ".res.partial", symlinks=True)
    trial.watch(trial.root / ".res.partial")
    code, err = trial.run(trial.args(*trial.random.choice([[], ["--overwrite"]])))
    trial.check_run(code, err)


def link_as_target(trial):
    trial.out.symlink_to(trial.random.choice([trial.user, trial.user / "notes.txt", "nowhere"]))
    trial.watch(trial.out)
    code, err = trial.run(trial.args(*trial.random.choice([[], ["--overwrite"]])))
    trial.check_run(code, err, before=trial.summary())


def foreign_target(trial):
    if trial.random.random() < 0.3:
        trial.out.write_text("a file\n")
    else:
        shutil.copytree(trial.user, trial.out, symlinks=True)
    if trial.random.random() < 0.3 and trial.out.is_dir():
        (trial.out / ".dynvox").write_text("dynvox made this folder? no\n")
    trial.watch(trial.out)
    code, err = trial.run(trial.args(*trial.random.choice([[], ["--overwrite"]])))
    trial.check_run(code, err, before=trial.summary())


def foreign_file_in_results(trial):
    before = trial.earlier()
    place = trial.out / trial.foreign_names()
    place.parent.mkdir(exist_ok=True)
    kind = trial.random.randrange(3)
    if kind == 0:
        place.write_text("mine\n")
    elif kind == 1:
        place.symlink_to(trial.user)
    else:
        victim = trial.random.choice(["map.ply", "frames.csv", "pictures/index.json"])
        place = trial.out / victim
        place.unlink()
        place.symlink_to(trial.user / "notes.txt")
    trial.watch(trial.out)
    code, err = trial.run(trial.args("--overwrite"))
    trial.check_run(code, err, before)
    if code == 0:
        trial.find("a folder with a foreign file was replaced")


def hard_linked_results(trial):
    trial.earlier()
    backup = trial.root / "backup"
    shutil.copytree(trial.out, backup, copy_function=os.link)
    trial.watch(backup)
    code, err = trial.run(trial.args("--overwrite"))
    if code:
        trial.find(f"earlier results were not replaced: {err.strip()[-200:]}")


def input_in_output(trial):
    own = trial.random.choice([trial.root / "own", trial.out])
    own.mkdir()
    shutil.copytree(trial.recording, own / "data")
    (own / "summary.json").write_text("{}")
    inside = trial.random.random() < 0.5
    out = own / "data/sequences/00/results" if inside else own
    if trial.random.random() < 0.3:
        (trial.root / "link").symlink_to(own)
        out = trial.root / "link" / out.relative_to(own)
    trial.watch(own)
    args = ["run", str(own / "data"), *RUN, "--out", str(out), "--overwrite"]
    code, err = trial.run(args)
    if code == 0:
        trial.find("an output around or inside its input was not refused")


def signalled(trial):
    before = trial.earlier() if trial.random.random() < 0.3 else None
    more = ["--overwrite"] if before else []
    which = trial.random.choice([signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
    process = trial.start(trial.args(*more, "--fuse-every", "1"))
    mapped = False
    after = trial.random.randrange(0, 5)
    lines = []
    for line in process.stderr:
        lines.append(line.decode(errors="replace"))
        mapped = mapped or lines[-1].startswith("frame ")
        if len(lines) > after:
            break
    time.sleep(trial.random.random() * 0.3)
    process.send_signal(which)
    err = "".join(lines) + process.stderr.read().decode(errors="replace")
    code = process.wait(PATIENCE_S)
    trial.check_run(code, err, before, told=code > 0)
    if mapped and code not in (0, 4):
        trial.find(f"{which.name} lost what was mapped: exit code {code}")


def killed(trial):
    """Killed with snapshots, and resumed; or without, and started again."""
    snapshots = trial.random.random() < 0.6
    more = ["--snapshot-every", "1"] if snapshots else []
    process = trial.start(trial.args(*more, "--quiet"))
    time.sleep(trial.random.random() * trial.seconds)
    process.kill()
    process.communicate()
    if trial.summary() is not None:
        return
    code, err = trial.run(["run", "--resume", str(trial.out), "--quiet"])
    if code:
        code, err = trial.run(trial.args("--quiet", *trial.random.choice([[], ["--overwrite"]])))
    if code:
        is_kept = any(text in err for text in ["resume", "of an earlier run are in"])
        if not is_kept:
            trial.find(f"a killed run was not started again: {err.strip()[-200:]}")
    elif trial.summary()["digest"] != trial.expected["digest"]:
        trial.find("a killed run has another digest")


def file_size_limit(trial):
    limit = trial.random.choice([1, 64, 1000, 2049, 2100, 2600, 4000, 9000])
    code, err = trial.run(trial.args("--quiet"), limits=f"ulimit -f {limit};")
    trial.check_run(code, err)
    if code < 0:
        trial.find(f"ended by signal {-code}")


def few_descriptors(trial):
    limit = trial.random.randrange(8, 48)
    code, err = trial.run(trial.args("--quiet"), limits=f"ulimit -n {limit};")
    trial.check_run(code, err)


def little_memory(trial):
    limit = trial.random.randrange(150, 700) << 10
    code, err = trial.run(trial.args("--quiet"), limits=f"ulimit -v {limit};")
    trial.check_run(code, err, told=code > 0)


def full_disk(trial):
    disk = trial.root / "disk"
    disk.mkdir()
    inodes = trial.random.choice([12, 30, 40, 60, 1000])
    size_kib = trial.random.choice([500, 2400, 2600, 3000, 4000, 6000])
    options = f"size={size_kib}k,nr_inodes={inodes}"
    if os.system(f"mount -t tmpfs -o {options} none '{disk}' 2>/dev/null"):
        return "left out"
    try:
        trial.out = disk / "res"
        code, err = trial.run(trial.args("--quiet"))
        summary = trial.summary()
        if code == 0 and (summary is None or summary.get("incomplete")):
            trial.find(f"exit code 0 on a full disk ({options})")
        if code == 4 and summary is None and not (disk / ".res.partial/frames.csv").is_file():
            trial.find(f"exit code 4 without results ({options})")
        if code not in (0, 4) and "keeps disk space" not in err and "error: " not in err:
            trial.find(f"exit code {code} ({options}): {err.strip()[-300:]}")
        if code not in (0, 4) and (disk / ".res.partial").exists():
            trial.find(f"a partial folder stays ({options})")
    finally:
        os.system(f"umount '{disk}'")


def closed_descriptors(trial):
    kind = trial.random.randrange(4)
    limits = ["exec 2>&-;", "exec >&-;", "exec <&- >&- 2>&-;", ""][kind]
    if kind < 3:
        code, err = trial.run(trial.args(), limits=limits)
        if code:
            trial.find(f"closed descriptors end a run with exit code {code}")
        return
    read, write = os.pipe()
    process = trial.start(trial.args(), stderr=write, stdout=write)
    os.close(write)
    os.read(read, trial.random.choice([1, 10, 200]))
    os.close(read)
    code = process.wait(PATIENCE_S)
    # The summary could not be printed: that alone may be told.
    if code not in (0, 1) or trial.summary() is None:
        trial.find(f"a reader that went away ends a run with exit code {code}")


def race(trial):
    """Something appears at the target, or in the partial folder, during the run."""
    kind = trial.random.randrange(4)
    process = trial.start(trial.args("--quiet", *trial.random.choice([[], ["--overwrite"]])))
    partial = trial.root / ".res.partial"
    deadline = time.time() + PATIENCE_S
    while not (partial / "pictures").is_dir() and process.poll() is None:
        if time.time() > deadline:
            break
        time.sleep(0.01)
    try:
        if kind == 0:
            trial.out.mkdir()
            (trial.out / "mine").write_text("mine\n")
            trial.watch(trial.out / "mine")
        elif kind == 1:
            (partial / "mine").write_text("mine\n")
            mine = digest_of(partial / "mine")
        elif kind == 2:
            trial.out.symlink_to(trial.user)
            trial.watch(trial.out)
        else:
            (partial / "pictures").rename(partial / "away")
            (partial / "pictures").symlink_to(trial.user)
    except OSError:
        kind = -1
    out, err = process.communicate(timeout=PATIENCE_S)
    err = err.decode(errors="replace")
    if "panicked" in err:
        trial.find(f"panic: {err.strip()[:200]}")
    if kind == 1:
        found = [p for p in trial.root.glob("*/mine")] + [p for p in trial.root.glob(".*/mine")]
        if not any(digest_of(path) == mine for path in found):
            trial.find("a file in the partial folder is gone")
    if kind in (0, 2) and process.returncode == 0:
        trial.find("exit code 0 although the target was taken")
    if kind in (0, 2) and not (partial / "summary.json").is_file():
        trial.find(f"results that could not be moved are gone: {err.strip()[-200:]}")


def two_at_once(trial):
    first = trial.start(trial.args("--quiet"))
    second = trial.start(trial.args("--quiet", *trial.random.choice([[], ["--overwrite"]])))
    codes = []
    for process in (first, second):
        out, err = process.communicate(timeout=PATIENCE_S)
        codes.append(process.returncode)
        if b"panicked" in err:
            trial.find("panic of two runs at once")
    if 0 not in codes or trial.summary() is None:
        trial.find(f"of two runs at once none has results: {codes}")


def other_outputs(trial):
    """Commands besides `run` that write."""
    foreign = trial.root / "taken"
    shutil.copytree(trial.user, foreign, symlinks=True)
    link = trial.root / "link"
    link.symlink_to(trial.random.choice([foreign, foreign / "notes.txt", "nowhere"]))
    trial.watch(foreign)
    trial.watch(link)
    target = str(trial.random.choice([foreign, link, foreign / "notes.txt"]))
    calibration = str(trial.recording / "sequences/00/calib.txt")
    commands = [
        ["synth", "--frames", "1", *STREET, "--out", target],
        ["sweep", "street", "--plan", "--quiet", "--out", target],
        ["fleet", "merge", str(foreign), "--out", target],
        ["fixtures", "new", target, "--from", str(trial.recording), "--frames", "1"],
        ["calibration", calibration, "--out", target],
        trial.args("--save-instances", target),
    ]
    code, err = trial.run(trial.random.choice(commands))
    if code == 0:
        trial.find("an output that was taken was written")
    if "error: " not in err:
        trial.find(f"no sentence: {err.strip()[-200:]}")


PIECES = [
    "\x1b]0;owned\x07", "\x1b[2J", "\x9b31m", "\u202e", "\u2066", "\u200f", "\u2028", "\r", "\n",
    "\t", "\x7f", "\x01", ";touch PWNED;", "$(touch PWNED)", "`touch PWNED`", "'", '"', "\\", " ",
    "*", "~", "-", "#", "&", "|", ">", "a", "street", "é", "北",
]


def is_raw(text):
    """True if a text has a character that commands a terminal or turns its letters about."""
    marks = [(0x200B, 0x200F), (0x2028, 0x202E), (0x2060, 0x206F)]
    return any(
        char != "\n" and (ord(char) < 32 or 127 <= ord(char) < 160)
        or any(first <= ord(char) <= last for first, last in marks)
        for char in text
    )


def check_name(program, seed):
    """Findings of a random name in the messages and printed commands of the program."""
    rng, findings = random.Random(seed), []
    name = "".join(rng.choice(PIECES) for _ in range(rng.randrange(1, 7))).replace("/", "")
    given = f"./{name}" if name.startswith("-") else name
    with tempfile.TemporaryDirectory() as root:
        commands = [
            ["inspect", given], ["run", given], ["run", "--resume", given], ["view", given],
            ["diff", given, given], ["budget", "--capacity", given], ["fleet", "run", given],
            ["sweep", "--merge", given, "--out", "swept"], ["calibration", given], [given],
        ]
        for command in [*commands, None]:
            if command is None:
                # A folder of that name with the results of a run: commands are printed for it.
                pathlib.Path(root, given).mkdir()
                pathlib.Path(root, given, "summary.json").write_text("{}")
                command = ["inspect", given]
            run = subprocess.run([program, *command], cwd=root, capture_output=True)
            text = (run.stdout + run.stderr).decode(errors="replace")
            if is_raw(text) or "\n" in name.strip() and name in text:
                findings.append(f"name {name!r}: raw in the output of {command[0]}")
        line = next((one for one in text.splitlines() if "trajectory: " in one), "")
        script = "dynvox() { printf '%s\\0' \"$@\"; }; " + line.partition("trajectory: ")[2]
        words = subprocess.run(["bash", "-c", script], cwd=root, capture_output=True).stdout
        if words.decode().split("\0")[2:3] != [given]:
            findings.append(f"name {name!r}: not quoted in {line!r}")
        if pathlib.Path(root, "PWNED").exists():
            findings.append(f"name {name!r}: a command within it was run")
    return findings


KINDS = [
    link_as_partial, folder_as_partial, link_as_target, foreign_target, foreign_file_in_results,
    hard_linked_results, input_in_output, signalled, signalled, killed, file_size_limit,
    few_descriptors, little_memory, full_disk, closed_descriptors, race, two_at_once, other_outputs,
]


def trial_of(program, recording, seed, expected, seconds, keep):
    root = tempfile.mkdtemp(prefix="accident-", dir=keep)
    trial = Trial(program, recording, seed, root)
    trial.expected, trial.seconds = expected, seconds
    trial.watch(trial.user)
    trial.watch(recording)
    kind = KINDS[seed % len(KINDS)]
    left_out = None
    try:
        left_out = kind(trial)
    except subprocess.TimeoutExpired:
        trial.find(f"no end within {PATIENCE_S} s")
    trial.check_user()
    if not trial.findings:
        shutil.rmtree(root, ignore_errors=True)
    return kind.__name__, left_out, seed, trial.findings, root


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--trials", type=int, default=len(KINDS))
    parser.add_argument("--seed", type=int, default=0, help="seed of the first trial")
    parser.add_argument("--jobs", type=int, default=2, help="trials at once")
    parser.add_argument("--keep", default=None, help="folder for the trials; those with findings stay")
    parser.add_argument("--names", type=int, default=0, help="check so many random names instead")
    given = parser.parse_args()
    if given.names:
        with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
            seeds = range(given.seed, given.seed + given.names)
            found = sum(pool.map(lambda seed: check_name(given.program, seed), seeds), [])
        print(*found, f"{given.names} names, {len(found)} findings", sep="\n")
        sys.exit(bool(found))
    with tempfile.TemporaryDirectory(prefix="accidents-") as shared:
        recording = pathlib.Path(shared, "recording")
        made = [given.program, "synth", "--out", recording, "--frames", "4", *STREET]
        subprocess.run(made, check=True, capture_output=True)
        begin = time.time()
        whole = pathlib.Path(shared, "whole")
        mapped = [given.program, "run", recording, *RUN, "--quiet", "--out", whole]
        subprocess.run(mapped, check=True, capture_output=True)
        seconds = time.time() - begin
        expected = json.loads((whole / "summary.json").read_text())
        counts, found = collections.Counter(), 0
        with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
            seeds = range(given.seed, given.seed + given.trials)
            done = [
                pool.submit(trial_of, given.program, recording, seed, expected, seconds, given.keep)
                for seed in seeds
            ]
            for one in concurrent.futures.as_completed(done):
                kind, left_out, seed, findings, root = one.result()
                counts[f"{kind} (left out)" if left_out else kind] += 1
                found += bool(findings)
                for finding in findings:
                    print(f"seed {seed}, {kind}: {finding} [{root}]", flush=True)
    for kind, count in sorted(counts.items()):
        print(f"{count:6} {kind}")
    print(f"{given.trials} accidents, {found} with findings")
    sys.exit(found > 0)


if __name__ == "__main__":
    main()
