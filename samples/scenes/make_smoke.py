#!/usr/bin/env python3
"""Makes smoke.df3 and its header, a puff of smoke in 32 x 40 x 32 voxels: what smoke.toml shows.

    python3 samples/scenes/make_smoke.py
"""
import json
import math
import pathlib
import random
import struct

FOLDER = pathlib.Path(__file__).parent
SIZE = (32, 40, 32)
VOXEL = 0.05  # [m]


def density(puffs, p):
    """A union of soft balls, 0 .. 1."""
    return min(1.0, sum(max(0.0, 1 - math.dist(p, centre) / radius) ** 1.5 for centre, radius in puffs))


def main():
    rng = random.Random(9)
    middle = [(s - 1) / 2 for s in SIZE]
    puffs = []
    for k in range(34):
        y = 4 + 28 * k / 33
        reach = 0.5 + 0.2 * y
        radius = 3 + 0.13 * y
        angle = 2.4 * k + rng.uniform(-0.5, 0.5)
        puffs.append(((middle[0] + reach * math.cos(angle), y, middle[2] + reach * math.sin(angle)), radius))
    data = struct.pack(">3H", *SIZE)
    for z in range(SIZE[2]):
        for y in range(SIZE[1]):
            data += bytes(round(255 * density(puffs, (x, y, z))) for x in range(SIZE[0]))
    (FOLDER / "smoke.df3").write_bytes(data)
    corner = (-VOXEL * middle[0], 0.0, -VOXEL * middle[2])
    header = {"pileus_volume": 1, "type": "uint8", "endian": "big", "order": "x fastest", "size": list(SIZE),
              "world_from_index": [[VOXEL * (i == j) for j in range(3)] + [corner[i]] for i in range(3)]}
    (FOLDER / "smoke.df3.json").write_text(json.dumps(header) + "\n")


if __name__ == "__main__":
    main()
