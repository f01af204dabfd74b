"""Tables by the Python package: tolerances, the head's place, gradients of PyTorch, measured fields."""

import os
import pathlib
import re

import h5py
import numpy
from work import ROOT

try:
    import touchfield
except ImportError:  # then no table is made; the parts of tests that need none can be read
    touchfield = None

WIDTH_8MM = ROOT / "scenes/width_8mm.yaml"


def robust(_, draws=30):
    """The misfit, sqrt(cost / cost of silence), of plain `surface` and of `surface` with `tolerances`, over arrays that are drawn after the
    phases are found. `known` has phases found for each array without its dead channels."""
    problem = touchfield.Problem.of_model(touchfield.Model(str(WIDTH_8MM)))
    plain, count = touchfield.surface(problem), problem.target.shape[1]
    silence = problem.cost(numpy.zeros(count))

    def misfit(drives_of, phase, gain, dead):
        generator, costs = numpy.random.default_rng(5), []
        for _ in range(draws):
            gains = (1 + gain * generator.standard_normal(count)) * (generator.random(count) >= dead)
            factors = gains * numpy.exp(1j * phase * generator.standard_normal(count))
            costs.append(problem.cost(drives_of(factors) * factors))
        return (numpy.mean(costs) / silence) ** 0.5

    for phase_deg, gain_percent, dead_percent in ((10, 5, 0), (20, 10, 0), (30, 15, 0), (40, 20, 0), (20, 10, 2), (0, 0, 5)):
        tolerances = {"phase": numpy.radians(phase_deg), "gain": gain_percent / 100, "dead": dead_percent / 100}
        found = touchfield.surface(problem, tolerances=tolerances)

        def without_dead(factors):
            alive = factors != 0
            rest = touchfield.Problem(problem.target[:, alive], problem.amplitudes, problem.weights, problem.outside[:, alive])
            drives = numpy.zeros(count, complex)
            drives[alive] = touchfield.surface(rest, tolerances=tolerances | {"dead": 0}).drives
            return drives

        yield {"phase_deg": phase_deg, "gain_percent": gain_percent, "dead_percent": dead_percent,
               "plain": f"{misfit(lambda _: plain.drives, **tolerances):.4f}", "robust": f"{misfit(lambda _: found.drives, **tolerances):.4f}",
               "known": f"{misfit(without_dead, **tolerances):.4f}" if dead_percent else "", "bound": f"{(found.cost_history[-1] / silence) ** 0.5:.4f}",
               "designed": f"{(problem.cost(found.drives) / silence) ** 0.5:.4f}", "level": f"{found.amplitudes[0]:.3f}"}


def head(_, points=200):
    """Levels of `surface` over a sphere of 90 mm radius, 500 mm above the array and 500 mm behind its middle, on the side of the arm. It is
    not in the scene: the field is that without it."""
    number = numpy.arange(points)
    z, angle = 1 - (2 * number + 1) / points, number * numpy.pi * (3 - 5**0.5)
    across = numpy.sqrt(1 - z**2)
    places = numpy.array([0, -0.5, 0.5]) + 0.09 * numpy.column_stack([across * numpy.cos(angle), across * numpy.sin(angle), z])
    for name in ("quick", "width_5mm", "width_8mm", "width_11mm", "penetration", "grasp", "path"):
        run = touchfield.run(str(ROOT / f"scenes/{name}.yaml"), set={"solve.methods": ["surface"], "field": []})
        pressure = abs(run.field(places)["surface"])
        mean = numpy.sqrt(numpy.mean(pressure**2))
        level, highest = (20 * numpy.log10(amplitude / (2**0.5 * 20e-6)) for amplitude in (mean, pressure.max()))  # dB re 20 uPa, rms
        yield {"scene": name, "mean_pa": f"{mean:.4g}", "mean_db": f"{level:.4g}", "most_db": f"{highest:.4g}",
               "of_target": f"{mean / run.metrics['surface']['mean_inside_pa']:.4g}"}


STEPS = 30


def gradients(_, seeds=10):
    """Own costs by L-BFGS of PyTorch. `phases` is the code of docs/python.md, section Gradients: 30 steps, each of 20 iterations. `short` has
    30 iterations in all, as `surface` has."""
    code, = re.findall(r"```python\n(import torch\n.*?LBFGS.*?)```", (ROOT / "docs/python.md").read_text(encoding="utf-8"), re.DOTALL)
    before, _, after = code.rpartition("print(")[0].partition("torch.manual_seed(0)")
    names, rows = {}, []
    exec(f"import numpy as np, touchfield as tf\n{before}", names)
    model, problem = names["model"], names["problem"]

    def add(way, seed, drives):
        rows.append({"way": way, "seed": seed, "relative_error": touchfield.evaluate(model, drives)["relative_error"]})

    add("surface", "", touchfield.surface(problem, iterations=STEPS).drives)
    short = after.replace("range(30)", "range(1)").replace("phases],", "phases], max_iter=30,")
    for way, text in (("phases", after), ("short", short)):
        for seed in range(seeds):
            exec(f"torch.manual_seed({seed}){text}", names)
            add(way, seed, numpy.exp(1j * names["phases"].detach().numpy()))
    for way in ("phases", "short"):
        own = [row for row in rows if row["way"] == way]
        rows.append({"way": way, "seed": "median", **{key: numpy.median([row[key] for row in own]) for key in list(own[0])[2:]}})
    return rows


# Map of measured_256: its layout, whether that is made by phases of a flat board, quarter turns of the matrix after a mirror image or
# without one, as fit best, and about the side of the scan [m].
MAPS = {"HeightMod_A": ("A", False, 0, False, 0.172), "HeightMod_12": ("12", False, 0, False, 0.175),
        "HeightMod_Star": ("Star", False, 3, False, 0.174), "PhaseMod_12": ("12", True, 0, False, 0.170),
        "PhaseMod_A": ("A", True, 0, True, 0.206)}
FITTED = ["HeightMod_A", "HeightMod_12"]
SIMILARITY = ("place", "turn", "size")


def data_folder():
    """measured_256 (upnalab/usarrayheightmod, MIT): emitters_X.csv and measured_Y_X.csv."""
    return pathlib.Path(os.environ.get("TOUCHFIELD_DATA", ROOT.parent / "shared/data")) / "measured_256"


def scan(data, name):
    """The map as points and values: its rows go along -y, its columns along x."""
    _, _, turns, mirrored, side = MAPS[name]
    values = numpy.loadtxt(data / f"measured_{name}.csv", delimiter=",")
    values = numpy.rot90(values[:, ::-1] if mirrored else values, turns)
    y, x = (numpy.linspace(-side / 2, side / 2, n) for n in values.shape)
    x, y = numpy.meshgrid(x, -y)
    return numpy.stack([x.ravel(), y.ravel(), numpy.full(x.size, 0.16)], axis=1), values.ravel()


def board(data, runs, layout, flat):
    """A run of a board."""
    scene, path = str(ROOT / "scenes/validation/board_256.yaml"), f"{runs}/{layout}.csv"
    emitters = numpy.loadtxt(data / f"emitters_{layout}.csv", delimiter=",")
    if flat:  # a higher emitter is earlier
        numpy.savetxt(path, -2 * numpy.pi * 40e3 / 343.21 * emitters[:, 2], "%.9g")
        return touchfield.run(scene, set={"solve.methods": [{"fixed": {"phases_file": path}}]})
    numpy.savetxt(path, 1e3 * emitters[:, :3], "%.9g", ",", header="x_mm,y_mm,z_mm", comments="")
    return touchfield.run(scene, set={"array.grid": None, "array.positions.file": path})


def measured(data, runs, scored):
    """Two rows per map: those that are fitted, then those that are scored. The place, turn and step of the scans are not published. They are
    fitted to each map, with a microphone of radius 0 and with its radius, which is the mean over the fitted maps for all others."""
    rows, radii, boards = [], [], {}
    for name in [*FITTED, *scored]:
        layout = MAPS[name][:2]
        if layout not in boards:
            boards[layout] = board(data, runs, *layout)
        run, (points, values) = boards[layout], scan(data, name)
        before = touchfield.compare_scan(run, points, values).about_means
        similar = touchfield.fit_scan(run, points, values, SIMILARITY)
        own = name in FITTED
        held, fit = (similar.setting, (*SIMILARITY, "receiver")) if own else ({**similar.setting, "receiver": sum(radii) / len(radii)}, SIMILARITY)
        found = touchfield.fit_scan(run, points, values, fit, start=held)
        radii += [found.setting["receiver"]] if own else []
        for fitted, one in ((",".join(SIMILARITY), similar), (",".join(fit) + ("" if own else "; receiver held"), found)):
            setting = one.setting
            numbers = {"before": before, "correlation": one.about_means, "difference": one.relative}
            numbers |= {f"{key}_mm": 1e3 * setting[key] for key in ("receiver", "x", "y", "z")} | {
                f"r{axis}_deg": numpy.degrees(setting[f"turn_{axis}"]) for axis in "xyz"} | {"size": setting["size"]}
            rows.append({"map": name, "fitted": fitted} | {key: round(float(number), 4) for key, number in numbers.items()})
    return rows


def measured_fields(work):
    return measured(data_folder(), work.runs, [name for name in MAPS if name not in FITTED])
