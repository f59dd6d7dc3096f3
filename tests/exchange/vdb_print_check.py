"""OpenVDB's vdb_print shows names, types, classes, voxel sizes and metadata of what pileus writes."""
import pathlib
import tempfile

from common import convert, expect, need, run, write_raw

vdb_print = need("vdb_print", "libopenvdb-tools")
with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    convert(write_raw(folder / "a.raw"), folder / "full.vdb")
    convert(folder / "full.vdb", folder / "half.vdb", "--half", "--rename", "density=smoke", "--codec", "none")
    full, half = run(vdb_print, "-l", folder / "full.vdb"), run(vdb_print, "-l", folder / "half.vdb")
    for part in ("creator: pileus", "Name: density", "Type: Tree_float_5_4_3", "class: fog volume",
                 "file_voxel_count: 48", "voxel size: 0.5", "[1, -2, 0.25, 1]"):
        expect(part.lower() in full.lower(), f"vdb_print does not show \"{part}\":\n{full}")
    for part in ("Name: smoke", "is_saved_as_half_float: true"):
        expect(part.lower() in half.lower(), f"vdb_print does not show \"{part}\":\n{half}")
print("passed")
