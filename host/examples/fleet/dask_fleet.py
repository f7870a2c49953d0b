#!/usr/bin/env python3
"""Jobs of `dynvox fleet plan` on a Dask cluster, each with its bytes of memory, then the merge as a tree.

    pip install "dask[distributed]"
    dynvox fleet plan recordings.toml --out jobs
    host/examples/fleet/dask_fleet.py --dynvox target/release/dynvox --jobs jobs --out map [--align] [--workers 2] [--memory 4GiB]

A local cluster by default; `--scheduler ADDRESS` takes a running one (dask-jobqueue for Slurm, dask-kubernetes), whose workers are started with
`--resources "MEMORY=BYTES"` and see the same folders.
"""
import argparse, json, pathlib, shutil, subprocess

from dask.distributed import Client, LocalCluster
from dask.utils import parse_bytes

# Maps that one task of the tree adds.
FAN_IN = 4
# Memory of resampling.
RESAMPLE_BYTES = 128 << 20


def do_job(dynvox, action, folder, index, count):
    """One job; a worker that dies is replaced and the job repeated."""
    subprocess.run([dynvox, "fleet", action, folder, "--shard", f"{index}/{count}"], check=True)
    return index


def align(dynvox, folder):
    subprocess.run([dynvox, "fleet", "align", folder], check=True)


def add(dynvox, maps, out):
    """The sum of some maps. A folder that is there is whole: it is renamed when it is."""
    if not pathlib.Path(out).exists():
        subprocess.run([dynvox, "fleet", "merge", *maps, "--out", out], check=True)
    return out


def tree(client, dynvox, maps, out):
    """Futures of a tree of sums, whose root is `out`."""
    scratch, level = pathlib.Path(str(out) + ".tree"), 0
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    while len(maps) > 1:
        groups = [maps[at : at + FAN_IN] for at in range(0, len(maps), FAN_IN)]
        names = [out if len(groups) == 1 else str(scratch / f"{level}-{nth}") for nth in range(len(groups))]
        maps = [client.submit(add, dynvox, group, name, pure=False) for group, name in zip(groups, names)]
        level += 1
    result = client.gather(maps)
    shutil.rmtree(scratch)
    return result[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ["dynvox", "jobs", "out"]:
        parser.add_argument(f"--{name}", required=True)
    parser.add_argument("--align", action="store_true", help="register overlapping maps before they are merged")
    parser.add_argument("--scheduler")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--memory", default="4GiB", help="of each local worker")
    args = parser.parse_args()
    jobs = json.load(open(pathlib.Path(args.jobs) / "jobs.json"))["jobs"]
    cluster = args.scheduler or LocalCluster(n_workers=args.workers, threads_per_worker=4, memory_limit=0, resources={"MEMORY": parse_bytes(args.memory)})
    with Client(cluster) as client:
        def all_of(action, bytes_of):
            # As many jobs on a worker as its memory holds.
            client.gather([client.submit(do_job, args.dynvox, action, args.jobs, nth, len(jobs), resources={"MEMORY": bytes_of(job)}, retries=2, pure=False)
                           for nth, job in enumerate(jobs)])

        all_of("run", lambda job: job["bytes"])
        if args.align:
            client.submit(align, args.dynvox, args.jobs, pure=False).result()
        all_of("resample", lambda _: RESAMPLE_BYTES)
        # The command names a map's folder by its place in the world.
        maps = json.loads(subprocess.run([args.dynvox, "fleet", "status", args.jobs, "--json"], check=True, capture_output=True).stdout)
        maps = [job["sums"] for job in maps]
        print(tree(client, args.dynvox, maps, args.out) if len(maps) > 1 else maps[0])


if __name__ == "__main__":
    main()
