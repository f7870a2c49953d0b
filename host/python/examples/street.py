"""Maps the synthetic street, looks at it from behind the camera, and writes what it found: python street.py [DATASET] [OUT.npz]"""

import sys

import numpy as np

import dynvox

# %% The frames: any path that `dynvox run` takes, or the synthetic street.
path, out = (sys.argv[1:] + [None, None])[:2]
dataset = dynvox.Dataset(path, frames=40)
print(dataset, dataset.rig)

# %% Map them. A frame is a dictionary with the keywords of `step`.
mapper = dataset.mapper()
poses = []
for frame in dataset:
    report = mapper.step(**frame)
    poses.append(dynvox.matrix(report["t_world_camera"]))
    if report["severity"] == "map affected":
        print(f"frame {report['frame']}: the map is affected")
print(f"{mapper.slab_bytes / 2**20:.0f} MiB, digest {mapper.digest:016x}")

# %% What moves.
for track in mapper.tracks:
    if track["state"] == "dynamic" and track["speed_m_s"] is not None:
        print(f"track {track['id']}: {track['class_name']}, {track['speed_m_s']:.1f} m/s, {track['blocks']} blocks")

# %% The map from 5 m behind the camera, and as triangles.
behind = np.array(poses[-1])
behind[:3, 3] -= 5.0 * behind[:3, 2]
view = mapper.raycast(behind)
print(f"{np.mean(view['depth_m'] > 0):.0%} of the pixels show the map, {np.mean(view['object'] > 0):.1%} an object")
positions_m, colours = mapper.triangles()
print(f"{len(positions_m):,} triangles, {np.ptp(positions_m.reshape(-1, 3), axis=0).round(1)} m wide, high and deep")

# %% How far the camera is off, where the data set knows.
if dataset.truth is not None:
    errors_m = np.linalg.norm(np.array(poses)[:, :3, 3] - dataset.truth[:, :3, 3], axis=1)
    print(f"the camera is off by {errors_m.max():.2f} m at most after {np.linalg.norm(poses[-1][:3, 3]):.1f} m")
if out:
    np.savez_compressed(out, positions_m=positions_m, colours=colours, poses=np.array(poses))
