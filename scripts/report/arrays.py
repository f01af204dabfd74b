"""Gains from patterns in time, tolerances of the channels and other arrays, from tables of other scripts."""

import pathlib

from runs import markdown_table, number, percent, table

TABLES = pathlib.Path(__file__).resolve().parents[2] / "results/tables"
BEST = 6  # layouts that are shown


def origin_of(name):
    """The script and the revision that the first line of a kept table names."""
    with open(TABLES / name, encoding="utf-8") as file:
        return file.readline().removeprefix("# made by: ").strip().rstrip(";")


def points(value):
    return f"{round(float(value), 1) + 0.0:.1f}"  # no -0.0


def pattern_part():
    rows = table(TABLES / "patterns.csv")
    free = [row for row in rows if "at most" not in row["pattern"]]
    above = [float(row["above_mean"]) for row in free if int(row["frames"]) >= 100]
    return (f"**Patterns in time** ({origin_of('patterns.csv')}). A spot moves over the still hand, and each frame starts from the one before. "
            f"In paths of 100 frames or more the mean error is {points(min(above))} to {points(max(above))} points above that of frames solved alone. "
            "A limit of the phase change between frames is kept exactly:",
            ["pattern", "frames", "error", "above frames alone [points]", "largest turn [deg]", "phases [s]"],
            [[row["pattern"], row["frames"], percent(row["error"]), points(row["above_mean"]), number(row["turn_deg"]),
              number(row["phases_s"])] for row in rows])


def robust_part():
    rows = table(TABLES / "robust.csv")
    usual, = [row for row in rows if (row["phase_deg"], row["gain_percent"], row["dead_percent"]) == ("20", "10", "0")]
    return (f"**Tolerances** ({origin_of('robust.csv')}). `surface` with `tolerances` minimises the expected misfit. With rms deviations of "
            f"20 degrees and 10 % the misfit over 30 arrays that the solver does not know is {percent(usual['robust'])} instead of "
            f"{percent(usual['plain'])}:",
            ["phase [deg]", "gain [%]", "dead, unknown [%]", "`surface`", "with `tolerances`"],
            [[row["phase_deg"], row["gain_percent"], row["dead_percent"], percent(row["plain"]), percent(row["robust"])] for row in rows])


def layout_part():
    rows = table(TABLES / "array_designs.csv")
    alone = min(float(row["error_surface"]) for row in rows)
    both = [float(row["error_with_amplitudes"]) for row in rows]
    return (f"**Other arrays** ({origin_of('array_designs.csv')}). Of {len(rows)} layouts of at most 1,500 transducers, phases alone reach "
            f"{percent(alone)} for the 8 mm strip on the whole hand. With amplitudes the best reaches {percent(min(both))}, and "
            f"{sum(error < 0.35 for error in both)} layouts are below 35 %:",
            ["family", "layout", "transducers", "phases alone", "with amplitudes", "width, with amplitudes [mm]"],
            [[row["family"], row["name"], row["transducers"], percent(row["error_surface"]), percent(row["error_with_amplitudes"]),
              row["width_mm_with_amplitudes"]] for row in rows[:BEST]])


def texts():
    """Sentence and table, in turn."""
    for sentence, header, rows in (pattern_part(), robust_part(), layout_part()):
        yield sentence
        yield markdown_table(header, rows)
