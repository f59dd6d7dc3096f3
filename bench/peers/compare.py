#!/usr/bin/env python3
"""Compares pileus with other renderers at equal error, on the common scene; bench/README.md explains the numbers.

Needs Python 3.11 and NumPy. Peers that are not installed are skipped by name.
"""
import argparse
import hashlib
import json
import os
import platform
import shutil
import sys
import time
from pathlib import Path

import numpy as np

import peer_cycles
import peer_mitsuba
import peer_openvdb
import peer_plain
import peer_povray
from common import HERE, ROOT, Paths, Scene, Skip, TooSlow, read_channel, run
from peer_pileus import Pileus, has_integrator
from results import Row, Truth, print_rows, print_summary, summary

PEERS = {"openvdb": peer_openvdb, "cycles": peer_cycles, "povray": peer_povray, "mitsuba": peer_mitsuba}
TRUTH_TOLERANCE = 1e-5
LONG = 20.0  # [s] a run this long is not repeated


def say(text):
    print(f"== {text}", flush=True)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--bin", type=Path, default=ROOT / "build/release/bin", help="folder of the programs")
    parser.add_argument("--out", type=Path, default=ROOT / "build/bench/peers", help="folder for what is made")
    parser.add_argument("--quick", action="store_true", help="few and coarse settings")
    parser.add_argument("--integrator", action="append", metavar="NAME",
                        help="of pileus; may repeat (default: march, or exact where there is no march)")
    parser.add_argument("--peers", default=",".join(PEERS), metavar="LIST",
                        help=f"which of {', '.join(PEERS)}; '' for none (default: all)")
    parser.add_argument("--repeats", type=int, help="of short runs, in turn (default: 5; 3 with --quick)")
    parser.add_argument("--limit", type=float, default=120, metavar="S", help="per run of a peer (default: 120)")
    parser.add_argument("--no-check", action="store_true", help="believe the truth without a second opinion")
    parser.add_argument("--fresh", action="store_true", help="render the truth anew")
    parser.add_argument("--json", type=Path, metavar="FILE", help="(default: OUT/results.json)")
    options = parser.parse_args()
    options.repeats = options.repeats or (3 if options.quick else 5)
    unknown = set(filter(None, options.peers.split(","))) - set(PEERS)
    if unknown:
        parser.error(f"--peers: unknown {', '.join(sorted(unknown))}; expected some of {', '.join(PEERS)}")
    return options


def prepare(paths, fresh):
    """Builds the cloud and puts the scene beside it. Returns a key that changes when either does."""
    paths.out.mkdir(parents=True, exist_ok=True)
    recipe = HERE / "cloud.toml"
    if fresh or not paths.cloud.is_file() or paths.cloud.stat().st_mtime < recipe.stat().st_mtime:
        say("building the cloud")
        run([paths.program("pileus"), "cloud", recipe, "-o", paths.cloud, "--quiet"])
    shutil.copyfile(HERE / "scene.toml", paths.scene)
    return hashlib.sha256(paths.scene.read_bytes() + paths.cloud.read_bytes()).hexdigest()


def cached(file, key, make):
    """Makes a file, unless the one that is there was made from the same."""
    note = file.with_suffix(".key")
    if not file.is_file() or not note.is_file() or note.read_text() != key:
        note.unlink(missing_ok=True)
        make()
        note.write_text(key)


def render_truth(paths, key):
    picture = paths.out / "truth.exr"

    def render():
        say(f"rendering the truth (exact, tolerance {TRUTH_TOLERANCE:g}); kept for later runs")
        run([paths.program("pileus"), "render", paths.scene, "-o", picture, "--integrator", "exact", "--quiet",
             "--tolerance", TRUTH_TOLERANCE, "--aov", "beauty,transmittance,error_estimate"])

    cached(picture, key, render)
    transmittance = read_channel(paths, picture, "transmittance")
    truth = Truth(read_channel(paths, picture), read_channel(paths, picture, "A") > 0)
    facts = dict(mean=truth.mean, max=float(truth.pixels.max()), coverage=float(truth.inside.mean()),
                 max_optical_depth=float(-np.log(transmittance.min())))
    print(f"truth: {facts['coverage']:.1%} of the pixels see the cloud, at a mean radiance of {facts['mean']:.3f}; "
          f"optical depth up to {facts['max_optical_depth']:.1f}")
    return truth, facts


def second_opinion(paths, scene, truth, key, quick):
    """How far the truth lies from a brute-force marcher of tiny steps in double precision. Coarser steps say whether
    the distance is the marcher's own: of second order, each halving of the step leaves a quarter."""
    steps = [2, 1, 0.5] if quick else [1, 0.5, 0.25, 0.125]
    distances = {}
    for step in steps:
        file = paths.out / f"check_{step:g}.npy"

        def march():
            say(f"checking the truth (plain marcher, double, steps of {step:g} voxel); kept for later runs")
            picture = peer_plain.render(paths, scene, step, None, ["--double", "--stop", "1e-9"])
            np.save(file, picture.pixels)

        cached(file, key, march)
        distances[step] = truth.relative_rmse(np.load(file))
    print("truth against the plain marcher in double precision, relative RMSE by step in voxels: " +
          ", ".join(f"{step:g}: {distance:.2e}" for step, distance in distances.items()))
    return distances


def measure(renderers, paths, scene, truth, options):
    """All renderers in turn, setting by setting, round by round: a drift of the machine's speed meets them all."""
    rows = {}
    for repeat in range(options.repeats):
        ladders = [[(renderer, setting) for setting in renderer.ladder(options.quick)] for renderer in renderers]
        for step in range(max(map(len, ladders), default=0)):
            for renderer, setting in (ladder[step] for ladder in ladders if step < len(ladder)):
                row = rows.setdefault((renderer.NAME, renderer.label(setting)),
                                      Row(renderer.NAME, renderer.label(setting)))
                if repeat > 0 and (not row.process or row.process[0] > LONG):
                    continue
                try:
                    row.add(renderer.render(paths, scene, setting, options.limit), truth)
                except TooSlow as slow:
                    row.note = str(slow)
    return list(rows.values())


def measure_peer(peer, paths, scene, truth, options):
    rows = []
    for setting in peer.ladder(options.quick):
        row = Row(peer.NAME, peer.label(setting))
        rows.append(row)
        try:
            row.add(peer.render(paths, scene, setting, options.limit), truth)
        except TooSlow as slow:
            row.note = str(slow)
            break  # finer settings take longer
        except RuntimeError as failure:
            row.note = "failed: " + str(failure).strip().splitlines()[-1]
            break
    return rows


def processor():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()


def main():
    options = arguments()
    paths = Paths(options.bin.resolve(), options.out.resolve())
    load = os.getloadavg()[0]
    if load > 0.5:
        print(f"compare.py: warning: other programs are running (load {load:.1f}); times will be too long",
              file=sys.stderr)
    key = prepare(paths, options.fresh)
    scene = Scene(paths.scene)
    truth, facts = render_truth(paths, key + options.fresh * str(time.time()))
    distances = {} if options.no_check else second_opinion(paths, scene, truth, key, options.quick)

    integrators = options.integrator or ["march" if has_integrator(paths, "march") else "exact"]
    say(f"pileus ({', '.join(integrators)}) and the plain marcher, in turn, {options.repeats} times")
    rows = measure([*map(Pileus, integrators), peer_plain], paths, scene, truth, options)
    for name in filter(None, options.peers.split(",")):
        try:
            PEERS[name].check(paths)
        except Skip as skip:
            print(f"{PEERS[name].NAME}: skipped: {skip}")
            continue
        say(PEERS[name].NAME)
        rows += measure_peer(PEERS[name], paths, scene, truth, options)

    entries = summary(rows, peer_plain.NAME)
    print()
    print_rows(rows)
    print_summary(entries, peer_plain.NAME)
    file = options.json or paths.out / "results.json"
    file.write_text(json.dumps(dict(
        machine=dict(processor=processor(), cores=os.cpu_count(), load_before=load), scene=scene.as_dict(),
        truth=dict(facts, tolerance=TRUTH_TOLERANCE, check=distances), rows=[row.as_dict() for row in rows],
        summary=entries), indent=2))
    print(f"\n{file}: all of it as JSON")


if __name__ == "__main__":
    main()
