"""The plain marcher: the bar that speed-ups are counted from."""
import json

import numpy as np

from common import Picture, run

NAME = "plain marcher"


def check(paths):
    paths.program("plain_marcher")


def ladder(quick):
    """Steps in voxels, from coarse to fine."""
    return [6, 3, 2, 1.5, 1] if quick else [8, 6, 4, 3, 2, 1.5, 1, 0.7]


def label(setting):
    return f"step {setting:g}"


def render(paths, scene, setting, limit, options=()):
    pixels = paths.out / "plain_marcher.npy"
    seconds, cpu, output = run([paths.program("plain_marcher"), paths.scene, "-o", pixels, "--threads", "2",
                                "--step", setting, *options], limit)
    return Picture(np.load(pixels).astype(np.float64), json.loads(output)["render"], seconds, cpu)
