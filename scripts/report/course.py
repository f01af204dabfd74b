"""Paths of the hand in the study of delays. Times are in s from the start of the motion, lengths in mm."""

import dataclasses
import math

AXES = {"across": (0, -1), "along": (1, 1), "towards": (2, -1)}  # (coordinate of the body's place, direction)
CENTRE = (0, 0, 200)
SLOT = 0.6  # per translation; three held frames at 5 Hz
STEADY = (0.15, 0.57)  # part of a slot with constant velocity
MIDDLE = 0.36
TREMOR_SLOT = 0.5  # whole periods of 8 and 12 Hz
KEYS_PER_PERIOD = 16


@dataclasses.dataclass(frozen=True)
class Translation:
    axis: str
    speed: float  # [mm/s]
    begin: float
    end: float  # the velocity is constant from begin to end


@dataclasses.dataclass(frozen=True)
class Tremor:
    hz: float
    amplitude: float
    begin: float
    end: float


def translations(quick=False):
    speeds = (50,) if quick else (10, 50, 200)
    return [Translation(axis, speed, round(SLOT * number + STEADY[0], 6), round(SLOT * number + STEADY[1], 6))
            for number, (axis, speed) in enumerate((axis, speed) for axis in AXES for speed in speeds)]


def tremors(quick=False):
    kinds = [(8, 1)] if quick else [(hz, amplitude) for hz in (8, 12) for amplitude in (0.1, 0.3, 1)]
    return [Tremor(hz, amplitude, TREMOR_SLOT * number, TREMOR_SLOT * (number + 1))
            for number, (hz, amplitude) in enumerate(kinds)]


def change_of(keys):
    """The text of `motion.change` for {coordinate: [(time, value)]}."""
    def text(points):
        return ", ".join(f"[{time:.6g}, {value:.6g}]" for time, value in points)

    return "[" + ", ".join(f'{{path: "body.place.at_mm[{axis}]", keys: [{text(points)}]}}' for axis, points in keys.items()) + "]"


def translation_change(quick=False):
    """Translations through the centre at constant velocity, one after the other. Between them the hand moves to the next start."""
    keys = {axis: [] for axis in range(3)}
    for moved in translations(quick):
        start = moved.begin - STEADY[0]
        own, sign = AXES[moved.axis]
        for offset in (0.1, *STEADY, SLOT):
            for axis, points in keys.items():
                points.append((start + offset, CENTRE[axis] + (sign * moved.speed * (offset - MIDDLE) if axis == own else 0)))
    return change_of(keys)


def tremor_change(quick=False):
    points = []
    for shaken in tremors(quick):
        count = round((shaken.end - shaken.begin) * shaken.hz * KEYS_PER_PERIOD)
        points += [(shaken.begin + i / (shaken.hz * KEYS_PER_PERIOD),
                    CENTRE[0] - shaken.amplitude * math.sin(2 * math.pi * i / KEYS_PER_PERIOD)) for i in range(count)]
    points.append((tremors(quick)[-1].end, 0))
    return change_of({0: points})

