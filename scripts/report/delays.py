"""Effect of the delay between hand and sound, from plays of a hand that moves at constant velocity or shakes."""

import dataclasses
import pathlib

import h5py
import numpy

from runs import scene_of, setting, table

LOOP = {"sensor_hz": "motion.sensor.hz", "latency_ms": "motion.sensor.latency_ms", "frames_hz": "motion.frames_hz",
        "solve_ms": "motion.solve_ms", "array_ms": "motion.array_ms"}
AXES = {"across": "across the finger", "along": "along the finger", "towards": "towards the array"}
GRID = (0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8, 10, 12, 15, 20, 25, 30, 35)  # [mm]
POINT = 0.01  # percentage point of the relative error


@dataclasses.dataclass
class Play:
    """Scores of a play as columns, from its first frame on, and the settings of the loop in its scene."""

    folder: pathlib.Path
    loop: dict
    predict: str
    method: numpy.ndarray
    time: numpy.ndarray  # [s]
    age: numpy.ndarray  # [s]
    displacement: numpy.ndarray  # [mm]
    error: numpy.ndarray


def plays(folder, name):
    """Plays of the sweep with this name, in order."""
    found = []
    for case in sorted(pathlib.Path(folder).glob("cases/[0-9]*")):
        with h5py.File(case / "motion.h5") as motion:
            if motion.attrs["name"] != name:
                continue
            scene = scene_of(motion)
        rows = [row for row in table(case / "motion.csv") if int(row["frame"]) >= 0]
        columns = [numpy.array([float(row[key]) for row in rows]) for key in ("time_s", "age_s", "displacement_mm", "relative_error")]
        found.append(Play(case, {key: float(setting(scene, path)) for key, path in LOOP.items()}, setting(scene, "motion.predict"),
                          numpy.array([row["method"] for row in rows]), *columns))
    return found


def within(play, segment):
    """Mask of the scores that belong to a segment.

    The score and its sample lie in the segment. With prediction the previous sample does too.
    """
    known = play.time - play.age - (1 / play.loop["sensor_hz"] if play.predict != "none" else 0)
    return (known >= segment.begin - 1e-6) & (play.time <= segment.end + 1e-6)


def summary_of(age, displacement, error):
    """Columns that summarise scores."""
    return {"age_ms_mean": f"{1e3 * age.mean():.4g}", "displacement_mm_mean": f"{displacement.mean():.4g}",
            "error_mean": f"{error.mean():.6g}", "error_median": f"{numpy.median(error):.6g}",
            "error_p95": f"{numpy.percentile(error, 95):.6g}", "scores": str(len(error))}


def delay_rows(held, predicted, segments):
    """One row per axis, speed, delay, prediction and method.

    The rows without prediction have the errors of the held frames, interpolated at the ages of the scores with prediction.
    """
    rows = []

    def add(segment, loop, predict, method, *columns):
        rows.append({"axis": segment.axis, "speed_mm_s": f"{segment.speed:g}", "array_ms": f"{loop.loop['array_ms']:g}",
                     "predict": predict, "method": method} | summary_of(*columns))

    for segment in segments:
        of_held = within(held, segment)
        for loop in predicted:
            chosen = within(loop, segment)
            one = chosen & (loop.method == loop.method[0])  # all methods are scored at the same instants
            ages = loop.age[one][loop.age[one] <= held.age[of_held].max()]
            if len(ages) == 0:
                continue
            for method in dict.fromkeys(held.method) if loop.predict == predicted[0].predict else ():
                scores = of_held & (held.method == method)
                order = numpy.argsort(held.age[scores])
                add(segment, loop, held.predict, method, ages, segment.speed * ages,
                    numpy.interp(ages, held.age[scores][order], held.error[scores][order]))
            for method in dict.fromkeys(loop.method):
                scores = chosen & (loop.method == method)
                add(segment, loop, loop.predict, method, loop.age[scores], loop.displacement[scores], loop.error[scores])
    return rows


def error_at(displacement, distances, errors):
    """Error at a displacement, from a straight line through the nearest scores; None beyond the largest displacement."""
    if displacement > distances.max():
        return None
    away = numpy.abs(distances - displacement)
    near = numpy.argsort(away)[:max(4, int((away <= 0.2 + 0.1 * displacement).sum()))]
    if numpy.ptp(distances[near]) == 0:
        return float(errors[near].mean())
    return float(numpy.polyval(numpy.polyfit(distances[near] - displacement, errors[near], 1), 0))


def displacement_rows(held, segments):
    """One row per axis, method and displacement, from the slowest motion that reaches the displacement."""
    rows = []
    for axis in dict.fromkeys(segment.axis for segment in segments):
        own = sorted((segment for segment in segments if segment.axis == axis), key=lambda segment: segment.speed)
        for method in dict.fromkeys(held.method):
            for displacement in GRID:
                for segment in own:
                    chosen = within(held, segment) & (held.method == method)
                    error = error_at(displacement, held.displacement[chosen], held.error[chosen])
                    if error is not None:
                        rows.append({"axis": axis, "method": method, "displacement_mm": f"{displacement:g}",
                                     "relative_error": f"{error:.6g}", "from_speed_mm_s": f"{segment.speed:g}"})
                        break
    return rows


def tremor_rows(tremors, segments):
    """One row per tremor, array delay, prediction and method."""
    rows = []
    for segment in segments:
        for play in tremors:
            for method in dict.fromkeys(play.method):
                chosen = within(play, segment) & (play.method == method)
                if chosen.any():
                    rows.append({"hz": f"{segment.hz:g}", "amplitude_mm": f"{segment.amplitude:g}",
                                 "array_ms": f"{play.loop['array_ms']:g}", "predict": play.predict, "method": method}
                                | summary_of(play.age[chosen], play.displacement[chosen], play.error[chosen]))
    return rows


def loop_rows(loops):
    """Mean age, worst age and parts of the age of the current sample, one row per loop; `changed` compares with the first loop."""
    rows = []
    for play in loops:
        frames = table(play.folder / "frames.csv")
        settled = play.time >= 0.3  # the first frames have younger samples
        age = 1e3 * play.age[settled]
        solved = [1e3 * (float(row["started_s"]) - float(row["sampled_s"])) for row in frames]
        waited = float(numpy.mean(solved)) - play.loop["latency_ms"]
        onward = play.loop["latency_ms"] + play.loop["solve_ms"] + play.loop["array_ms"]
        changed = [f"{key} {value:g}" for key, value in play.loop.items() if value != loops[0].loop[key]]
        rows.append({"changed": ", ".join(changed) or "as it is"} | {key: f"{value:g}" for key, value in play.loop.items()}
                    | {"age_ms_mean": f"{age.mean():.3f}", "age_ms_worst": f"{age.max():.3f}", "wait_ms_mean": f"{waited:.3f}",
                       "hold_ms_mean": f"{age.mean() - waited - onward:.3f}"})
    return rows


def curve(rows, axis, method):
    """Displacements and errors of delays_by_displacement.csv."""
    own = [row for row in rows if (row["axis"], row["method"]) == (axis, method)]
    return [[float(row[column]) for row in own] for column in ("displacement_mm", "relative_error")]


def reaches(displacements, errors, level):
    """The smallest displacement, linearly interpolated, at which the error reaches a level; None if there is none."""
    above = numpy.flatnonzero(numpy.array(errors) >= level)
    if len(above) == 0 or above[0] == 0:
        return displacements[0] if len(above) else None
    return float(numpy.interp(level, *(values[above[0] - 1:above[0] + 1] for values in (errors, displacements))))


def answer_rows(by_displacement, speeds=(10, 50, 200)):
    """Two displacements, and the delays that they mean, per axis and method with scattering.

    At `equal` the error reaches that of `unscattered` without delay. At `alike` the gain over `unscattered` at the same displacement
    first drops to 1 percentage point. A displacement that is not reached is empty.
    """
    rows = []
    knowing = [row for row in by_displacement if row["method"] != "unscattered"]
    for axis, method in dict.fromkeys((row["axis"], row["method"]) for row in knowing):
        displacements, errors = curve(by_displacement, axis, method)
        unscattered = dict(zip(*curve(by_displacement, axis, "unscattered")))
        gains = [unscattered[displacement] - error for displacement, error in zip(displacements, errors)]
        equal = reaches(displacements, errors, unscattered[0])
        alike = reaches(displacements, [-gain for gain in gains], -POINT)
        row = {"axis": axis, "method": method, "at_rest": f"{errors[0]:.6g}",
               "unscattered_at_rest": f"{unscattered[0]:.6g}", "tried_to_mm": f"{displacements[-1]:g}"}
        for name, value in (("equal", equal), ("alike", alike)):
            row[f"{name}_mm"] = "" if value is None else f"{value:.4g}"
            row |= {f"{name}_ms_at_{speed}": "" if value is None else f"{1e3 * value / speed:.4g}" for speed in speeds}
        beyond = [] if alike is None else [100 * gain for displacement, gain in zip(displacements, gains) if displacement >= alike]
        row["alike_error"] = "" if alike is None else f"{numpy.interp(alike, displacements, errors):.6g}"
        row["beyond_least_points"], row["beyond_most_points"] = (f"{choose(beyond):.3f}" if beyond else "" for choose in (min, max))
        rows.append(row)
    return rows
