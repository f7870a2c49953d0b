#!/usr/bin/env python3
"""Where the bytes of a run's `map.ply` go, and what would make it smaller.

host/tools/map_bytes.py RUN_FOLDER      (needs numpy, scipy)

Prints the bytes of vertices and faces; the share of vertices that are there twice; the share of triangles in components of fewer than so many; and
the size left if vertices close to a lattice point moved there and the triangles that collapse were dropped.
"""
import pathlib, sys, tomllib

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

folder = pathlib.Path(sys.argv[1])
voxel_m = tomllib.load(open(folder / "config.toml", "rb"))["volume"]["voxel_size_m"]
TYPES = {"float": "<f4", "uchar": "u1", "int": "<i4"}
with open(folder / "map.ply", "rb") as file:
    header = []
    while not header or header[-1] != "end_header":
        header.append(file.readline().decode().strip())
    count = {line.split()[1]: int(line.split()[2]) for line in header if line.startswith("element")}
    vertex = np.dtype([(line.split()[2], TYPES[line.split()[1]]) for line in header if line.startswith("property") and "list" not in line])
    vertices = np.fromfile(file, vertex, count["vertex"])
    faces = np.fromfile(file, np.dtype([("corners", "u1"), ("at", "<u4", 3)]), count["face"])["at"]
positions = np.stack([vertices[axis] for axis in "xyz"], 1)


def megabytes(vertices, faces):
    return (vertices * vertex.itemsize + faces * 13) / 1e6


def welded(positions):
    """Number of the place of each vertex, and how many places there are."""
    _, numbers = np.unique(positions, axis=0, return_inverse=True)
    return numbers.reshape(-1), numbers.max() + 1


print(f"{len(vertices)} vertices of {vertex.itemsize} bytes, {len(faces)} faces of 13: {megabytes(len(vertices), len(faces)):.1f} MB")
numbers, places = welded(positions)
print(f"there twice: {100 * (1 - places / len(vertices)):.1f} % of the vertices")
a, b, c = numbers[faces].T
edges = coo_array((np.ones(2 * len(a), bool), (np.concatenate([a, a]), np.concatenate([b, c]))), (places, places))
sizes = np.bincount(connected_components(edges, directed=False)[1][a])
sizes = sizes[sizes > 0]
for most in (10, 50, 200):
    few = sizes < most
    print(f"components of fewer than {most} triangles: {few.sum()} of {len(sizes)}, {100 * sizes[few].sum() / len(faces):.1f} % of the triangles")
lattice = positions / voxel_m
for reach in (0.1, 0.25):
    nearest = np.round(lattice)
    near = np.abs(lattice - nearest).max(1, keepdims=True) < reach
    numbers, places = welded(np.round(np.where(near, nearest, lattice), 3))
    a, b, c = numbers[faces].T
    left = ((a != b) & (b != c) & (c != a)).sum()
    print(f"vertices within {reach} voxels of a lattice point moved there: {megabytes(places, left):.1f} MB")
