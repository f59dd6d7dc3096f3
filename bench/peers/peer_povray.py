"""POV-Ray 3.7: isotropic scattering media in a box, the density a 16-bit .df3 file.

POV-Ray puts sample i of S at i / S of the unit cube, so the cube spans S voxel edges. Its isotropic scattering leaves
out 1 / (4 pi), so the light's colour is the scene's source.

Of its ways to sample, many intervals of one centred sample (method 2) converge best, in second order: a medium does
not dim its own light within an interval, so few intervals of many samples converge to something else, and the adaptive
method 3 is of first order.
"""
import shutil

import numpy as np

from common import Picture, Skip, camera_frame, dense_grid, read_channel, run

NAME = "POV-Ray"


def check(paths):
    if not shutil.which("povray"):
        raise Skip("install Debian package povray")


def ladder(quick):
    """Intervals per ray, from coarse to fine."""
    return [10, 20] if quick else [20, 40, 60, 90, 130]


def label(setting):
    return f"{setting} intervals"


def render(paths, scene, setting, limit):
    write_density(paths)
    (paths.out / "cloud.pov").write_text(scene_text(paths, scene, setting))
    seconds, cpu, _ = run(["povray", "cloud.pov", "+Opovray.exr", "+FE", f"+W{scene.width}", f"+H{scene.height}",
                           "-A", "-D", "+WT2", "-GA"], limit, folder=paths.out)
    return Picture(read_channel(paths, paths.out / "povray.exr"), None, seconds, cpu)


def write_density(paths):
    file = paths.out / "cloud.df3"
    if file.is_file() and file.stat().st_mtime > paths.cloud.stat().st_mtime:
        return
    rho = dense_grid(paths)[0]
    sizes = np.array(rho.shape[::-1], dtype=">u2")
    file.write_bytes(sizes.tobytes() + np.round(rho * 65535.0).astype(">u2").tobytes())


def scene_text(paths, scene, intervals):
    rho, origin, voxel_size = dense_grid(paths)
    sizes = np.array(rho.shape[::-1])
    right, up, backward = camera_frame(scene)
    tan_half = np.tan(np.radians(scene.fov_deg / 2))
    sun = np.array(scene.sun) / np.linalg.norm(scene.sun)
    vector = lambda v: "<" + ", ".join(f"{x:.12g}" for x in v) + ">"
    return f"""
#version 3.7;
global_settings {{ assumed_gamma 1 }}
background {{ rgb 0 }}
camera {{
  perspective
  location {vector(scene.position)}
  direction {vector(-backward)}
  right {vector(2 * tan_half * right)}
  up {vector(2 * tan_half * scene.height / scene.width * up)}
}}
light_source {{
  {vector(np.array(scene.look_at) + 100 * sun)}, rgb {scene.source:.12g}
  parallel point_at {vector(scene.look_at)}
  media_interaction on media_attenuation on
}}
box {{
  {vector(origin)}, {vector(origin + (sizes - 1) * voxel_size)}
  hollow
  pigment {{ rgbt 1 }}
  interior {{
    media {{
      method 2 intervals {intervals} samples 1, 1 jitter 0
      scattering {{ 1, rgb {scene.extinction:.12g} extinction 1 }}
      density {{
        density_file df3 "cloud.df3" interpolate 1
        color_map {{ [0 rgb 0] [1 rgb 1] }}
        scale {vector(sizes * voxel_size)}
        translate {vector(origin)}
      }}
    }}
  }}
}}
"""
