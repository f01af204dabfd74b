"""Methods after scaling to one force on the target, and to one peak of the radiation pressure P.

A common level of all channels scales P by its square. It leaves errors, widths and shares as they are.
"""

import math

from runs import SCENES, listed, number, percent

METHODS = ["surface", "radiation", "paper", "unscattered", "focus"]
FORCE_N = 5e-4
PEAK_PA = 20


def scaled(rows):
    """{(scene, method): results at one force and at one peak}."""
    found = {}
    for row in rows:
        force, outside, peak = (float(row[key]) for key in ("force_target_n", "abs_force_elsewhere_n", "peak_radiation_pa"))
        pressed = force if force > 0 else math.nan
        found[row["scene"], row["method"]] = {
            "force": force, "level": (FORCE_N / pressed) ** 0.5, "outside": outside * FORCE_N / pressed, "peak": peak * FORCE_N / pressed,
            "force_at_peak": force * PEAK_PA / peak, "loudest": float(row["loudest_elsewhere"]), "width": float(row["width_radiation_mm"])}
    return found


def summary(rows):
    header = ["scene", "method", "force, as run [mN]",
              *(f"{what} at {1e3 * FORCE_N:g} mN" for what in ("level", "sum of abs(P) A outside [mN],", "peak of P [Pa],")),
              "loudest P outside / mean on the target", "width of P [mm]", f"force at a peak of {PEAK_PA} Pa [mN]"]
    return header, [[scene, f"`{method}`", number(1e3 * one["force"]), percent(one["level"], 0), number(1e3 * one["outside"], 2),
                     number(one["peak"]), number(one["loudest"], 2), number(one["width"], 2), number(1e3 * one["force_at_peak"], 2)]
                    for (scene, method), one in scaled(rows).items() if method in METHODS]


def sentences(rows, names):
    found = scaled(rows)

    def relative(key, method):
        return ", ".join(number(found[name, method][key] / found[name, "focus"][key], 2) for name in names)

    said = [f"Relative to `focus`, {what} is in the order of the table: " + "; ".join(
        f"{relative(key, method)} with `{method}`" for method in ("surface", "radiation", "paper")) + "." for what, key in (
            ("the sum of abs(P) A outside at one force", "outside"), ("the force at one peak of P", "force_at_peak"),
            ("the level for one force", "level"))]
    for method in ("surface", "radiation"):
        worse = [SCENES[name] for name in names if found[name, method]["loudest"] > found[name, "focus"]["loudest"]]
        said.append(f"At one force, the loudest place outside is louder with `{method}` than with `focus` on "
                    f"{len(worse)} of {len(names)} scenes" + (f": {listed(worse)}." if worse else "."))
    beyond = [f"`{method}` ({SCENES[name]})" for name in names for method in METHODS if not found[name, method]["level"] <= 1]
    return said + ([f"Above the level of the runs, or not at all, these reach {1e3 * FORCE_N:g} mN: {listed(beyond)}."] if beyond else [])
