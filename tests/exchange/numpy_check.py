"""NumPy reads the arrays that pileus writes, and pileus those of NumPy: every order, byte order and width."""
import json
import pathlib
import tempfile

from common import FIRST, SIZE, convert, expect, sample, skip, world, write_raw

try:
    import numpy as np
except ImportError:
    skip("NumPy is not installed (Debian: python3-numpy)")


def check_written(folder):
    """array[x, y, z], and the header tells where a voxel's centre lies."""
    convert(write_raw(folder / "a.raw"), folder / "a.npy")
    array, place = np.load(folder / "a.npy"), json.loads((folder / "a.npy.json").read_text())
    expect(array.shape == SIZE and array.dtype == np.float32, f"{array.shape} {array.dtype}")
    for index in np.ndindex(SIZE):
        expect(array[index] == np.float32(sample(*index)), f"{array[index]} at {index}")
        centre = np.array(place["world_from_index"]) @ np.append(np.array(index) + place["first_voxel"], 1)
        expect(tuple(centre) == world(*index), f"centre {centre} of {index}")
    expect(tuple(place["first_voxel"]) == FIRST, "first voxel")


def check_half(folder):
    """16-bit floats are off by half a unit in the last place of 16 bits at most."""
    values = np.random.default_rng(5).lognormal(0, 3, (9, 8, 7)).clip(1e-7, 6e4).astype(np.float32)
    np.save(folder / "b.npy", values)
    convert(folder / "b.npy", folder / "half.npy", "--half")
    half = np.load(folder / "half.npy")
    expect(half.dtype == np.float16, f"{half.dtype}")
    convert(folder / "b.npy", folder / "half.vdb", "--half")
    convert(folder / "half.vdb", folder / "of_vdb.npy")
    ulp = np.spacing(half).astype(np.float64)
    for name, array in (("npy", half), ("vdb", np.load(folder / "of_vdb.npy"))):
        error = np.abs(array.astype(np.float64) - values)
        expect((error <= 0.5 * ulp).all(), f"{name}: off by {(error / ulp).max()} units in the last place")


def check_read(folder):
    """Arrays of every kind come back with the same values."""
    random = np.random.default_rng(7)
    numbers = random.integers(1, 100, (6, 5, 4))
    for kind in ("u1", "i1", "<u2", ">i2", "<i4", ">u4", "<f2", "<f4", ">f4", "<f8", ">f8"):
        for order in "CF":
            np.save(folder / "c.npy", np.array(numbers, dtype=kind, order=order))
            convert(folder / "c.npy", folder / "c.vdb")
            convert(folder / "c.vdb", folder / "d.npy")
            expect((np.load(folder / "d.npy") == numbers).all(), f"{kind} in {order} order")
    vectors = random.normal(size=(3, 4, 5, 3)).astype(np.float32)
    np.save(folder / "v.npy", vectors)
    convert(folder / "v.npy", folder / "v.vdb")
    convert(folder / "v.vdb", folder / "w.npy")
    expect((np.load(folder / "w.npy") == vectors).all(), "vectors")


with tempfile.TemporaryDirectory() as folder:
    for check in (check_written, check_half, check_read):
        check(pathlib.Path(folder))
print("passed")
