"""Errors of pictures, times at equal error, and the tables that show them."""
import math
from dataclasses import dataclass, field
from statistics import median

import numpy as np

TARGETS = (0.01, 0.002)


class Truth:
    def __init__(self, pixels, inside):
        self.pixels, self.inside = pixels, inside
        self.mean = float(pixels[inside].mean())

    def relative_rmse(self, pixels):
        """Root mean square error over the cloud's pixels, in units of the truth's mean over them."""
        difference = (pixels - self.pixels)[self.inside]
        return float(np.sqrt(np.mean(difference**2))) / self.mean

    def best_scale(self, pixels):
        """The factor that brings a picture nearest to the truth: far from 1, its scene is another."""
        a, t = pixels[self.inside], self.pixels[self.inside]
        power = float((a * a).sum())
        return float((a * t).sum()) / power if power > 0 else math.nan


@dataclass
class Row:
    """One renderer with one setting, over all repeats."""
    renderer: str
    setting: str
    error: float = math.nan
    scale: float = math.nan
    scaled_error: float = math.nan
    render: list = field(default_factory=list)   # [s]; empty where the program does not tell
    process: list = field(default_factory=list)  # [s]
    cpu: list = field(default_factory=list)      # [s]
    note: str = ""

    def add(self, picture, truth):
        if not self.process:
            self.error = truth.relative_rmse(picture.pixels)
            self.scale = truth.best_scale(picture.pixels)
            self.scaled_error = truth.relative_rmse(self.scale * picture.pixels)
        if picture.render_seconds is not None:
            self.render.append(picture.render_seconds)
        self.process.append(picture.process_seconds)
        self.cpu.append(picture.cpu_seconds)

    @property
    def seconds(self):
        """Building and rendering where the program tells, else its whole run."""
        return median(self.render or self.process)

    def as_dict(self):
        """For JSON, which has no NaN."""
        figures = dict(vars(self), seconds=self.seconds if self.process else math.nan)
        return {key: or_none(value) for key, value in figures.items()}


def or_none(value):
    return None if isinstance(value, float) and not math.isfinite(value) else value


def time_at(rows, target):
    """Seconds that a renderer needs for an error: (bound, seconds), interpolated between its best settings on a
    log-log scale. bound is "" for a time between two settings, "<=" where the coarsest is better already, ">" where
    no setting gets there."""
    front = []  # faster settings first, each better than all before
    for row in sorted((row for row in rows if row.process and row.error > 0), key=lambda row: row.seconds):
        if not front or row.error < front[-1].error:
            front.append(row)
    if not front:
        return "", math.nan
    if front[0].error <= target:
        return "<=", front[0].seconds
    for coarse, fine in zip(front, front[1:]):
        if fine.error <= target:
            share = math.log(coarse.error / target) / math.log(coarse.error / fine.error)
            return "", coarse.seconds * (fine.seconds / coarse.seconds) ** share
    return ">", front[-1].seconds


def by_renderer(rows):
    groups = {}
    for row in rows:
        groups.setdefault(row.renderer, []).append(row)
    return groups


def summary(rows, reference):
    """Per renderer and target the time, and how many times faster than the reference it is."""
    groups = by_renderer(rows)
    result = []
    for target in TARGETS:
        reference_bound, reference_seconds = time_at(groups.get(reference, []), target)
        for renderer, group in groups.items():
            bound, seconds = time_at(group, target)
            factor = math.nan if ">" in (bound, reference_bound) else reference_seconds / seconds
            is_exact = bound == "" and reference_bound == ""
            result.append(dict(target=target, renderer=renderer, bound=bound, seconds=or_none(seconds),
                               factor=or_none(factor), factor_is_exact=is_exact))
    return result


def print_rows(rows):
    print(f"{'renderer':<16} {'setting':<26} {'render s':>9} {'process s':>10} {'cpu s':>8} {'rel. RMSE':>10} "
          f"{'best scale':>10} {'then':>9}")
    for row in (row for group in by_renderer(rows).values() for row in group):
        if not row.process:
            print(f"{row.renderer:<16} {row.setting:<26} {row.note}")
            continue
        render = f"{median(row.render):9.3f}" if row.render else f"{'-':>9}"
        print(f"{row.renderer:<16} {row.setting:<26} {render} {median(row.process):10.3f} {median(row.cpu):8.2f} "
              f"{row.error:10.3%} {row.scale:10.4f} {row.scaled_error:9.3%} {row.note}")


def print_summary(entries, reference):
    for target in TARGETS:
        print(f"\nat a relative RMSE of {target:.1%}")
        for entry in entries:
            if entry["target"] != target or entry["seconds"] is None:
                continue
            time = f"{entry['bound']} {entry['seconds']:.3f} s".strip()
            about = "" if entry["factor_is_exact"] else "about "
            factor = f"{about}{entry['factor']:.3g} x the speed of the {reference}" if entry["factor"] else ""
            print(f"  {entry['renderer']:<16} {time:>14}  {factor}".rstrip())
