"""Patterns in time, tolerances of the channels, and other arrays, from tables of other scripts."""

import pathlib

from runs import markdown_table, number, percent, table

TABLES = pathlib.Path(__file__).resolve().parents[2] / "results/tables"
BEST = 6  # number of layouts in the report


def origin_of(name):
    """Script and revision, from the first line of a table."""
    with open(TABLES / name, encoding="utf-8") as file:
        return file.readline().removeprefix("# made by: ").strip().rstrip(";")


def points(value):
    return f"{round(float(value), 1) + 0.0:.1f}"  # no -0.0


def pattern_part():
    rows = table(TABLES / "patterns.csv")
    free = [row for row in rows if "at most" not in row["pattern"]]
    above = [float(row["above_mean"]) for row in free if int(row["frames"]) >= 100]
    return (f"**Patterns in time** ({origin_of('patterns.csv')}). A spot moves over a hand at rest. Each frame starts from the phases "
            f"of the previous frame. In paths of 100 frames or more, the mean error is {points(min(above))} to {points(max(above))} "
            "points above that of frames solved separately. A limit on the phase change between frames is met exactly:",
            ["pattern", "frames", "error", "above separate frames [points]", "largest phase change [deg]", "solving time [s]"],
            [[row["pattern"], row["frames"], percent(row["error"]), points(row["above_mean"]), number(row["turn_deg"]),
              number(row["phases_s"])] for row in rows])


def robust_part():
    rows = table(TABLES / "robust.csv")
    usual, = [row for row in rows if (row["phase_deg"], row["gain_percent"], row["dead_percent"]) == ("20", "10", "0")]
    return (f"**Tolerances** ({origin_of('robust.csv')}). `surface` with `tolerances` minimises the expected misfit. The rows have the "
            "misfit over 30 arrays that the solver does not know. With rms deviations of 20 degrees and 10 % it is "
            f"{percent(usual['robust'])} instead of {percent(usual['plain'])}:",
            ["phase [deg]", "gain [%]", "unknown dead channels [%]", "`surface`", "`surface` with `tolerances`"],
            [[row["phase_deg"], row["gain_percent"], row["dead_percent"], percent(row["plain"]), percent(row["robust"])]
             for row in rows])


def layout_part():
    rows = table(TABLES / "array_designs.csv")
    alone = min(float(row["error_surface"]) for row in rows)
    both = [float(row["error_with_amplitudes"]) for row in rows]
    bound = min(float(row["error_bound"]) for row in rows)
    return (f"**Other arrays** ({origin_of('array_designs.csv')}). The target is the 8 mm strip on the whole hand. Among {len(rows)} "
            f"layouts of at most 1,500 transducers, the lowest error with phases alone is {percent(alone)}. With amplitudes it is "
            f"{percent(min(both))}. By the optimality bounds, no layout can reach less than {percent(bound)} at the wanted pressure:",
            ["family", "layout", "transducers", "phases alone", "with amplitudes", "bound", "width, with amplitudes [mm]"],
            [[row["family"], row["name"], row["transducers"], percent(row["error_surface"]), percent(row["error_with_amplitudes"]),
              percent(row["error_bound"]), row["width_mm_with_amplitudes"]] for row in rows[:BEST]])


def texts():
    """Sentences and tables, alternating."""
    for sentence, header, rows in (pattern_part(), robust_part(), layout_part()):
        yield sentence
        yield markdown_table(header, rows)
