"""What the checks share: the program, a skip, and a box of samples that everyone can write."""
import json
import pathlib
import shutil
import struct
import subprocess
import sys

SKIPPED = 77
PILEUS = sys.argv[1] if len(sys.argv) > 1 else "pileus"


def skip(reason):
    print("skipped:", reason)
    sys.exit(SKIPPED)


def need(program, package):
    path = shutil.which(program)
    if not path:
        skip(f"{program} is not installed (Debian: {package})")
    return path


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}\nended with {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def convert(*arguments):
    return run(PILEUS, "convert", "--quiet", *arguments)


def expect(condition, message):
    if not condition:
        raise SystemExit("failed: " + message)


SIZE = (5, 4, 3)
VOXEL = 0.5
FIRST = (-2, 3, 7)


def sample(i, j, k):
    """A value that differs from voxel to voxel; a few are 0."""
    return 0.0 if (i + j + k) % 5 == 4 else (1 + 3 * i + 17 * j + 71 * k) / 256.0


def world(i, j, k):
    """Centre of the voxel of sample (i, j, k)."""
    return tuple(VOXEL * (FIRST[axis] + step) + (1, -2, 0.25)[axis] for axis, step in enumerate((i, j, k)))


def write_raw(path):
    """The samples as float32 with their header, written without pileus."""
    path = pathlib.Path(path)
    with open(path, "wb") as file:
        for k in range(SIZE[2]):
            for j in range(SIZE[1]):
                for i in range(SIZE[0]):
                    file.write(struct.pack("<f", sample(i, j, k)))
    header = {"pileus_volume": 1, "size": SIZE, "type": "float32", "first_voxel": FIRST, "grid": "density",
              "world_from_index": [[VOXEL, 0, 0, 1], [0, VOXEL, 0, -2], [0, 0, VOXEL, 0.25]]}
    pathlib.Path(str(path) + ".json").write_text(json.dumps(header))
    return path
