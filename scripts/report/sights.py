"""What sees the hand in the study of cameras: a case a sensor, all of the same motion, without delay."""

import dataclasses

BASE = "scenes/cameras.yaml"
LOOK_AT = (0, -50, 215)  # [mm]
BESIDE = ((280, -50, 0), (-280, -50, 0), (0, 270, 0), (0, -370, 0))  # the scene's three, and a fourth under the wrist
SWAY_HZ = 1
OTHER_HAND = {"body.hand.length_mm": "178", "body.hand.breadth_mm": "79"}
PLAIN = {"motion.seconds": "1.2", "motion.solve_ms": "0", "motion.array_ms": "0", "motion.frames_hz": "20", "motion.score_hz": "20",
         "motion.iterations": "10", "solve.methods": "[surface]", "write": "[h5]"}
SETTLED = 4  # frames that are left out: the first ones come from zero


@dataclasses.dataclass(frozen=True)
class Case:
    group: str
    value: str
    changes: dict
    other_hand: bool = False

    def name(self):
        return "_".join(part for part in f"{self.group} {self.value}".replace(".", "p").replace("-", " ").split())

    def line(self):
        """As a case of a sweep."""
        changes = PLAIN | self.changes | (OTHER_HAND if self.other_hand else {})
        return f"  - {{name: {self.name()}, " + ", ".join(f"{path}: {value}" for path, value in changes.items()) + "}\n"


def sensor(sight):
    return {"motion.sensor": f"{{hz: 20, {sight}}}" if sight else "{hz: 20}"}


def cameras(count=3, scale=1.0, **keys):
    """So many cameras, as far from the hand as the scene's times `scale`."""
    def camera(at):
        place = [f"{look + scale * (x - look):.4g}" for x, look in zip(at, LOOK_AT)]
        more = "".join(f", {key}: {value}" for key, value in keys.items())
        return f"{{at_mm: [{', '.join(place)}], look_at_mm: {list(LOOK_AT)}{more}}}"

    return sensor(f"seed: 1, cameras: [{', '.join(camera(at) for at in BESIDE[:count])}]")


def speed(most):
    """Sideways, at most so fast [mm/s]."""
    amplitude = most / (2 * 3.141592653589793 * SWAY_HZ)
    return {"motion.change": f"[{{path: 'body.place.at_mm[0]', sine: {{amplitude: {amplitude:.4g}, hz: {SWAY_HZ}}}}}]"}


def cases(quick=False):
    found = [Case("exact", "", sensor("")), Case("exact", "other hand", sensor(""), True)]
    found += [Case("noise", f"{rms}", sensor(f"noise: {{noise_mm_rms: {rms}}}")) for rms in ([0.5] if quick else [0.1, 0.25, 0.5, 1])]
    found += [Case("cameras", f"{count}", cameras(count)) for count in ([3] if quick else [1, 2, 3, 4])]
    if quick:
        return found
    found += [Case("disparity noise", f"{pixels}", cameras(disparity_noise_px=pixels)) for pixels in (0, 0.03, 0.16, 0.32)]
    found += [Case("distance", f"{scale}", cameras(scale=scale)) for scale in (0.75, 1.5, 2)]
    found += [Case("speed", f"{most}", cameras() | speed(most)) for most in (0, 100, 200)]
    found += [Case("place error", f"{error}", cameras(place_error_mm=error)) for error in (0.5, 1, 2)]
    found += [Case("turn error", f"{error}", cameras(turn_error_deg=error)) for error in (0.1, 0.3)]
    found += [Case("model", model, cameras(model=model)) for model in ("d435", "d405")]
    found += [Case("hand", "other", cameras(), True)]
    return found
