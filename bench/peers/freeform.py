"""A solid of free form in pileus and as an isosurface in POV-Ray: time of the picture, and how the pictures differ.

POV-Ray searches an isosurface by a bound on the gradient that the scene has to guess: `max_gradient`. Too small a
guess leaves holes, a large one takes time; here it is the smallest of a ladder from which the picture hardly
changes. Both use two threads, one ray per pixel, shadows of one sun.
"""
import argparse
import json
import tomllib
from pathlib import Path

import numpy as np

from common import HERE, ROOT, Paths, Scene, camera_frame, read_channel, run

SCENE = HERE / "pebble.toml"


class Pebble(Scene):
    def __init__(self, file):
        toml = tomllib.loads(Path(file).read_text())
        self.width, self.height = toml["render"]["size"]
        camera = toml["camera"]
        self.position, self.look_at, self.fov_deg = camera["position"], camera["look_at"], camera["fov_deg"]
        self.sun = toml["light"]["sun"]["direction"]
        self.form = toml["freeform"]["pebble"]
        self.diffuse = toml["object"]["pebble"]["shader"]["diffuse"][0]


def vector(v):
    return "<" + ", ".join(f"{x:.12g}" for x in v) + ">"


def pov_text(scene, max_gradient, accuracy):
    right, up, backward = camera_frame(scene)
    tan_half = np.tan(np.radians(scene.fov_deg / 2))
    a, b, c = scene.form["base"]["ellipsoid"]["radii"]
    terms = [f"(1 - x*x/{a * a:.12g} - y*y/{b * b:.12g} - z*z/{c * c:.12g})"]
    for bump in scene.form["perturb"]:
        (x, y, z), r = bump["sphere"]["center"], bump["sphere"]["radius"]
        q = f"1 - ((x-{x})*(x-{x}) + (y-{y})*(y-{y}) + (z-{z})*(z-{z}))/{r * r:.12g}".replace("--", "+")
        terms.append(f"{bump['factor']}*pow(max(0, {q}), 3)")
    sun = np.array(scene.sun) / np.linalg.norm(scene.sun)
    return f"""
#version 3.7;
global_settings {{ assumed_gamma 1 }}
background {{ rgb 0 }}
camera {{
  perspective location {vector(scene.position)} direction {vector(-backward)}
  right {vector(2 * tan_half * right)} up {vector(2 * tan_half * scene.height / scene.width * up)}
}}
light_source {{ {vector(100 * sun)}, rgb 1 parallel point_at <0, 0, 0> }}
isosurface {{
  function {{ -({" + ".join(terms)}) }}
  contained_by {{ box {{ <-2.3, -1.6, -1.7>, <2.3, 1.6, 1.9> }} }}
  threshold 0 accuracy {accuracy} max_gradient {max_gradient}
  pigment {{ rgb 1 }} finish {{ ambient 0 diffuse {scene.diffuse} }}
}}
"""


def render_pov(paths, scene, max_gradient, accuracy):
    (paths.out / "pebble.pov").write_text(pov_text(scene, max_gradient, accuracy))
    seconds, cpu, _ = run(["povray", "pebble.pov", "+Opebble_pov.exr", "+FE", f"+W{scene.width}", f"+H{scene.height}",
                           "-A", "-D", "+WT2", "-GA"], folder=paths.out)
    return read_channel(paths, paths.out / "pebble_pov.exr"), seconds, cpu


def render_pileus(paths, method):
    picture, report = paths.out / "pebble_pileus.exr", paths.out / "pebble.json"
    seconds, cpu, _ = run([paths.program("pileus"), "render", SCENE, "-o", picture, "--quiet", "--integrator", "march",
                           "--threads", "2", "--report", report, "--set", f'object.pebble.method="{method}"'])
    stages = json.loads(report.read_text())["seconds"]
    return read_channel(paths, picture), stages["build"] + stages["render"], seconds, cpu


def difference(picture, truth):
    """Share of pixels hit by one only, and the relative RMSE at the best common factor where both hit."""
    both = (picture > 0) & (truth > 0)
    scale = (truth[both] * picture[both]).sum() / (picture[both] ** 2).sum()
    rmse = np.sqrt(((scale * picture - truth)[both] ** 2).mean()) / truth[both].mean()
    return ((picture > 0) != (truth > 0)).mean(), rmse


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--bin", type=Path, default=ROOT / "build/release/bin")
    options.add_argument("--out", type=Path, default=ROOT / "build/bench")
    options.add_argument("--max-gradient", type=float, nargs="+", default=[2, 4, 8, 16])
    options.add_argument("--accuracy", type=float, default=1e-4)
    options.add_argument("--repeat", type=int, default=5)
    args = options.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    paths, scene = Paths(args.bin, args.out), Pebble(SCENE)

    rows, truth = [], None
    for method in ("newton", "subdivision"):
        runs = [render_pileus(paths, method) for _ in range(args.repeat)]
        pixels = runs[0][0]
        truth = pixels if truth is None else truth
        medians = [float(np.median([run[k] for run in runs])) for k in (1, 2, 3)]
        rows.append((f"pileus, {method}", *medians, *difference(pixels, truth)))
    for gradient in args.max_gradient:
        pixels, seconds, cpu = render_pov(paths, scene, gradient, args.accuracy)
        rows.append((f"POV-Ray, max_gradient {gradient:g}", float("nan"), seconds, cpu, *difference(pixels, truth)))
    print(f"{'':28} {'render s':>9} {'process s':>10} {'cpu s':>8} {'one only':>9} {'RMSE':>9}")
    for name, own, seconds, cpu, one_only, rmse in rows:
        print(f"{name:28} {own:9.3f} {seconds:10.3f} {cpu:8.3f} {one_only:9.2e} {rmse:9.2e}")


if __name__ == "__main__":
    main()
