"""Tables of what is measured elsewhere: printed by tests and benchmarks, timed on graphics cards and on the wall clock."""

import json
import math
import os
import re
import subprocess
import sys
import time

from runs import STYLES, table
from spheres import SCHEMES, solved
from work import ON_TWO_CORES, ROOT, flat, listed, sets

# Rows stand in the tables in this order.
HARD = {"hard_resonance_test": ["HardResonance.SpheresAtAndNearFictitiousFrequencies", "HardResonanceOfAHand.Paper",
                                "HardResonanceOfAHand.Polished", "HardResonance.FingerSweepAcrossAFictitiousFrequency"],
        "hard_geometry_test": [f"HardGeometry.{name}" for name in ("SpheresAtNarrowGaps", "FingersAtNarrowGaps", "ThinPlate", "TubeClosedAtOneEnd")],
        "hard_mesh_test": [f"HardMesh.{name}" for name in ("Slivers", "EdgesOfVeryDifferentSizes", "SinglePrecisionOnTheWorstConditioned")],
        "hard_wave_test": ["HardWave.CoarseMeshesAndShadow", "HardWaveOfAHand.IndexUp", "HardWaveOfAHand.Fist",
                           "HardWave.SourceNearTheSkin", "HardWave.OtherFrequencies"],
        "bem_test": ["Quadrature.CoplanarNeighbours", "Quadrature.NeighboursRoundASharedEdge", "Quadrature.PointsOffAFace",
                     "SelfIntegrals.AgainstTheSlopeOfTheSolidAngleAndTanhSinh"]}


def printed(log):
    """(table, row) of the lines `[TABLE] {"column": "cell", ..}` that a test prints."""
    return [(name, {key: f"{int(cell):,}" if cell.isdigit() else cell for key, cell in json.loads(row).items()})
            for name, row in re.findall(r"^\[(\w+)\] (\{.*\})$", log, re.MULTILINE)]


def hard(work, small=False):
    """Every test at full size, or at small size where it has one. A test that fails ends the entry."""
    size, tables = "Small/{}/small" if small else "Full/{}/full", {}
    for program, names in HARD.items():
        for name in names:
            if small and "OfAHand." in name:
                continue
            test = name if program == "bem_test" else size.format(name)
            log = work.call(work.build / "tests" / program, f"--gtest_filter={test}")
            if f"[       OK ] {test}" not in log:
                raise RuntimeError(f"{program} has no test {test}")
            for table_name, row in printed(log):
                tables.setdefault(table_name, []).append(row)
    return tables


SPHERE_KA = 25
HEIGHTS = [150 + 10 * i for i in range(20)]


def card_runs(work):
    """A sphere, and a sweep of heights, on the card and on two cores. Of the sweep the processor computes the first three heights. The second
    and third, which reuse the first one's matrices, give the time of the others."""
    from meshes import icosphere, write_ply
    from sphere_series import K, plane_wave_errors

    def row(name, count, card, processor, off):
        return {"work": name, "faces": count, "card_s": f"{card:.3g}", "processor_s": f"{processor:.3g}", "ratio": f"{processor / card:.1f}", "off": f"{off:.2g}"}

    write_ply(work.runs / "sphere.ply", *icosphere(5, SPHERE_KA / K * 1e3))
    seconds, cases = {}, {}
    for device, heights in (("cpu", HEIGHTS[:3]), ("cuda", HEIGHTS)):
        how = ON_TWO_CORES if device == "cpu" else {}
        with solved(work, "body: {mesh: {file: sphere.ply, unit: mm}}", SCHEMES[4:], options=("--device", device), **how)[1] as run:
            seconds[device] = math.fsum(run["solves/seconds"][:])
            faces, off = len(run["mesh/area"]), plane_wave_errors(run, SPHERE_KA / K, SCHEMES[4:])[SCHEMES[4]]
        sweep = work.runs / f"heights_{device}.yaml"
        sweep.write_text(f"base: {ROOT / 'scenes/width_8mm.yaml'}\nname: heights\n"
                         f"set: {{solve.methods: [surface], field: [], write: [h5], solve.device: {device}}}\ngrid: {{'body.place.at_mm[2]': {heights}}}\n")
        began = time.monotonic()
        work.call("sweep", sweep, "-o", work.runs / f"heights_{device}", "--jobs", 1, **how)
        whole = time.monotonic() - began
        cases[device] = table(work.runs / f"heights_{device}/sweep.csv")
    times = [float(case["seconds"]) for case in cases["cpu"]]
    processor = times[0] + (len(HEIGHTS) - 1) * sum(times[1:]) / len(times[1:])
    differ = max(abs(float(a["relative_error"]) - float(b["relative_error"])) for a, b in zip(cases["cpu"], cases["cuda"]))
    return [row("a sphere, one drive", faces, seconds["cuda"], seconds["cpu"], off),
            row("heights of scenes/width_8mm.yaml", cases["cuda"][0]["faces"], whole, processor, 100 * differ)]


def speed(work):
    """`touchfield study` on two cores. Seconds are those in double / in single precision, refined; `*`: not converged; `-`: not tried."""
    box = ["solve.methods=[paper, unscattered, focus]", "target.box.size_mm=[8, 40, 6]", "target.pressure_pa=3000", "body.keep_within_mm=50"]
    pads = "{thumb_pad: 1.4, index_pad: 1.4, middle_pad: 1.4}"
    cases = {"width_8mm": ([1.68, 1.2, 0.84], [*box, "body.edge_mm={near_target: 1.2, far: 3, within_mm: 15}"]),
             "grasp": ([2, 1.4], ["solve.methods=[paper]", f"body.edge_mm={{near: {pads}, far: 3, within_mm: 15}}"])}
    tables = {}
    for name, (edges, changes) in cases.items():
        scene, meshes = ROOT / f"scenes/{name}.yaml", {}
        folder = work.step(name, ["study", scene, "--solvers", "lu", "gmres", "matrix_free", "--rung-seconds", 60, "--edges-mm", *edges,
                                  *sets(changes)], [scene], **ON_TWO_CORES)
        study = table(folder / "study.csv")
        for row in study:
            meshes.setdefault((row["scheme"], row["edge_mm"], row["faces"]), []).append(row)
        solvers = dict.fromkeys(row["solver"] for row in study)
        tables[f"speed_{name}"] = [
            {"scheme": scheme, "edge": edge, "faces": faces, "error": spread([100 * float(row["error_reference"]) for row in rows], "%")}
            | {solver: " / ".join(seconds_of(row) for row in rows if row["solver"] == solver) for solver in solvers}
            | {"MiB": spread([float(row["peak_mib"]) for row in rows])} for (scheme, edge, faces), rows in meshes.items()]
    return tables


def seconds_of(row):
    return "-" if row["seconds"] == "nan" else f"{float(row['seconds']):.3g}{'*' * row['status'].startswith('not converged')}"


def spread(values, unit=""):
    """Three digits of the least and of the most, or `-`."""
    shown = sorted({float(f"{value:.3g}") for value in values if not math.isnan(value)})
    return f"{' to '.join(f'{value:g}' for value in (shown[:1] + shown[-1:] if len(shown) > 1 else shown))} {unit}".strip() if shown else "-"


PUBLISHED = {"r": 10_000, "n": 1496}  # the study reports 10 ms per iteration for this size
LINES = [("processor_ms", "this program on the processor", STYLES["unscattered"]), ("card_ms", "this program on the graphics card", STYLES["surface"]),
         ("steps_ms", "the step alone, on the graphics card", STYLES["focus"])]


def card_picture(images):
    """docs/images/gpu_iteration.png: time of one of five iterations of `paper` by faces and by channels."""
    from matplotlib import pyplot

    by_size = {}
    for row in table(ROOT / "results/tables/gpu_phases.csv"):
        by_size.setdefault((int(row["r"]), int(row["n"])), {})[row["work"]] = row
    found = []
    for (faces, channels), of in by_size.items():
        whole, needs = of.get("paper, five steps and what they need"), of.get("paper, what they need")
        if whole and needs:
            found.append({"r": faces, "n": channels, "processor_ms": float(whole["processor_ms"]) / 5, "card_ms": float(whole["card_ms"]) / 5,
                          "steps_ms": (float(whole["card_ms"]) - float(needs["card_ms"])) / 5})
    same_faces = [of for of in found if sum(other["r"] == of["r"] for other in found) > 1]
    same_channels = [of for of in found if of["n"] == PUBLISHED["n"]]
    drawing, panels = pyplot.subplots(1, 2, figsize=(12, 4.4), layout="constrained", sharey=True)
    for axes, key, of, label in ((panels[0], "r", same_channels, f"number of faces ({PUBLISHED['n']:,} channels)"),
                                 (panels[1], "n", same_faces, f"number of channels ({same_faces[0]['r']:,} faces)")):
        of.sort(key=lambda one: one[key])
        for column, name, style in LINES:
            axes.plot([one[key] for one in of], [one[column] for one in of], **style, label=name)
        axes.plot(PUBLISHED[key], 10, "*", color="#D55E00", markersize=14, label="the published program")
        axes.set_xlabel(label)
        axes.set_yscale("log")
        axes.set_xlim(left=0)
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("time per iteration [ms]")
    panels[0].legend(loc=(0.42, 0.48))  # between the curves
    drawing.savefig(images / "gpu_iteration.png", dpi=90, metadata={"Software": None})


def live(work, seconds=60):
    """The loop on the wall clock, phases only, with the frame that a budget of 50 ms picks."""
    words = sets([f"motion.seconds={seconds}", "motion.frame={budget_ms: 50}"])
    said = work.call("live", ROOT / "scenes/moving.yaml", "--method", "surface", *words, "--max-seconds", seconds, "--json")
    return [{key: f"{value:.6g}" for key, value in flat(json.loads(said)["live"]).items() if isinstance(value, (int, float))}]


def waiting(work, turns=3):
    """Ways to wait for other threads, alone and while three other programs compute: the least seconds of the turns."""
    ways = [("spin 4000 times, then sleep: default of touchfield", {}), ("spin 300,000 times, then sleep: default of GNU OpenMP", {"GOMP_SPINCOUNT": "300000"}),
            ("sleep at once: `OMP_WAIT_POLICY=passive`", {"OMP_WAIT_POLICY": "passive"}), ("one thread: `OMP_NUM_THREADS=1`", {"OMP_NUM_THREADS": "1"})]
    changes = [listed("surface", "paper"), "evaluation=none", "field=null", "write=[h5]"]
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("OMP_", "GOMP_"))}

    def seconds(setting):
        done = subprocess.run([work.program, "run", ROOT / "scenes/capsule.yaml", "-o", work.runs / "run", "--force", "--device", "cpu", *sets(changes)],
                              env=clean | setting, capture_output=True, text=True, check=True)
        return sum(map(float, re.findall(r"^  (?:find the best target pressure for surface|solve (?:surface|paper)): ([0-9.]+) s$", done.stderr, re.MULTILINE)))

    for name, setting in ways:
        alone = min(seconds(setting) for _ in range(turns))
        others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(3)]
        try:
            beside = min(seconds(setting) for _ in range(turns))
        finally:
            for other in others:
                other.kill()
                other.wait()
        yield {"threads that wait": name, "alone": f"{alone:.2f}", "beside three programs": f"{beside:.2f}"}
