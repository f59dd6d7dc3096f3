"""A terrain in pileus and as a height_field in POV-Ray: time of the picture, and how it grows with table, pixels and depth.

Both read the same 16-bit heights, use two threads, one ray per pixel and shadows of one sun. Tables of different sizes
are the same ground: the smaller ones are means of the largest.
"""
import argparse
import json
import shutil
import struct
import tomllib
import zlib
from pathlib import Path

import numpy as np

from common import HERE, ROOT, Paths, Scene, camera_frame, read_channel, run

SCENE = HERE / "ground.toml"
WIDTH, HIGHEST = 10000.0, 60000  # [m], and the highest number of a table
DETAIL = 0.5                     # [pixel]


class Ground(Scene):
    def __init__(self, file):
        toml = tomllib.loads(Path(file).read_text())
        self.width, self.height = toml["render"]["size"]
        camera = toml["camera"]
        self.position, self.look_at, self.fov_deg = camera["position"], camera["look_at"], camera["fov_deg"]
        self.sun = toml["light"]["sun"]["direction"]
        self.metres = toml["object"]["ground"]["scale"][1]
        self.diffuse = toml["object"]["ground"]["shader"]["diffuse"][0]


def doubled(a, axis):
    """Twice the samples along an axis, by quadratic B-splines."""
    a = np.moveaxis(a, axis, 0)
    before, after = np.concatenate([a[:1], a[:-1]]), np.concatenate([a[1:], a[-1:]])
    both = np.stack([0.75 * a + 0.25 * before, 0.75 * a + 0.25 * after], axis=1)
    return np.moveaxis(both.reshape(2 * a.shape[0], a.shape[1]), 0, axis)


def heights(size):
    """Noise in octaves, each of half the width and about half the height."""
    rng = np.random.default_rng(5)
    a, amplitude = rng.uniform(-1, 1, (8, 8)).astype(np.float32), 1.0
    while a.shape[0] < size:
        a, amplitude = doubled(doubled(a, 0), 1), 0.52 * amplitude
        a += np.float32(amplitude) * rng.uniform(-1, 1, a.shape).astype(np.float32)
    return (a - a.min()) / (a.max() - a.min())


def write_png(file, grey):
    rows = np.ascontiguousarray(grey.astype(">u2")).view(np.uint8)
    above = np.vstack([np.zeros((1, rows.shape[1]), np.uint8), rows[:-1]])
    filtered = np.hstack([np.full((rows.shape[0], 1), 2, np.uint8), rows - above])

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    with open(file, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", *grey.shape[::-1], 16, 0, 0, 0, 0)))
        out.write(chunk(b"IDAT", zlib.compress(filtered.tobytes(), 6)) + chunk(b"IEND", b""))


def make_tables(out, sizes):
    """ground_SIZE.npy, and .png for POV-Ray; kept from run to run."""
    missing = [size for size in sizes if not (out / f"ground_{size}.npy").is_file()]
    if not missing:
        return
    finest = heights(8192)
    for size in missing:
        step = 8192 // size
        grey = np.rint(HIGHEST * finest.reshape(size, step, size, step).mean((1, 3))).astype(np.uint16)
        if size <= 4096:
            write_png(out / f"ground_{size}.png", grey)
        np.save(out / f"ground_{size}.npy", grey)


def vector(v):
    return "<" + ", ".join(f"{x:.12g}" for x in v) + ">"


def pov_text(scene, size):
    """POV-Ray's height_field fills a unit cube, left-handed here: z is turned round."""
    right, up, backward = (axis * [1, 1, -1] for axis in camera_frame(scene))
    tan_half = np.tan(np.radians(scene.fov_deg / 2))
    sun = np.array(scene.sun) * [1, 1, -1] / np.linalg.norm(scene.sun)
    return f"""
#version 3.7;
global_settings {{ assumed_gamma 1 }}
background {{ rgb 0 }}
camera {{
  perspective location {vector(np.array(scene.position) * [1, 1, -1])} direction {vector(-backward)}
  right {vector(2 * tan_half * right)} up {vector(2 * tan_half * scene.height / scene.width * up)}
}}
light_source {{ {vector(1e5 * sun)}, rgb 1 parallel point_at <0, 0, 0> }}
height_field {{
  png "ground_{size}.png" gamma 1.0
  translate <-0.5, 0, -0.5> scale <{WIDTH:g}, {65535 * scene.metres:.12g}, {WIDTH:g}>
  pigment {{ rgb 1 }} finish {{ ambient 0 diffuse {scene.diffuse} }}
}}
"""


def render_pov(paths, scene, size):
    (paths.out / "ground.pov").write_text(pov_text(scene, size))
    seconds, cpu, _ = run(["povray", "ground.pov", "+Oground_pov.exr", "+FE", f"+W{scene.width}", f"+H{scene.height}",
                           "-A", "-D", "+WT2", "-GA"], folder=paths.out)
    return seconds, cpu


def render_pileus(paths, table, cell, *more):
    """Seconds that the rays took, of the process, and of the processor."""
    picture, report = paths.out / "ground_pileus.exr", paths.out / "ground.json"
    seconds, cpu, _ = run([paths.program("pileus"), "render", SCENE, "-o", picture, "--quiet", "--threads", "2", "--report",
                           report, "--set", f'object.ground.file="{table.resolve()}"', "--set",
                           f"object.ground.cell_size={cell!r}", *more])
    return json.loads(report.read_text())["seconds"]["trace"], seconds, cpu


def median(runs):
    return [float(np.median(column)) for column in zip(*runs)]


def detail(pixels):
    return ("--set", f"object.ground.level_of_detail={pixels}")


def compare(paths, scene, sizes, repeat):
    print(f"{'':36} {'rays s':>8} {'process s':>10} {'cpu s':>8} {'POV / this':>11} {'cpu':>6}")
    for size in sizes:
        cell = WIDTH / (size - 1)
        npy, png = paths.out / f"ground_{size}.npy", paths.out / f"ground_{size}.png"
        ways = [(".npy", npy, ()), (f".npy, level of detail {DETAIL}", npy, detail(DETAIL)), (".png", png, ())]
        ours = [(name, median([render_pileus(paths, table, cell, *more) for _ in range(repeat)]))
                for name, table, more in ways]
        pov = median([render_pov(paths, scene, size) for _ in range(repeat)])
        for name, (rays, seconds, cpu) in ours:
            print(f"{size:5} pileus, {name:22} {rays:8.3f} {seconds:10.3f} {cpu:8.3f} {pov[0] / seconds:11.1f} {pov[1] / cpu:6.1f}")
        print(f"{size:5} POV-Ray, .png               {'':8} {pov[0]:10.3f} {pov[1]:8.3f}")
        a = read_channel(paths, paths.out / "ground_pov.exr")
        b = read_channel(paths, paths.out / "ground_pileus.exr")
        print(f"      seen by one only: {((a > 0) != (b > 0)).mean():.2%} of the pixels")


def curve(paths, repeat, title, points):
    """points: (label, table, cell size, further arguments); times are those of the rays, the least of the runs."""
    print(f"\n{title}")
    first = None
    for label, table, cell, more in points:
        rays = min(render_pileus(paths, table, cell, *more)[0] for _ in range(repeat))
        first = first or rays
        print(f"  {label:28} {rays:8.4f} s   {rays / first:6.2f}", flush=True)


def curves(paths, sizes, repeat):
    table = lambda size: paths.out / f"ground_{size}.npy"
    cell = lambda size: WIDTH / (size - 1)
    for name, more in (("as it is", ()), (f"level of detail {DETAIL} pixel", detail(DETAIL))):
        curve(paths, repeat, f"table, equal framing, {name}", [(f"{size} x {size}", table(size), cell(size), more) for size in sizes])
    pictures = ["320x180", "640x360", "1280x720", "2560x1440"]
    curve(paths, repeat, "pixels, 2048 x 2048", [(p, table(2048), cell(2048), ("--size", p)) for p in pictures])
    # Ever deeper ground with the same cells in front of the same camera, at its southern edge.
    deep = []
    for size in sizes:
        edge = 0.5 * (size - 1) * 2.0
        place = ("--set", f"camera.position=[0, 1600, {edge}]", "--set", f"camera.look_at=[0, 1400, {edge - 1000}]")
        deep.append((f"{2 * (size - 1)} m of cells of 2 m", table(size), 2.0, place))
    curve(paths, repeat, "depth", deep)


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--bin", type=Path, default=ROOT / "build/release/bin")
    options.add_argument("--out", type=Path, default=ROOT / "build/bench")
    options.add_argument("--sizes", type=int, nargs="+", default=[1024, 2048, 4096, 8192])
    options.add_argument("--part", choices=["all", "tables", "peer", "curves"], default="all")
    options.add_argument("--repeat", type=int, default=5)
    args = options.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    paths, scene = Paths(args.bin, args.out), Ground(SCENE)

    make_tables(args.out, args.sizes)
    if args.part in ("all", "peer"):
        if shutil.which("povray"):
            compare(paths, scene, [size for size in args.sizes if size in (1024, 4096)], args.repeat)
        else:
            print("POV-Ray is not installed: Debian package povray")
    if args.part in ("all", "curves"):
        curves(paths, args.sizes, args.repeat)


if __name__ == "__main__":
    main()
