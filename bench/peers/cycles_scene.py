"""Builds and renders the common scene in Blender: blender -b -P cycles_scene.py -- JOB.json"""
import json
import sys
import time

import bpy
from mathutils import Matrix, Vector

job = json.loads(open(sys.argv[sys.argv.index("--") + 1]).read())

for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
scene = bpy.context.scene


def add(name, data):
    thing = bpy.data.objects.new(name, data)
    scene.collection.objects.link(thing)
    return thing


# Everything stands in the coordinates of the grid; that Blender calls z up does not matter.
position, look_at = Vector(job["position"]), Vector(job["look_at"])
backward = (position - look_at).normalized()
right = Vector((0, 1, 0)).cross(backward).normalized()
up = backward.cross(right)
camera = bpy.data.cameras.new("camera")
camera.sensor_fit = "HORIZONTAL"
camera.angle = job["fov_deg"] * 3.141592653589793 / 180
camera.clip_start, camera.clip_end = 0.001, 1000
scene.camera = add("camera", camera)
frame = Matrix((right, up, backward)).transposed().to_4x4()
frame.translation = position
scene.camera.matrix_world = frame

sun = bpy.data.lights.new("sun", "SUN")
sun.energy, sun.angle = job["irradiance"], 0
sun.use_shadow = True
lamp = add("sun", sun)
lamp.matrix_world = Vector(job["sun"]).to_track_quat("Z", "Y").to_matrix().to_4x4()  # a lamp shines along its -z

volume = bpy.data.volumes.new("cloud")
volume.filepath = job["cloud"]
volume.render.precision = "FULL"
volume.render.step_size = job["step"] * job["voxel_size"]
cloud = add("cloud", volume)
cloud.location = Vector((-0.5,) * 3) * job["voxel_size"]  # Cycles shows a voxel's value at its upper corner

material = bpy.data.materials.new("cloud")
material.use_nodes = True
nodes, links = material.node_tree.nodes, material.node_tree.links
nodes.clear()
scatter = nodes.new("ShaderNodeVolumeScatter")
scatter.inputs["Color"].default_value = (1, 1, 1, 1)
scatter.inputs["Anisotropy"].default_value = 0
density = nodes.new("ShaderNodeAttribute")
density.attribute_name = "density"
product = nodes.new("ShaderNodeMath")
product.operation = "MULTIPLY"
product.inputs[1].default_value = job["extinction"]
output = nodes.new("ShaderNodeOutputMaterial")
links.new(density.outputs["Fac"], product.inputs[0])
links.new(product.outputs[0], scatter.inputs["Density"])
links.new(scatter.outputs[0], output.inputs["Volume"])
volume.materials.append(material)
material.cycles.volume_interpolation = "LINEAR"
material.cycles.homogeneous_volume = False

world = bpy.data.worlds.new("black")
world.use_nodes = True
world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
scene.world = world

render = scene.render
render.engine = "CYCLES"
render.resolution_x, render.resolution_y, render.resolution_percentage = job["width"], job["height"], 100
render.threads_mode, render.threads = "FIXED", 2
render.film_transparent = False
render.image_settings.file_format = "OPEN_EXR"
render.image_settings.color_depth = "32"
render.filepath = job["picture"]
scene.view_settings.view_transform = "Raw"

cycles = scene.cycles
cycles.device = "CPU"
cycles.samples = job["samples"]
cycles.use_adaptive_sampling = False
cycles.use_denoising = False
cycles.pixel_filter_type = "BLACKMAN_HARRIS"
cycles.filter_width = 0.01
cycles.max_bounces = cycles.volume_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 0
cycles.transmission_bounces = 0
cycles.transparent_max_bounces = 64
cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
cycles.volume_step_rate = 1  # the volume's own step_size says it
cycles.volume_max_steps = 65536

start = time.perf_counter()
bpy.ops.render.render(write_still=True)
json.dump({"render": time.perf_counter() - start}, open(job["report"], "w"))
