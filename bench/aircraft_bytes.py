#!/usr/bin/env python3
"""The free-form aircraft against triangle meshes, in bytes: even ones, and one thinned out by quadric error metrics.

    python3 -m pip install fast-simplification
    python3 bench/aircraft_bytes.py [--program build/release/bin/bench_aircraft_bytes]
"""
import argparse
import pathlib
import subprocess
import tempfile

import fast_simplification
import numpy

EDGE = 0.02  # of the mesh that is thinned out [m]
TARGETS = (64000, 32000, 16000, 8000, 4000, 2000)


def read(path):
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    counts = [int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element")]
    vertices = numpy.frombuffer(body, "<f4", 3 * counts[0]).reshape(-1, 3)
    faces = numpy.frombuffer(body, numpy.dtype([("n", "u1"), ("v", "<i4", 3)]), counts[1], 12 * counts[0])["v"]
    return vertices, faces


def write(path, vertices, faces):
    rows = numpy.empty(len(faces), numpy.dtype([("n", "u1"), ("v", "<i4", 3)]))
    rows["n"], rows["v"] = 3, faces
    head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float y\n"
            f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    path.write_bytes(head.encode() + vertices.astype("<f4").tobytes() + rows.tobytes())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default="build/release/bin/bench_aircraft_bytes")
    program = parser.parse_args().program
    subprocess.run([program], check=True)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([program, "write", str(EDGE), folder / "even.ply"], check=True)
        vertices, faces = read(folder / "even.ply")
        files = []
        for target in TARGETS:
            vertices, faces = fast_simplification.simplify(vertices, faces, target_count=target, agg=5)
            files.append(folder / f"thinned out to {target}.ply")
            write(files[-1], vertices, faces)
        print()
        subprocess.run([program, "compare", *files], check=True)


if __name__ == "__main__":
    main()
