"""What the drivers share: where things lie, the numbers of the scene, running programs, reading pictures."""
import json
import math
import resource
import subprocess
import tempfile
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent


@dataclass
class Paths:
    """Programs, and the folder that holds everything made on the way."""
    bin: Path
    out: Path

    def program(self, name):
        path = self.bin / name
        if not path.is_file():
            raise SystemExit(f"compare.py: {path} is missing; ./run bench builds it")
        return path

    @property
    def scene(self):
        return self.out / "scene.toml"

    @property
    def cloud(self):
        return self.out / "cloud.vdb"


class Scene:
    """The numbers of scene.toml, as every peer needs them."""

    def __init__(self, file):
        toml = tomllib.loads(Path(file).read_text())
        self.width, self.height = toml["render"]["size"]
        camera, sun, cloud = toml["camera"], toml["light"]["sun"], toml["volume"]["cloud"]
        self.position, self.look_at, self.fov_deg = camera["position"], camera["look_at"], camera["fov_deg"]
        self.sun = sun["direction"]
        self.irradiance = sun["irradiance"][0]
        self.extinction = cloud["extinction"]

    @property
    def source(self):
        """Radiance scattered in full light per unit of optical depth: p E with p = 1 / (4 pi)."""
        return self.irradiance / (4 * math.pi)

    def as_dict(self):
        return dict(vars(self), source=self.source)


class Skip(Exception):
    """A peer is not installed; the message says what would help."""


class TooSlow(Exception):
    """A run was ended at its time limit."""


def run(command, limit=None, folder=None):
    """Runs a program to its end; returns (seconds of wall time, processor seconds, stdout)."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    try:
        done = subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, capture_output=True,
                              text=True, timeout=limit, cwd=folder)
    except subprocess.TimeoutExpired:
        raise TooSlow(f"more than {limit:g} s") from None
    seconds = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))} failed:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds, cpu, done.stdout


def read_channel(paths, picture, channel="R"):
    """One channel of a picture as float64 [height][width]."""
    with tempfile.NamedTemporaryFile(suffix=".npy", dir=paths.out) as pixels:
        run([paths.program("exr_to_npy"), picture, channel, pixels.name])
        return np.load(pixels.name).astype(np.float64)


def dense_grid(paths):
    """The cloud as (rho[nz][ny][nx], origin, voxel_size); exported once."""
    array, place = paths.out / "cloud.npy", paths.out / "cloud.json"
    if not array.is_file() or not place.is_file() or array.stat().st_mtime < paths.cloud.stat().st_mtime:
        place.write_text(run([paths.program("vdb_to_npy"), paths.cloud, array])[2])
    where = json.loads(place.read_text())
    return np.load(array), np.array(where["origin"]), where["voxel_size"]


@dataclass
class Picture:
    """What a renderer gave for one setting."""
    pixels: np.ndarray
    render_seconds: float | None  # building and rendering, as the program itself reports it
    process_seconds: float        # the whole program, from start to end
    cpu_seconds: float


def triple(values):
    """Numbers as command lines want them: 1,0.5,-2."""
    return ",".join(f"{value:.9g}" for value in values)


def camera_frame(scene):
    """Right, up and backward of the camera, orthonormal."""
    position, look_at = np.array(scene.position), np.array(scene.look_at)
    backward = (position - look_at) / np.linalg.norm(position - look_at)
    right = np.cross([0, 1, 0], backward)
    right /= np.linalg.norm(right)
    return right, np.cross(backward, right), backward
