"""NanoVDB's own programs accept what pileus writes, and agree on its voxels."""
import pathlib
import tempfile

from common import convert, expect, need, run, write_raw

validate = need("nanovdb_validate", "libnanovdb-tools")
show = need("nanovdb_print", "libnanovdb-tools")
with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    convert(write_raw(folder / "a.raw"), folder / "a.nvdb")
    result = run(validate, "-v", folder / "a.nvdb")
    expect("invalid" not in result.lower() and "error" not in result.lower(), f"nanovdb_validate says\n{result}")
    result = run(show, folder / "a.nvdb")
    for part in ("density", "float", "FOG", "48"):
        expect(part in result, f"nanovdb_print does not show {part}:\n{result}")
print("passed")
