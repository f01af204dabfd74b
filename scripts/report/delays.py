"""Effect of the delay between hand and sound, from plays of a hand that moves at constant velocity or shakes."""

import dataclasses
import itertools
import pathlib

import h5py
import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

import course  # noqa: E402
from runs import LABELS, STYLES, listed, number, percent, scene_of, setting, table  # noqa: E402

LOOP = {"sensor_hz": "motion.sensor.hz", "latency_ms": "motion.sensor.latency_ms", "frames_hz": "motion.frames_hz",
        "solve_ms": "motion.solve_ms", "array_ms": "motion.array_ms"}
CHANGED = {"sensor_hz": "a sensor at {} Hz", "latency_ms": "a sensor latency of {} ms", "frames_hz": "frames at {} Hz",
           "solve_ms": "a solving time of {} ms", "array_ms": "an array delay of {} ms"}
AXES = {"across": "across the finger", "along": "along the finger", "towards": "towards the array"}
GRID = (0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8, 10, 12, 15, 20, 25, 30, 35)  # [mm]
POINT = 0.01  # percentage point of the relative error
NOISE_MM = 0.1  # rms, in the plays with sensor noise
DASHES = {"linear": "--", "kalman": ":"}  # per kind of prediction
# A prototype with 2,404 faces: relative_error at rest, and {displacement [mm]: relative_error} with phases found at rest.
REFERENCE_REST = 0.453
REFERENCE = {
    "across": {0.25: 0.457, 0.5: 0.471, 1: 0.520, 1.5: 0.588, 2: 0.663, 3: 0.783, 4: 0.862, 6: 0.943, 8: 0.964, 10: 0.938},
    "along": {0.25: 0.456, 0.5: 0.466, 1: 0.502, 1.5: 0.555, 2: 0.617, 3: 0.746, 4: 0.843, 6: 0.953, 8: 0.989, 10: 0.992},
    "towards": {0.25: 0.453, 0.5: 0.454, 1: 0.459, 1.5: 0.466, 2: 0.475, 3: 0.498, 4: 0.527, 6: 0.592, 8: 0.658, 10: 0.719}}


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


def noise_rows(noisy, segments):
    """One row per axis, speed, prediction and method of the plays with sensor noise."""
    return [{"axis": segment.axis, "speed_mm_s": f"{segment.speed:g}", "array_ms": f"{play.loop['array_ms']:g}",
             "predict": play.predict, "method": method} | summary_of(play.age[chosen], play.displacement[chosen], play.error[chosen])
            for segment in segments for play in noisy for method in dict.fromkeys(play.method)
            if (chosen := within(play, segment) & (play.method == method)).any()]


def error_at(displacement, distances, errors):
    """Error at a displacement, from a straight line through the nearest scores; None beyond the largest displacement."""
    if displacement > distances.max():
        return None
    away = numpy.abs(distances - displacement)
    order = numpy.argsort(away)
    near = order[:max(4, int((away <= 0.2 + 0.1 * displacement).sum()))]
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
                        reference = REFERENCE[axis].get(displacement, numpy.nan) if method == "surface" else numpy.nan
                        rows.append({"axis": axis, "method": method, "displacement_mm": f"{displacement:g}",
                                     "relative_error": f"{error:.6g}", "from_speed_mm_s": f"{segment.speed:g}",
                                     "reference": f"{reference:g}"})
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


# Sentences

def curve(rows, axis, method):
    """Displacements and errors of delays_by_displacement.csv."""
    own = [(float(row["displacement_mm"]), float(row["relative_error"])) for row in rows
           if (row["axis"], row["method"]) == (axis, method)]
    return [displacement for displacement, _ in own], [error for _, error in own]


def reaches(displacements, errors, level):
    """The smallest displacement, linearly interpolated, at which the error reaches a level; None if there is none."""
    for i, error in enumerate(errors):
        if error >= level:
            if i == 0:
                return displacements[0]
            share = (level - errors[i - 1]) / (error - errors[i - 1])
            return displacements[i - 1] + share * (displacements[i] - displacements[i - 1])
    return None


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


def milliseconds(value):
    return f"{float(value):,.0f}" if float(value) >= 100 else number(value, 2)


def delays_in_words(row, name):
    return listed([f"{milliseconds(value)} ms at {key.rsplit('_', 1)[1]} mm/s" for key, value in row.items()
                     if key.startswith(f"{name}_ms_at_")])


def answer_sentences(rows):
    said = []
    for row in rows:
        gain = float(row["unscattered_at_rest"]) - float(row["at_rest"])
        at_rest = percent(row["unscattered_at_rest"])
        begin = (f"**{AXES[row['axis']].capitalize()}, `{row['method']}`.** Without delay its error is {percent(row['at_rest'])}. "
                 f"That of `unscattered` is {at_rest} ({100 * gain:+.1f} points). ")
        equal = (f"Its error reaches {at_rest} once the hand has moved by {number(row['equal_mm'], 2)} mm. "
                 f"This takes {delays_in_words(row, 'equal')}. "
                 if row["equal_mm"] else f"Its error stays below {at_rest} up to {row['tried_to_mm']} mm, the largest displacement. ")
        alike = (f"At the same delay, its gain over `unscattered` first drops to 1 point or less at {number(row['alike_mm'], 2)} mm. "
                 f"This takes {delays_in_words(row, 'alike')}. The error there is {percent(row['alike_error'], 0)}. "
                 f"From there on the gain is {float(row['beyond_least_points']):+.1f} to {float(row['beyond_most_points']):+.1f} points."
                 if row["alike_mm"] else "At the same delay, its gain over `unscattered` stays above 1 point up to "
                 f"{row['tried_to_mm']} mm, the largest displacement.")
        said.append(begin + equal + alike)
    return said


def gains_of_prediction(rows, keys, kind, method="surface"):
    """[(reduction of the mean error by a prediction [points], row without prediction)] for rows with equal `keys`."""
    kept = {(tuple(row[key] for key in keys), row["predict"]): row for row in rows if row["method"] == method}
    return [(100 * (float(row["error_mean"]) - float(kept[alike, kind]["error_mean"])), row)
            for (alike, predict), row in kept.items() if predict == "none" and (alike, kind) in kept]


def kinds_of(rows):
    """Kinds of prediction in the rows."""
    return [kind for kind in dict.fromkeys(row["predict"] for row in rows) if kind != "none"]


def prediction_sentences(delay, tremor):
    said = []
    for speed, kind in itertools.product(dict.fromkeys(row["speed_mm_s"] for row in delay), kinds_of(delay)):
        alike = [row for row in delay if row["speed_mm_s"] == speed]
        gains = gains_of_prediction(alike, ("axis", "array_ms"), kind)
        if gains:
            (least, low), (most, high) = (choose(gains, key=lambda item: item[0]) for choose in (min, max))
            known = {(row["axis"], row["array_ms"], row["method"]): float(row["error_mean"]) for row in alike
                     if row["predict"] == kind}
            pays = [100 * (known[axis, array, "unscattered"] - error) for (axis, array, method), error in known.items()
                    if method == "surface" and (axis, array, "unscattered") in known]
            said.append(f"At a constant {speed} mm/s, `predict: {kind}` changes the mean error of `surface` by {-least:+.1f} to "
                        f"{-most:+.1f} points. The first value is {AXES[low['axis']]} with an array delay of {low['array_ms']} ms, the "
                        f"second {AXES[high['axis']]} with {high['array_ms']} ms."
                        + (f" With this prediction `surface` gains {min(pays):+.1f} to {max(pays):+.1f} points over `unscattered`."
                           if pays else ""))
    for kind in kinds_of(tremor):
        said.append(tremor_sentence(gains_of_prediction(tremor, ("hz", "amplitude_mm", "array_ms"), kind), kind))
    if tremor:
        worst = max((row for row in tremor if row["predict"] == "none"), key=lambda row: float(row["error_mean"]))
        said.append(f"Without prediction, the largest mean error of a tremor is {percent(worst['error_mean'])} ({tremor_text(worst)}).")
    return said


def tremor_text(row):
    return f"{row['amplitude_mm']} mm at {row['hz']} Hz, {row['array_ms']} ms"


def tremor_sentence(gains, kind):
    (least, low), (most, high) = (choose(gains, key=lambda item: item[0]) for choose in (min, max))
    hurts = sum(gain < 0 for gain, _ in gains)
    return (f"`predict: {kind}` increases the mean error in {hurts} of {len(gains)} combinations of a tremor and an array delay. The "
            f"changes are {-most:+.1f} points ({tremor_text(high)}) to {-least:+.1f} points ({tremor_text(low)}).")


def noise_sentences(noise):
    """Errors of the kinds of prediction with sensor noise, one item per axis and speed."""
    said = []
    for axis, speed in dict.fromkeys((row["axis"], row["speed_mm_s"]) for row in noise):
        own = [row for row in noise if (row["axis"], row["speed_mm_s"], row["method"]) == (axis, speed, "surface")]
        said.append(f"The sensor noise is {NOISE_MM} mm rms and the array delay {own[0]['array_ms']} ms. {AXES[axis].capitalize()} at "
                    f"{speed} mm/s, the mean error of `surface` is "
                    + listed([f"{percent(row['error_mean'])} (`{row['predict']}`)" for row in own]) + ".")
    return said


def loop_sentences(rows):
    whole = rows[0]
    parts = {"sampling": float(whole["wait_ms_mean"]), "sensor latency": float(whole["latency_ms"]),
             "solving": float(whole["solve_ms"]), "the array": float(whole["array_ms"]),
             "holding the frame": float(whole["hold_ms_mean"])}
    said = [f"In the loop of scenes/moving.yaml the sensor runs at {whole['sensor_hz']} Hz and frames come at {whole['frames_hz']} Hz. "
            f"The sound is for a sample that is {number(whole['age_ms_mean'])} ms old on average and {number(whole['age_ms_worst'])} ms "
            "at worst. The mean consists of "
            + listed([f"{part} ({number(value)} ms)" for part, value in sorted(parts.items(), key=lambda item: -item[1])]) + "."]
    for row in rows[1:]:
        changed = " and ".join(words.format(row[key]) for key, words in CHANGED.items() if row[key] != whole[key])
        said.append(f"With {changed} the age is {number(row['age_ms_mean'])} ms on average and {number(row['age_ms_worst'])} ms "
                    "at worst.")
    return said


def reference_sentence(rows):
    """Difference of the rise of the error above its value at rest from that of the prototype."""
    said = []
    for axis in dict.fromkeys(row["axis"] for row in rows):
        own = [row for row in rows if row["axis"] == axis and row["reference"] != "nan"]
        rest = next(float(row["relative_error"]) for row in rows
                    if (row["axis"], row["method"], row["displacement_mm"]) == (axis, "surface", "0"))
        if own:
            away = [(float(row["relative_error"]) - rest) - (float(row["reference"]) - REFERENCE_REST) for row in own]
            most = max(range(len(own)), key=lambda i: abs(away[i]))
            said.append(f"at {own[most]['displacement_mm']} mm {AXES[axis]} ({100 * away[most]:+.1f} points)")
    return ("The rise of the error of `surface` above its value at rest is compared with that of a prototype. The prototype solved on "
            "2,404 faces, and moved away from the array instead of towards it. The two rises differ most " + listed(said) + ".")


def figure(held, predicted, segments, path):
    """Error against age. Lines with prediction are dashed or dotted."""
    axes_of = list(dict.fromkeys(segment.axis for segment in segments))
    speeds = list(dict.fromkeys(segment.speed for segment in segments))
    drawing, panels = pyplot.subplots(len(axes_of), len(speeds), figsize=(4.3 * len(speeds) + 1.5, 3 * len(axes_of)),
                                      layout="constrained", sharex=True, sharey=True, squeeze=False)
    for segment in segments:
        panel = panels[axes_of.index(segment.axis), speeds.index(segment.speed)]
        for method in dict.fromkeys(held.method):
            chosen = within(held, segment) & (held.method == method)
            ages, errors = binned(held.age[chosen], held.error[chosen])
            panel.plot(ages, errors, color=STYLES[method]["color"], marker=STYLES[method]["marker"], markersize=3,
                       label=LABELS[method])
        for kind, method in itertools.product(dict.fromkeys(play.predict for play in predicted), dict.fromkeys(predicted[0].method)):
            found = [(play, within(play, segment) & (play.method == method)) for play in predicted if play.predict == kind]
            ages, errors = binned(numpy.concatenate([play.age[chosen] for play, chosen in found]),
                                  numpy.concatenate([play.error[chosen] for play, chosen in found]))
            panel.plot(ages, errors, color=STYLES[method]["color"], linestyle=DASHES[kind], label=f"{LABELS[method]}, {kind}")
        panel.set_title(f"{AXES[segment.axis]}, {segment.speed:g} mm/s", fontsize=10)
        panel.grid(color="0.9")
    for panel in panels[-1]:
        panel.set_xlabel("age of the sample [ms]")
    for panel in panels[:, 0]:
        panel.set_ylabel("evaluated error [%]")
    panels[0, 0].legend(fontsize=8)
    drawing.savefig(path, dpi=90)
    pyplot.close(drawing)


def binned(ages, errors, width=0.0125):
    """Means of age [ms] and error [%] in bins of age."""
    bins = numpy.floor(ages / width).astype(int)
    return tuple(zip(*[(1e3 * ages[bins == own].mean(), 100 * errors[bins == own].mean()) for own in sorted(set(bins))])) or ((), ())
