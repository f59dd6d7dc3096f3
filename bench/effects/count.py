#!/usr/bin/env python3
"""Counts what effects cost where they are off, in instructions: the same scene, which does without the effect, rendered
by the normal program and by one that has the effect's code compiled out. The ratio should be 1.

Needs valgrind. Instructions are counted by callgrind inside pileus::render() alone, on one thread: reading the scene
and writing the picture do not count. "render" is a whole picture less a picture of one pixel, which leaves what is
spent per pixel; "all" is the whole picture with everything built for it.
"""
import argparse
import json
import os
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
ENTRY = "pileus::render(pileus::Scene const&, pileus::RenderOptions const&)"

# Effect -> a scene that does without it, and options of `pileus render`. The build without an effect defines
# PILEUS_WITHOUT_<EFFECT>.
EFFECTS = {
    "SHADOWS": ("unlit.toml", []),
    "PHASE": ("plain.toml", []),
    "EMISSION": ("plain.toml", []),
    "SEVERAL_MEDIA": ("plain.toml", []),
    # So close that a pixel is smaller than a voxel.
    "LEVEL_OF_DETAIL": ("plain.toml", ["--set", "camera.fov_deg=3"]),
    "AOVS": ("plain.toml", ["--aov", "beauty"]),
}


def say(text):
    print(f"== {text}", file=sys.stderr, flush=True)


def run(command, **keywords):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **keywords)
    if done.returncode != 0:
        raise SystemExit(f"count.py: {' '.join(map(str, command))} failed:\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    return done


def build(effect, jobs):
    """The program without an effect, in a build folder of its own; "" for the normal one."""
    folder = ROOT / "build" / (f"without-{effect.lower().replace('_', '-')}" if effect else "release")
    say(f"building {folder.relative_to(ROOT)}")
    # The folder's name is no reason for ccache to compile a file again.
    environment = dict({"CCACHE_BASEDIR": str(ROOT), "CCACHE_NOHASHDIR": "1"}, **os.environ)
    # Nor is an effect's macro where the file's text does not change with it; a precompiled header would hide that.
    options = [f"-DPILEUS_WITHOUT={effect}", "-DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON",
               "-DPILEUS_BUILD_TESTS=OFF", "-DPILEUS_BUILD_SAMPLES=OFF"] if effect else []
    run(["cmake", "--preset", "release", "-B", folder, *options], cwd=ROOT, env=environment)
    run(["cmake", "--build", folder, "--target", "pileus_cli", "-j", jobs], cwd=ROOT, env=environment)
    return folder / "bin" / "pileus"


def library(program):
    return (program.parent.parent / "lib" / "libpileus.so").read_bytes()


def on_one_core():
    """One thread in all, whatever a library thinks of cores: which thread does what is then no matter of chance."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def instructions(program, scene, options, out):
    """Instructions inside pileus::render()."""
    log = run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={out / 'callgrind.out'}",
               f"--toggle-collect={ENTRY}", program, "render", scene, "-o", out / "picture.exr", "--quiet",
               "--threads", "1", *options], preexec_fn=on_one_core).stderr
    collected = re.search(r"Collected : (\d+)", log)
    if not collected or int(collected[1]) == 0:
        raise SystemExit(f"count.py: callgrind saw no call of {ENTRY}:\n{log[-2000:]}")
    return int(collected[1])


def count(program, scene, options, out):
    """(whole picture, whole picture less one pixel)."""
    whole = instructions(program, scene, options, out)
    return whole, whole - instructions(program, scene, [*options, "--crop", "0,0,1,1"], out)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("effects", nargs="*", metavar="EFFECT",
                        help=f"of {', '.join(EFFECTS)} (default: all), or NONE: the normal program against itself")
    parser.add_argument("--integrator", default="march")
    parser.add_argument("--limit", type=float, default=1.02, help="largest ratio to accept (default: 1.02)")
    parser.add_argument("--render-option", action="append", default=[], metavar="OPTION",
                        help="one more word for every `pileus render`; may repeat")
    parser.add_argument("--out", type=Path, default=ROOT / "build/bench/effects", help="folder for what is made")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="of the builds")
    arguments = parser.parse_args()
    effects = arguments.effects or list(EFFECTS)
    unknown = set(effects) - set(EFFECTS) - {"NONE"}
    if unknown:
        parser.error(f"unknown {', '.join(sorted(unknown))}; expected {', '.join(EFFECTS)} or NONE")

    out = arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    normal = build("", arguments.jobs)
    run([normal, "cloud", ROOT / "bench/peers/cloud.toml", "-o", out / "cloud.vdb", "--voxel-size", "0.03", "--quiet"])

    rows, counted = [], {}
    for effect in effects:
        name, options = EFFECTS.get(effect, ("plain.toml", []))
        options = ["--integrator", arguments.integrator, *options, *arguments.render_option]
        scene = out / name
        scene.write_text((HERE / name).read_text())
        without = normal if effect == "NONE" else build(effect, arguments.jobs)
        is_same = effect != "NONE" and library(normal) == library(without)
        say(f"counting {effect}")
        case = (name, *options)
        if case not in counted:
            counted[case] = count(normal, scene, options, out)
        here, there = counted[case], count(without, scene, options, out)
        rows.append(dict(effect=effect, scene=name, render=here[1], render_without=there[1],
                         ratio=here[1] / there[1], ratio_all=here[0] / there[0],
                         note="nothing was compiled out" if is_same else ""))

    print(f"{'effect':<16} {'scene':<12} {'instructions':>14} {'without':>14} {'render':>9} {'all':>9}")
    for row in rows:
        note = row["note"] or ("" if row["ratio"] <= arguments.limit else "too much")
        print(f"{row['effect']:<16} {row['scene']:<12} {row['render']:>14,} {row['render_without']:>14,} "
              f"{row['ratio']:>9.5f} {row['ratio_all']:>9.5f}  {note}".rstrip())
    (out / "count.json").write_text(json.dumps(rows, indent=2))
    return 0 if all(row["ratio"] <= arguments.limit and not row["note"] for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
