"""Blender imports what pileus writes and renders it: something is where the cloud is, nothing beside it."""
import pathlib
import tempfile

from common import convert, expect, need, run, world, write_raw

SCRIPT = """
import bpy, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.object.volume_import(filepath={file!r})
volume = bpy.context.object
volume.data.grids.load()
print('PILEUS grids', [grid.name for grid in volume.data.grids], [grid.data_type for grid in volume.data.grids])
print('PILEUS size', list(volume.dimensions))
material = bpy.data.materials.new('smoke')
material.use_nodes = True
nodes = material.node_tree.nodes
nodes.clear()
shader, output = nodes.new('ShaderNodeVolumePrincipled'), nodes.new('ShaderNodeOutputMaterial')
shader.inputs['Density'].default_value = 5
shader.inputs['Emission Strength'].default_value = 1
material.node_tree.links.new(shader.outputs['Volume'], output.inputs['Volume'])
volume.data.materials.append(material)
scene = bpy.context.scene
camera = bpy.data.objects.new('camera', bpy.data.cameras.new('camera'))
camera.data.type, camera.data.ortho_scale = 'ORTHO', 8
camera.location = ({x}, {y}, 20)  # cameras look along -z
scene.collection.objects.link(camera)
scene.camera = camera
scene.render.engine = 'CYCLES'
scene.cycles.samples = 4
scene.cycles.use_denoising = False
scene.render.film_transparent = True
scene.render.resolution_x = scene.render.resolution_y = 32
scene.render.image_settings.file_format = 'PNG'
scene.render.filepath = {picture!r}
bpy.ops.render.render(write_still=True)
image = bpy.data.images.load({picture!r})
alpha = list(image.pixels)[3::4]
print('PILEUS alpha', max(alpha), alpha[0])
"""

blender = need("blender", "blender")
with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    convert(write_raw(folder / "a.raw"), folder / "a.vdb")
    x, y, _ = world(2, 1.5, 1)
    (folder / "look.py").write_text(SCRIPT.format(file=str(folder / "a.vdb"), picture=str(folder / "a.png"), x=x, y=y))
    result = run(blender, "-b", "--factory-startup", "-noaudio", "-t", "2", "-P", folder / "look.py")
    lines = {line.split()[1]: line for line in result.splitlines() if line.startswith("PILEUS")}
    expect("'density'" in lines.get("grids", "") and "FLOAT" in lines["grids"], f"Blender finds\n{result}")
    _, _, densest, corner = lines.get("alpha", "x x 0 1").split()
    expect(float(densest) > 0.3 and float(corner) < 0.01, f"the picture is wrong: {lines.get('alpha')}\n{result}")
print("passed")
