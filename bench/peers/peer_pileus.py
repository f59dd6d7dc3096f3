"""pileus itself, with an integrator of its own choice: the seconds are those of building and rendering."""
import json

from common import Picture, read_channel, run


class Pileus:
    def __init__(self, integrator):
        self.integrator = integrator
        self.NAME = f"pileus {integrator}"

    def check(self, paths):
        paths.program("pileus")

    def ladder(self, quick):
        """Tolerances, from coarse to fine."""
        if self.integrator == "exact":
            return [0.1] if quick else [0.1, 0.01]
        return [0.05, 0.03, 0.01, 0.006, 0.002] if quick else [0.2, 0.1, 0.05, 0.03, 0.02, 0.01, 0.006, 0.004, 0.002, 0.001, 0.0005]

    def label(self, setting):
        return f"tolerance {setting:g}"

    def render(self, paths, scene, setting, limit):
        name = self.integrator
        picture, report = paths.out / f"pileus_{name}.exr", paths.out / f"pileus_{name}.json"
        seconds, cpu, _ = run([paths.program("pileus"), "render", paths.scene, "-o", picture, "--quiet",
                               "--integrator", name, "--tolerance", setting, "--threads", "2",
                               "--report", report], limit)
        stages = json.loads(report.read_text())["seconds"]
        return Picture(read_channel(paths, picture), stages["build"] + stages["render"], seconds, cpu)


def has_integrator(paths, name):
    plugins = run([paths.program("pileus"), "plugins"])[2]
    return any(line.split()[:1] == [name] for line in plugins.splitlines())
