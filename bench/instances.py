#!/usr/bin/env python3
"""What it costs that a cloud stands in many places: time per ray and memory against their number.

The same part of the scene is always seen: the middle one of n clouds, from above, whose neighbours stand too far away to
meet a ray of the camera or of the sun. What grows with n is the index alone, and what is made ready for the march.

    python3 bench/instances.py [--pileus build/release/bin/pileus]
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

SPACING = 14.0  # of clouds 4 m wide
SCENE = """pileus = 1
[camera]
type = "perspective"
position = [0, 60, 0.01]
look_at = [0, 0, 0]
up = [0, 0, -1]
fov_deg = 5
[light.sun]
type = "sun"
direction = [0.3, 1, 0.2]
irradiance = [9, 8, 7]
[volume.puff]
type = "cloud"
preset = "cumulus"
size = [4, 2.6, 3.6]
voxel_size = 0.03
extinction = 12
multiple_scattering = { octaves = 6 }
hidden = true
[volume.all]
type = "instance"
of = "puff"
file = "places.csv"
"""


def write_places(folder, n):
    side = 1
    while side * side < n:
        side += 2
    cells = [(x, z) for x in range(-(side // 2), side // 2 + 1) for z in range(-(side // 2), side // 2 + 1)]
    cells.sort(key=lambda cell: (cell[0] ** 2 + cell[1] ** 2, cell))
    lines = [f"{SPACING * x},0,{SPACING * z},1,{(x + z) % 4 * 90}" for x, z in cells[:n]]
    (folder / "places.csv").write_text("\n".join(lines) + "\n")


def render(pileus, folder, integrator, size):
    report = folder / "report.json"
    subprocess.run([pileus, "render", folder / "scene.toml", "-o", folder / "out.exr", "--size", size, "--threads", "1",
                    "--integrator", integrator, "--report", report, "--quiet"], check=True)
    return json.loads(report.read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pileus", default="build/release/bin/pileus")
    parser.add_argument("--counts", default="1,10,100,1000,10000,100000")
    parser.add_argument("--rounds", type=int, default=7, help="all counts take turns; the least time counts")
    arguments = parser.parse_args()
    counts = [int(count) for count in arguments.counts.split(",")]
    best = {}
    with tempfile.TemporaryDirectory() as name:
        for n in counts:
            folder = pathlib.Path(name) / str(n)
            folder.mkdir()
            (folder / "scene.toml").write_text(SCENE)
            write_places(folder, n)
        for _ in range(arguments.rounds):
            for n in counts:
                for integrator, size in (("exact", "80x60"), ("march", "320x240")):
                    report = render(arguments.pileus, pathlib.Path(name) / str(n), integrator, size)
                    known = best.get((n, integrator))
                    if known is None or report["seconds"]["trace"] < known["seconds"]["trace"]:
                        best[n, integrator] = report
    print("| places | exact [µs per ray] | march [µs per ray] | march made ready in [s] | built in [s] | peak memory [MB] |")
    print("| --- | --- | --- | --- | --- | --- |")
    for n in counts:
        exact, march = best[n, "exact"], best[n, "march"]
        ready = march["seconds"]["render"] - march["seconds"]["trace"]
        print(f"| {n} | {1e6 * exact['seconds']['trace'] / exact['rays']:.2f} "
              f"| {1e6 * march['seconds']['trace'] / march['rays']:.2f} | {ready:.2f} "
              f"| {march['seconds']['build']:.2f} | {march['peak_memory_bytes'] / 1e6:.0f} |")


if __name__ == "__main__":
    main()
