"""OpenVDB's vdb_render: marches the sparse grid with left-hand samples and skips empty tree nodes.

Its steps and coefficients count in voxels, not metres. -gain 0 makes its shadow rays physical. It leaves out the
phase function, so the light's colour is the scene's source.
"""
import shutil

from common import Picture, Skip, dense_grid, read_channel, run, triple

NAME = "vdb_render"
CUTOFF = "1e-6"  # of density and of squared transmittance


def check(paths):
    if not shutil.which("vdb_render"):
        raise Skip("install Debian package libopenvdb-tools")


def ladder(quick):
    """From coarse to fine: (primary step, shadow step) in voxels."""
    coarse = [(4, 1), (2, 0.5)]
    return coarse if quick else coarse + [(2, 0.25), (1, 0.125), (0.5, 0.0625)]


def label(setting):
    return f"step {setting[0]:g}, shadow {setting[1]:g}"


def render(paths, scene, setting, limit):
    picture = paths.out / "vdb_render.exr"
    voxel_size = dense_grid(paths)[2]
    seconds, cpu, _ = run([
        "vdb_render", paths.cloud, picture, "-res", f"{scene.width}x{scene.height}", "-cpus", "2",
        "-camera", "persp", "-fov", scene.fov_deg, "-translate", triple(scene.position),
        "-lookat", triple(scene.look_at), "-up", "0,1,0",
        "-absorb", "0,0,0", "-scatter", triple([scene.extinction * voxel_size] * 3),
        "-light", triple([*scene.sun, *[scene.source] * 3]), "-gain", "0", "-cutoff", CUTOFF,
        "-step", setting[0], "-shadowstep", setting[1], "-compression", "none"], limit)
    return Picture(read_channel(paths, picture), None, seconds, cpu)
