"""Blender's Cycles: a path tracer, here without bounces; the sun is a lamp of angle 0.

Cycles counts a sun's strength as irradiance and has the phase function, so nothing is scaled. The shortest pixel
filter keeps its rays near the middles of the pixels, where the truth has its own.
"""
import json
import shutil

from common import HERE, Picture, Skip, dense_grid, read_channel, run

NAME = "Cycles"


def check(paths):
    if not shutil.which("blender"):
        raise Skip("install Debian package blender")


def ladder(quick):
    """From coarse to fine: (samples per pixel, step in voxels)."""
    coarse = [(1, 4), (4, 2)]
    return coarse if quick else coarse + [(16, 2), (64, 2), (96, 1)]


def label(setting):
    return f"{setting[0]} samples, step {setting[1]:g}"


def render(paths, scene, setting, limit):
    picture, report = paths.out / "cycles.exr", paths.out / "cycles.json"
    job = dict(scene.as_dict(), cloud=str(paths.cloud), picture=str(picture), report=str(report),
               voxel_size=dense_grid(paths)[2], samples=setting[0], step=setting[1])
    (paths.out / "cycles_job.json").write_text(json.dumps(job))
    picture.unlink(missing_ok=True)  # Blender ends with 0 whatever happens
    seconds, cpu, output = run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "-noaudio",
                                "-P", HERE / "cycles_scene.py", "--", paths.out / "cycles_job.json"], limit)
    if not picture.is_file():
        raise RuntimeError(f"blender wrote no picture:\n{output[-2000:]}")
    return Picture(read_channel(paths, picture), json.loads(report.read_text())["render"], seconds, cpu)
