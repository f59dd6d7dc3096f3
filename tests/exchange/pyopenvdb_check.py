"""python3-openvdb reads the values that pileus writes, and pileus hands on what python3-openvdb writes."""
import pathlib
import tempfile

from common import FIRST, SIZE, convert, expect, sample, skip, world, write_raw

try:
    import pyopenvdb as vdb
except ImportError:
    skip("pyopenvdb is not installed (Debian: python3-openvdb)")


def check_values(path, error=0.0):
    grid = vdb.read(str(path), "density")
    accessor = grid.getConstAccessor()
    for k in range(SIZE[2]):
        for j in range(SIZE[1]):
            for i in range(SIZE[0]):
                place = (FIRST[0] + i, FIRST[1] + j, FIRST[2] + k)
                value, is_active = accessor.probeValue(place)
                expect(abs(value - sample(i, j, k)) <= error, f"{path.name}: {value} at {place}")
                expect(is_active == (sample(i, j, k) != 0), f"{path.name}: state at {place}")
                expect(grid.transform.indexToWorld(place) == world(i, j, k), f"{path.name}: place of {place}")
    expect(grid.background == 0 and grid.gridClass == vdb.GridClass.FOG_VOLUME, f"{path.name}: class")


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    convert(write_raw(folder / "a.raw"), folder / "a.vdb")
    check_values(folder / "a.vdb")
    for step in ("nvdb", "npy", "raw"):  # there and back
        convert(folder / "a.vdb", folder / f"b.{step}")
        convert(folder / f"b.{step}", folder / f"{step}.vdb")
        check_values(folder / f"{step}.vdb")
    convert(folder / "a.vdb", folder / "b.df3", "--bits", "16")
    convert(folder / "b.df3", folder / "df3.vdb")
    check_values(folder / "df3.vdb", 0.51 / 65535)

    flow = vdb.Vec3SGrid()
    flow.name = "vel"
    flow.transform = vdb.createLinearTransform(0.1)
    flow["station"] = "Kew"
    flow.fill((0, 0, 0), (3, 9, 20), (1.0, -2.5, 0.125))
    vdb.write(str(folder / "vel.vdb"), grids=[flow], metadata={"shot": "sh010"})
    convert(folder / "a.vdb", folder / "all.vdb", "--merge", folder / "vel.vdb", "--codec", "zip")
    grids, metadata = vdb.readAll(str(folder / "all.vdb"))
    expect([grid.name for grid in grids] == ["density", "vel"], "merged names")
    back = grids[1]
    expect(back.activeVoxelCount() == flow.activeVoxelCount() and back["station"] == "Kew", "merged vectors")
    expect(back.getConstAccessor().getValue((2, 5, 11)) == (1.0, -2.5, 0.125), "value of a vector")
    convert(folder / "vel.vdb", folder / "again.vdb")
    expect(vdb.readAll(str(folder / "again.vdb"))[1]["shot"] == "sh010", "metadata of the file")
    convert(folder / "all.vdb", folder / "all.nvdb", "--codec", "zip")
    convert(folder / "all.nvdb", folder / "back.vdb")
    back = vdb.read(str(folder / "back.vdb"), "vel")
    expect(back.getConstAccessor().getValue((2, 5, 11)) == (1.0, -2.5, 0.125), "a vector through .nvdb")
print("passed")
