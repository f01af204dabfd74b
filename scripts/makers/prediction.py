"""How much of the delay's error `motion.predict` removes with noisy cameras: prediction_gain.csv.

Plays scenes/cameras.yaml with the finger stretched: at rest, swaying, then to and fro at constant velocity, sideways and towards the array.
The delay is the array's alone.
"""

import itertools
import math

import cameras
import course
import numpy
import sights
from runs import table
from work import EVALUATED, ROOT

SENSOR_HZ = 30
ARRAY_MS = 70
NOISE_PX = 0.08  # disparity, of a D415 [rms]
KINDS = ("none", "linear", "kalman")
SPEEDS = (25, 50, 100)  # [mm/s]
AXES = ("across", "towards")
SETTLED = 0.5  # at rest and swaying: of which no score counts [s]
PAUSE = 0.3  # between legs [s]
RAMP = 0.05  # [s]


class Course:
    """What one play does, and which of its time is of which motion."""

    def __init__(self, speeds):
        self.place = {axis: course.CENTRE[axis] for axis in (0, 2)}
        self.keys = {axis: [(0.0, place)] for axis, place in self.place.items()}
        self.parts = []  # (course, axis, speed, begin, end): samples and scores within count
        self.now = 0.0
        self.reach(1.5)
        self.parts.append(("rest", "", 0, SETTLED, self.now))
        for axis, speed in itertools.product(AXES, speeds):
            self.sway(axis, speed, 2.5)
            self.go(axis, speed, 3)

    def reach(self, seconds, own=0, place=None):
        """The hand is there after these seconds, along a straight line, or rests if no place is given."""
        self.now += seconds
        if place is not None:
            self.place[own] = place
        for axis, points in self.keys.items():
            points.append((self.now, self.place[axis]))

    def sway(self, axis, speed, seconds):
        own, sign = course.AXES[axis]
        begin = self.now
        for i in range(1, round(64 * seconds) + 1):
            self.reach(1 / 64, own, course.CENTRE[own] + sign * speed / (2 * math.pi) * math.sin(2 * math.pi * i / 64))
        self.parts.append(("sine", axis, speed, begin + SETTLED, self.now))

    def go(self, axis, speed, legs):
        own, sign = course.AXES[axis]
        steady = min(0.5, 70 / speed)  # [s]
        velocity = sign * speed
        self.reach(0.4, own, course.CENTRE[own] - velocity * (steady / 2 + RAMP))
        self.reach(PAUSE)
        for _ in range(legs):
            for seconds in (RAMP, steady, RAMP):
                self.reach(seconds, own, self.place[own] + velocity * seconds)
            self.parts.append(("steady", axis, speed, self.now - RAMP - steady, self.now - RAMP))
            self.reach(PAUSE)
            velocity = -velocity
        self.reach(0.4, own, course.CENTRE[own])
        self.reach(PAUSE)


def cases_of(seeds):
    return [(seed, kind) for seed in range(1, seeds + 1) for kind in KINDS]


def sweep_text(cases, played):
    common = {"motion.seconds": f"{played.now:g}", "motion.change": course.change_of(played.keys), "motion.solve_ms": "0", "motion.frames_hz": "20",
              "motion.iterations": "10", "motion.score_hz": "23", "motion.array_ms": f"{ARRAY_MS}", "solve.methods": "[surface]", "write": "[h5]",
              "evaluation": EVALUATED.partition("=")[2]}
    lines = [f"base: {ROOT / 'scenes/cameras.yaml'}\nset:\n"] + [f"  {path}: {value}\n" for path, value in common.items()] + ["cases:\n"]
    for seed, kind in cases:
        sensor = sights.cameras(hz=SENSOR_HZ, seed=seed, disparity_noise_px=NOISE_PX)["motion.sensor"]
        lines.append(f"  - {{name: {kind}_{seed}, motion.predict: {kind}, motion.sensor: {sensor}}}\n")
    return "".join(lines)


def errors_of(folder, parts):
    """{(course, axis, speed): errors} of the scores whose sample, and the one before, and whose time are within a part."""
    rows = [row for row in table(folder / "motion.csv") if int(row["frame"]) >= 0 and row["relative_error"] not in ("", "nan")]
    time, age, error = (numpy.array([float(row[key]) for row in rows]) for key in ("time_s", "age_s", "relative_error"))
    found = {}
    for kind, axis, speed, begin, end in parts:
        within = (time - age - 1 / SENSOR_HZ >= begin - 1e-6) & (time <= end + 1e-6)
        found.setdefault((kind, axis, speed), []).append(error[within])
    return {key: numpy.concatenate(errors) for key, errors in found.items()}


def gains_of(cases, found, parts):
    """One row per course, axis and speed; errors are means over a seed's scores, then over seeds."""
    means = {}  # {(course, axis, speed): {kind: mean error of each seed}}
    for seed, kind in cases:
        for key, errors in errors_of(found[f"{kind}_{seed}"], parts).items():
            if len(errors) > 0:
                means.setdefault(key, {}).setdefault(kind, []).append(errors.mean())
    gains = []
    for (what, axis, speed), own in means.items():
        over_seeds = {kind: numpy.mean(own[kind]) for kind in KINDS}
        best = min(("none", "linear"), key=over_seeds.get)
        paired = numpy.array(own[best]) - numpy.array(own["kalman"])
        error = paired.std(ddof=1) / math.sqrt(len(paired)) if len(paired) > 1 else math.nan
        gains.append({"course": what, "axis": axis, "speed_mm_s": f"{speed:g}", "array_ms": f"{ARRAY_MS}", "noise_px": f"{NOISE_PX}", "seeds": len(paired)}
                     | {kind: f"{mean:.6g}" for kind, mean in over_seeds.items()}
                     | {"best_other": best, "gain": f"{paired.mean():.6g}", "gain_standard_error": f"{error:.3g}"})
    return gains


def gain(work, seeds=5):
    played, cases = Course(SPEEDS), cases_of(seeds)
    sweep = work.runs / "prediction.yaml"
    sweep.write_text(sweep_text(cases, played), encoding="utf-8")
    work.call("sweep", sweep, "-o", work.runs / "plays", "--jobs", work.jobs)
    return gains_of(cases, cameras.folders(work.runs / "plays"), played.parts)
