#!/usr/bin/env python3
"""Makes fir.ply, a small fir tree, and forest.csv, the places of a wood: what mesh.toml shows.

    python3 samples/scenes/make_fir.py
"""
import math
import pathlib
import random
import struct

FOLDER = pathlib.Path(__file__).parent
TIERS, SPIKES = 7, 11  # whorls of branches; branches of each
TREES = 1500


def fir():
    """Vertices and triangles of a closed trunk and closed, jagged cones. 1 unit is the height of the tree."""
    rng = random.Random(4)
    vertices, triangles = [], []

    def ring_cone(bottom, top, radii, sag):
        """A cone over a star: an apex, a rim, and a middle below that the rim leans on."""
        apex = len(vertices)
        vertices.append((0.0, top, 0.0))
        vertices.append((0.0, bottom + 0.25 * (top - bottom), 0.0))
        count = len(radii)
        for i, radius in enumerate(radii):
            angle = 2 * math.pi * (i + 0.3 * rng.uniform(-1, 1)) / count
            drop = sag if i % 2 == 0 else 0.0
            vertices.append((radius * math.cos(angle), bottom - drop, radius * math.sin(angle)))
        for i in range(count):
            a, b = apex + 2 + i, apex + 2 + (i + 1) % count
            triangles.append((apex, b, a))
            triangles.append((apex + 1, a, b))

    ring_cone(0.0, 0.5, [0.03] * 7, 0.0)  # the trunk
    for tier in range(TIERS):
        share = tier / (TIERS - 1)
        bottom = 0.12 + 0.68 * share
        reach = 0.24 * (1 - share) ** 0.9 + 0.05
        radii = [reach * (rng.uniform(0.85, 1.1) if i % 2 == 0 else rng.uniform(0.45, 0.6)) for i in range(2 * SPIKES)]
        ring_cone(bottom, min(1.0, bottom + 0.30 - 0.1 * share), radii, 0.05 * (1 - 0.6 * share))
    return vertices, triangles


def write_ply(path, vertices, triangles):
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment made by make_fir.py\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    body = b"".join(struct.pack("<3f", *v) for v in vertices)
    body += b"".join(struct.pack("<B3i", 3, *t) for t in triangles)
    path.write_bytes(header.encode() + body)


def write_forest(path):
    """A wood around a glade, no tree nearer to another than 2.5 m."""
    rng = random.Random(7)
    taken, lines = {}, []
    while len(lines) < TREES:
        x, z = rng.uniform(-140, 140), rng.uniform(-190, 25)
        edge = math.hypot(x / 30, (z + 12) / 34) + 0.12 * math.sin(0.21 * x) + 0.1 * math.sin(0.17 * z + 1)
        if edge < 1 or (edge < 1.25 and rng.random() < 0.6):
            continue
        cell = (int(x // 2.5), int(z // 2.5))
        if any((cell[0] + i, cell[1] + j) in taken for i in (-1, 0, 1) for j in (-1, 0, 1)):
            continue
        taken[cell] = True
        lines.append(f"{x:.1f},0,{z:.1f},{rng.uniform(6, 15):.1f},{rng.uniform(0, 360):.0f}")
    path.write_text("x,y,z,scale,turn\n" + "\n".join(lines) + "\n")


if __name__ == "__main__":
    write_ply(FOLDER / "fir.ply", *fir())
    write_forest(FOLDER / "forest.csv")
