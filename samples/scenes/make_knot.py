#!/usr/bin/env python3
"""Makes knot.ply, a tube along a trefoil knot: a closed mesh, which knot.toml fills with cloud.

    python3 samples/scenes/make_knot.py
"""
import math
import pathlib
import struct

ALONG, AROUND, RADIUS = 120, 12, 0.62


def curve(s):
    return (math.sin(s) + 2 * math.sin(2 * s), math.cos(s) - 2 * math.cos(2 * s), -math.sin(3 * s))


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return tuple(x / length for x in v)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def knot():
    """Rings across the curve, square to its direction and to the axis of the knot."""
    vertices, triangles = [], []
    for i in range(ALONG):
        s = 2 * math.pi * i / ALONG
        p, q = curve(s), curve(s + 1e-4)
        along = unit(tuple(b - a for a, b in zip(p, q)))
        side = unit(cross((0, 0, 1), along))
        up = cross(along, side)
        for k in range(AROUND):
            a = 2 * math.pi * k / AROUND
            vertices.append(tuple(p[n] + RADIUS * (math.cos(a) * side[n] + math.sin(a) * up[n]) for n in range(3)))
            here, beside = i * AROUND + k, i * AROUND + (k + 1) % AROUND
            there, beyond = (here + AROUND) % (ALONG * AROUND), (beside + AROUND) % (ALONG * AROUND)
            triangles.append((here, there, beyond))
            triangles.append((here, beyond, beside))
    return vertices, triangles


def main():
    vertices, triangles = knot()
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment made by make_knot.py\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    body = b"".join(struct.pack("<3f", *v) for v in vertices)
    body += b"".join(struct.pack("<B3i", 3, *t) for t in triangles)
    (pathlib.Path(__file__).parent / "knot.ply").write_bytes(header.encode() + body)


if __name__ == "__main__":
    main()
