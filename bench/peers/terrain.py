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
DETAILS = (0.5, 1)               # [pixel]


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
    """Both renderers in turn, run by run; ratios are medians of those of each turn."""
    print(f"{'':36} {'rays s':>8} {'process s':>10} {'cpu s':>8} {'POV / this':>11} {'cpu':>6}")
    for size in sizes:
        cell = WIDTH / (size - 1)
        npy, png = paths.out / f"ground_{size}.npy", paths.out / f"ground_{size}.png"
        ways = {".npy": (npy, ()), **{f".npy, level of detail {x}": (npy, detail(x)) for x in DETAILS}, ".png": (png, ())}
        pov, ours = [], {name: [] for name in ways}
        for _ in range(repeat):
            pov.append(render_pov(paths, scene, size))
            for name, (table, more) in ways.items():
                ours[name].append(render_pileus(paths, table, cell, *more))
        for name, runs in ours.items():
            rays, seconds, cpu = median(runs)
            ratios = median([(peer[0] / run[1], peer[1] / run[2]) for peer, run in zip(pov, runs)])
            print(f"{size:5} pileus, {name:22} {rays:8.3f} {seconds:10.3f} {cpu:8.3f} {ratios[0]:11.1f} {ratios[1]:6.1f}")
        seconds, cpu = median(pov)
        print(f"{size:5} POV-Ray, .png               {'':8} {seconds:10.3f} {cpu:8.3f}", flush=True)
        a = read_channel(paths, paths.out / "ground_pov.exr")
        b = read_channel(paths, paths.out / "ground_pileus.exr")
        print(f"      seen by one only: {((a > 0) != (b > 0)).mean():.2%} of the pixels")


def fitted(x, y):
    """a, b of the line a + b x nearest to y, and how far y is from it, as a share of y."""
    b, a = np.polyfit(x, y, 1)
    return a, b, float(np.max(np.abs(a + b * np.asarray(x) - y) / y))


def curve(paths, repeat, title, points, tell):
    """points: (label, table, cell size, further arguments, what grows); all in turn, run by run. Times are those of
    the rays, the least of the runs. tell(what grows, times) says what kind of curve it is."""
    runs = [[render_pileus(paths, table, cell, *more)[0] for _, table, cell, more, _ in points] for _ in range(repeat)]
    rays = np.min(runs, axis=0)
    print(f"\n{title}")
    for (label, *_), seconds in zip(points, rays):
        print(f"  {label:28} {seconds:8.4f} s   {seconds / rays[0]:6.2f}")
    print("  " + tell(np.array([float(point[-1]) for point in points]), rays), flush=True)


def tell_doubling(x, seconds):
    a, b, off = fitted(np.log2(x / x[0]), seconds)
    return f"{a:.4f} s and {b:+.4f} s for each doubling, within {off:.0%}; from first to last {seconds[-1] / seconds[0]:.2f} times"


def tell_linear(x, seconds):
    _, power, _ = fitted(np.log(x), np.log(seconds))
    return f"as the power {power:.2f} of the number of pixels; {1e9 * seconds[-1] / x[-1]:.0f} ns a pixel in the last"


def curves(paths, sizes, repeat):
    table = lambda size: paths.out / f"ground_{size}.npy"
    cell = lambda size: WIDTH / (size - 1)
    for name, more in (("as it is", ()), *((f"level of detail {x} pixel", detail(x)) for x in DETAILS)):
        points = [(f"{size} x {size}", table(size), cell(size), more, size) for size in sizes]
        curve(paths, repeat, f"table, equal framing, {name}", points, tell_doubling)
    pictures = [(320, 180), (640, 360), (1280, 720), (2560, 1440)]
    curve(paths, repeat, "pixels, 2048 x 2048",
          [(f"{x}x{y}", table(2048), cell(2048), ("--size", f"{x}x{y}"), x * y) for x, y in pictures], tell_linear)
    # Ever deeper ground with the same cells in front of the same camera, at its southern edge.
    deep = []
    for size in sizes:
        edge = 0.5 * (size - 1) * 2.0
        place = ("--set", f"camera.position=[0, 1600, {edge}]", "--set", f"camera.look_at=[0, 1400, {edge - 1000}]")
        deep.append((f"{2 * (size - 1)} m of cells of 2 m", table(size), 2.0, place, size))
    curve(paths, repeat, "depth", deep, tell_doubling)


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
