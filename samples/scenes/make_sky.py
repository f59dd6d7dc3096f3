#!/usr/bin/env python3
"""Makes sky.csv, the places of a sky full of clouds: what sky.toml shows.

    python3 samples/scenes/make_sky.py
"""
import pathlib
import random

ROWS, SPACING = 45, 560.0  # places on a jittered grid [m]
TURNS = 8                  # clouds turned in few ways share what is known of the sun's light in them


def main():
    rng = random.Random(12)
    lines = ["x,y,z,scale,turn"]
    for row in range(ROWS):
        for column in range(ROWS):
            if rng.random() < 0.35:
                continue
            x = SPACING * (column - 0.5 * (ROWS - 1) + rng.uniform(-0.4, 0.4))
            z = -SPACING * (row + rng.uniform(-0.4, 0.4))
            scale = 0.5 + 1.1 * rng.random() ** 2
            turn = rng.randrange(TURNS) * 360 // TURNS
            lines.append(f"{x:.0f},{900 + 45 * rng.gauss(0, 1):.0f},{z:.0f},{scale:.2f},{turn}")
    (pathlib.Path(__file__).parent / "sky.csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
