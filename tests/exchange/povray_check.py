"""POV-Ray finds each value of a .df3 file at the centre of its voxel, placed by the line in its header."""
import json
import pathlib
import struct
import tempfile

from common import SIZE, VOXEL, convert, expect, need, run, sample, world, write_raw

SCENE = """#version 3.7;
global_settings {{ assumed_gamma 1.0 }}
camera {{ orthographic location <{x}, {y}, {z} - 10> direction z right x * {width} up y * {height} }}
plane {{ z, {z} pigment {{ {pattern} color_map {{ [0 rgb 0] [1 rgb 1] }} }}
        finish {{ ambient 0 diffuse 0 emission 1 }} }}
"""


def render(povray, folder, layer, scale):
    """Values of one layer of voxels, a pixel per voxel."""
    low, high = world(0, 0, layer), world(SIZE[0] - 1, SIZE[1] - 1, layer)
    pattern = json.loads((folder / "a.df3.json").read_text())["pov"]
    scene = SCENE.format(x=(low[0] + high[0]) / 2, y=(low[1] + high[1]) / 2, z=-low[2], width=SIZE[0] * VOXEL,
                         height=SIZE[1] * VOXEL, pattern=pattern)
    (folder / "slice.pov").write_text(scene)
    run(povray, f"+I{folder}/slice.pov", f"+O{folder}/slice.ppm", f"+L{folder}", f"+W{SIZE[0]}", f"+H{SIZE[1]}", "+FP",
        "Bits_Per_Color=16", "File_Gamma=1.0", "-D", "-A", "+GA-", "Work_Threads=1")
    data = (folder / "slice.ppm").read_bytes()
    head, numbers = data.split(b"65535\n", 1)
    expect(head.startswith(b"P6"), "no 16-bit picture")
    reds = struct.unpack(f">{len(numbers) // 2}H", numbers)[::3]
    return [[scale * reds[(SIZE[1] - 1 - j) * SIZE[0] + i] / 65535 for i in range(SIZE[0])] for j in range(SIZE[1])]


povray = need("povray", "povray")
with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    for bits in (8, 16, 32):
        convert(write_raw(folder / "a.raw"), folder / "a.df3", "--bits", bits)
        scale = json.loads((folder / "a.df3.json").read_text())["value_scale"]
        error = scale * (0.51 / (2 ** bits - 1) + 2.0 / 65535) + 1e-6
        for k in range(SIZE[2]):
            layer = render(povray, folder, k, scale)
            for j in range(SIZE[1]):
                for i in range(SIZE[0]):
                    found, expected = layer[j][i], sample(i, j, k)
                    expect(abs(found - expected) <= error, f"{bits} bits: {found} at {(i, j, k)}, not {expected}")
print("passed")
