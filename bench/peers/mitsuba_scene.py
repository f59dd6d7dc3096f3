"""Renders the common scene in Mitsuba 3: mitsuba_scene.py JOB.json

Rays start in the middles of the pixels, where the truth has its own: they are made here and handed to the integrator.
"""
import glob
import json
import os
import sys
import time

# Dr.Jit takes the oldest LLVM it finds, and stops at an instruction that only newer ones know.
newest = sorted(glob.glob("/usr/lib/*/libLLVM.so.*"))
if newest:
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", newest[-1])

import drjit as dr
import mitsuba as mi
import numpy as np

VARIANT = "llvm_ad_rgb"
PASS_RAYS = 1 << 23  # at once: bounds the memory

job = json.loads(open(sys.argv[1]).read())
start = time.perf_counter()
mi.set_variant(VARIANT)
dr.set_thread_count(2)

rho = np.load(job["grid"])
size, origin, voxel = np.array(rho.shape[::-1]), np.array(job["origin"]), job["voxel_size"]
# Mitsuba places values at the middles of cells: the box of S values is S voxels wide.
low, high = origin - 0.5 * voxel, origin + (size - 0.5) * voxel
world_from_unit = mi.ScalarTransform4f().translate(list(low)).scale(list(high - low))
scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "volpath", "max_depth": 2, "rr_depth": 1000},
    "sun": {"type": "directional", "direction": [-x for x in job["sun"]],
            "irradiance": {"type": "rgb", "value": job["irradiance"]}},
    "box": {
        "type": "cube",
        "to_world": mi.ScalarTransform4f().translate(list(0.5 * (low + high))).scale(list(0.5 * (high - low))),
        "bsdf": {"type": "null"},
        "interior": {
            "type": "heterogeneous",
            "albedo": {"type": "constvolume", "value": {"type": "rgb", "value": 1.0}},
            "sigma_t": {"type": "gridvolume", "grid": mi.VolumeGrid(rho[..., None]), "to_world": world_from_unit,
                        "filter_type": "trilinear", "wrap_mode": "clamp"},
            "scale": job["extinction"],
            "phase": {"type": "isotropic"},
        },
    },
})

backward = np.array(job["position"]) - np.array(job["look_at"])
backward /= np.linalg.norm(backward)
right = np.cross([0, 1, 0], backward)
right /= np.linalg.norm(right)
up = np.cross(backward, right)
width, height = job["width"], job["height"]
tan_half = np.tan(np.radians(job["fov_deg"] / 2))
x = tan_half * (2 * (np.arange(width) + 0.5) - width) / width
y = tan_half * (height - 2 * (np.arange(height) + 0.5)) / width
d = x[None, :, None] * right + y[:, None, None] * up - backward
d /= np.linalg.norm(d, axis=2, keepdims=True)
directions = d.reshape(-1, 3)

total = np.zeros(width * height)
done = 0
while done < job["samples"]:
    samples = min(job["samples"] - done, max(1, PASS_RAYS // (width * height)))
    pixel = dr.arange(mi.UInt32, width * height * samples) // samples
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(done, width * height * samples)
    ray = mi.RayDifferential3f(mi.Point3f(job["position"]),
                               dr.gather(mi.Vector3f, mi.Vector3f(*map(mi.Float, directions.T)), pixel))
    colour, _, _ = scene.integrator().sample(scene, sampler, ray, None, True)
    total += np.array(dr.block_sum(colour.x, samples), dtype=np.float64)
    done += samples
np.save(job["picture"], (total / done).reshape(height, width).astype(np.float32))
json.dump({"render": time.perf_counter() - start}, open(job["report"], "w"))
