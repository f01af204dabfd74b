"""Formulas of docs/limits.md and docs/hardware.md, means over draws of errors, and a focus in another medium."""

import math
import re
import statistics

import h5py
import numpy
from runs import results, table
from work import ROOT, listed

ERRORS = {"gain_percent": "gain {} %", "phase_deg": "phase {} deg", "dead_percent": "{} % dead"}
CHANGES = [("absorption", "medium.absorption", ["true"]), ("frequency", "frequency_khz", [39.5, 39.8, 40.2, 40.5]),
           ("temperature", "medium.temperature_c", [21, 22, 25])]


def formulas(_):
    """Fubini's series before the shock; a coherent sum of 1,496 channels with normal errors."""
    from scipy.special import jn

    def harmonic(n, sigma):
        return 2 * jn(n, n * sigma) / (n * sigma)

    harmonics = [{"sigma": sigma, "fundamental": harmonic(1, sigma), "second": harmonic(2, sigma) / harmonic(1, sigma), "energy": 1 - harmonic(1, sigma)**2}
                 for sigma in (0.3, 0.5, 1)]
    focus = []
    for phase, gain in ((10, 5), (20, 10), (40, 20)):
        kept = math.exp(-math.radians(phase)**2)
        focus.append({"phase_deg": phase, "gain_percent": gain, "left": math.sqrt(kept), "elsewhere": math.sqrt((1 + (gain / 100)**2 - kept) / 1496)})
    return {"harmonics": harmonics, "tolerances_focus": focus}


def array_of(row):
    if row["array.phase_levels"]:
        return f"{row['array.phase_levels']} steps a turn", "unknown"
    given = dict(re.findall(r"(\w+): (\w+)", row["array.tolerances"]))
    words = ", ".join(text.format(given[key]) for key, text in ERRORS.items() if key in given)
    return words or "as designed", "known" if "in" in given else "unknown"


def tolerances(work):
    """Mean and standard deviation over the draws of kept sweeps; `radiation` by its own error, that of P."""
    def errors(scene, source):
        draws = {}
        for row in table(ROOT / f"results/tables/{source}.csv"):
            wanted = f" {row['target.pressure_pa']} Pa" if "target.pressure_pa" in row else ""
            error = row["relative_error_radiation" if row["method"] == "radiation" else "relative_error"]
            draws.setdefault((scene + wanted, *array_of(row), row["method"]), []).append(100 * float(error))
        return [dict(zip(("scene", "array", "errors_are", "method"), key)) |
                {"error": f"{statistics.mean(own):.2f}" + (f" +- {statistics.stdev(own):.2f}" if len(own) > 1 else "") + " %"} for key, own in draws.items()]

    return {"tolerances_errors": errors("width_8mm", "tolerances"),
            "tolerances_weak": errors("capsule", "tolerances_capsule") + errors("grasp", "tolerances_grasp")}


def medium(work):
    """A focus that was found for the medium and frequency of the scene."""
    designed = work.solved({"focus": ("width_8mm", ["evaluation=none", listed("focus")])})["focus"]
    with h5py.File(designed / "run.h5") as file:
        numpy.savetxt(work.runs / "phases.txt", file["methods/focus/phase"][:])
    fixed = listed(f"{{fixed: {{phases_file: {work.runs}/phases.txt}}}}")
    folders = work.solved({(what, f"{key}={value}"): ("width_8mm", ["evaluation=none", f"{key}={value}", fixed]) for what, key, values in CHANGES for value in values})
    before = results(designed)["focus"]["mean_inside_pa"]
    for (what, changed), folder in folders.items():
        found = results(folder)["fixed"]["mean_inside_pa"]
        yield {"what": what, "changed": changed, "mean_inside_pa": f"{found:.0f}", "change": f"{found / before - 1:.4f}"}
