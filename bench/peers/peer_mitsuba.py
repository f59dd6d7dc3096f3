"""Mitsuba 3: delta tracking in a grid volume, one scattering event at most; unbiased, so its error is noise.

Its seconds hold the compiling of its kernels, as a first picture does. PILEUS_BENCH_MITSUBA names a Python that has
the package (in a virtual environment, say).
"""
import json
import os
import subprocess
import sys

import numpy as np

from common import HERE, Picture, Skip, dense_grid, run

NAME = "Mitsuba 3"
PYTHON = os.environ.get("PILEUS_BENCH_MITSUBA", sys.executable)


def check(paths):
    if subprocess.run([PYTHON, "-c", "import mitsuba"], capture_output=True).returncode != 0:
        raise Skip("install PyPI packages mitsuba and numpy, name their Python in PILEUS_BENCH_MITSUBA; "
                   "and Debian package libllvm19")


def ladder(quick):
    """Samples per pixel, from coarse to fine."""
    return [1, 4] if quick else [4, 16, 64, 256, 1024]


def label(setting):
    return f"{setting} samples"


def render(paths, scene, setting, limit):
    rho, origin, voxel_size = dense_grid(paths)
    job = dict(scene.as_dict(), grid=str(paths.out / "cloud.npy"), origin=list(origin), voxel_size=voxel_size,
               picture=str(paths.out / "mitsuba.npy"), report=str(paths.out / "mitsuba.json"), samples=setting)
    file = paths.out / "mitsuba_job.json"
    file.write_text(json.dumps(job))
    seconds, cpu, _ = run([PYTHON, HERE / "mitsuba_scene.py", file], limit)
    report = json.loads((paths.out / "mitsuba.json").read_text())
    return Picture(np.load(job["picture"]).astype(np.float64), report["render"], seconds, cpu)
