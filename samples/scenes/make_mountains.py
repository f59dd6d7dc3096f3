#!/usr/bin/env python3
"""Makes mountains.png, the terrain of flight.toml: 289 x 289 heights in whole metres as 16-bit grey.

  python3 samples/scenes/make_mountains.py samples/scenes/mountains.png

Ridged noise in octaves, each the stronger the higher the ground is so far: crests are rough, valleys smooth.
"""
import struct
import sys
import zlib

import numpy as np

SIZE = 289
HIGHEST = 1450.0  # [m]


def value_noise(rng, cells):
    """Smooth noise on SIZE x SIZE points, with `cells` random values along a side; about -1 .. 1."""
    lattice = rng.uniform(-1.0, 1.0, (cells + 2, cells + 2))
    x = np.linspace(0.0, cells, SIZE)
    i = x.astype(int)
    f = x - i
    s = f * f * f * (f * (f * 6.0 - 15.0) + 10.0)
    rows = lattice[i] * (1.0 - s)[:, None] + lattice[i + 1] * s[:, None]
    return rows[:, i] * (1.0 - s) + rows[:, i + 1] * s


def heights():
    rng = np.random.default_rng(11)
    height = np.zeros((SIZE, SIZE))
    weight, amplitude = np.ones((SIZE, SIZE)), 1.0
    for cells in (5, 11, 23, 47, 95):
        ridge = (1.0 - np.abs(value_noise(rng, cells))) ** 2 * weight
        height += amplitude * ridge
        weight, amplitude = np.clip(1.6 * ridge, 0.0, 1.0), 0.5 * amplitude
    height = (height - height.min()) / (height.max() - height.min())
    return np.rint(HIGHEST * height**1.3).astype(">u2")


def write_png(file, grey):
    """16-bit grey, each row as differences from the one above: that packs best."""
    rows = grey.view(np.uint8).reshape(SIZE, 2 * SIZE)
    above = np.vstack([np.zeros((1, 2 * SIZE), np.uint8), rows[:-1]])
    filtered = np.hstack([np.full((SIZE, 1), 2, np.uint8), rows - above])

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    with open(file, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", SIZE, SIZE, 16, 0, 0, 0, 0)))
        out.write(chunk(b"IDAT", zlib.compress(filtered.tobytes(), 9)) + chunk(b"IEND", b""))


write_png(sys.argv[1], heights())
