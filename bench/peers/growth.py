#!/usr/bin/env python3
"""How the time of pileus grows with voxels, pixels and threads, on the common scene. Needs Python 3.11 and NumPy."""
import argparse
import json
import shutil
import statistics
from pathlib import Path

from common import HERE, ROOT, Paths, run

VOXEL_SIZES = {"256^3": 0.0051, "512^3": 0.00255}  # [m], of the same cloud
PICTURES = [(320, 180), (640, 360), (1280, 720)]


def prepare(paths):
    """A folder for each cloud, with the scene beside it."""
    for name, voxel_size in VOXEL_SIZES.items():
        folder = paths.out / name.removesuffix("^3")
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / "cloud.vdb").is_file():
            print(f"== building the cloud of {name} voxels", flush=True)
            run([paths.program("pileus"), "cloud", HERE / "cloud.toml", "-o", folder / "cloud.vdb", "--quiet",
                 "--voxel-size", voxel_size, "--max-voxels", 1e9])
        shutil.copyfile(HERE / "scene.toml", folder / "scene.toml")


def measure(paths, voxels, tolerance, repeats, options=()):
    """Medians of (build and render, rays alone) in seconds, and the largest peak in MB."""
    folder = paths.out / voxels.removesuffix("^3")
    reports = []
    for _ in range(repeats):
        run([paths.program("pileus"), "render", folder / "scene.toml", "-o", folder / "picture.exr", "--quiet",
             "--tolerance", tolerance, "--report", folder / "report.json", *options])
        reports.append(json.loads((folder / "report.json").read_text()))
    seconds = [report["seconds"] for report in reports]
    return (statistics.median(s["build"] + s["render"] for s in seconds),
            statistics.median(s["trace"] for s in seconds),
            1e-6 * max(report["peak_memory_bytes"] for report in reports))


def show(what, tolerance, rows):
    """rows: (label, measurement); growth is against the first."""
    for label, (seconds, rays, peak) in rows:
        print(f"{what:8} {tolerance:9g} {label:12} {seconds:9.3f} {rays:8.3f} {peak:8.0f} "
              f"{seconds / rows[0][1][0]:8.2f} {rays / rows[0][1][1]:8.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bin", type=Path, default=ROOT / "build/release/bin", help="folder of the programs")
    parser.add_argument("--out", type=Path, default=ROOT / "build/bench/growth", help="folder for what is made")
    parser.add_argument("--repeats", type=int, default=5, help="medians of so many runs (default: 5)")
    options = parser.parse_args()
    paths = Paths(options.bin.resolve(), options.out.resolve())
    prepare(paths)
    print(f"{'':8} {'tolerance':>9} {'':12} {'build+':>9} {'rays':>8} {'peak':>8} {'growth':>8} {'of rays':>8}\n"
          f"{'':31} {'render s':>9} {'s':>8} {'MB':>8}")
    for tolerance in (0.03, 0.01, 0.002):
        show("voxels", tolerance, [(voxels, measure(paths, voxels, tolerance, options.repeats))
                                   for voxels in VOXEL_SIZES])
    show("pixels", 0.01, [(f"{w}x{h}", measure(paths, "256^3", 0.01, options.repeats,
                                               ["--set", f"render.size=[{w},{h}]"])) for w, h in PICTURES])
    for tolerance in (0.01, 0.002):
        show("threads", tolerance, [(threads, measure(paths, "256^3", tolerance, options.repeats,
                                                      ["--threads", threads])) for threads in ("1", "2")])


if __name__ == "__main__":
    main()
