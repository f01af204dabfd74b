"""Sensors in the study of cameras: one case per sensor, without delay."""

import dataclasses
import json
import subprocess

import numpy

BASE = "scenes/cameras.yaml"
LOOK_AT = (0, -50, 215)  # [mm]
BESIDE = ((-280, -50, 0), (280, -50, 0), (0, 270, 0), (0, -370, 0))  # the three of the scene, and a fourth under the wrist
TEMPLATES = "template's"
OTHER = "other size"
BUMPY = "bumpy"
PLAIN = {"motion.seconds": "0.8", "motion.solve_ms": "0", "motion.array_ms": "0", "motion.predict": "none", "motion.frames_hz": "20",
         "motion.score_hz": "20", "motion.iterations": "10", "solve.methods": "[surface]", "write": "[h5]"}
SETTLED = 4  # first frames that do not count


@dataclasses.dataclass(frozen=True)
class Case:
    group: str
    value: str
    changes: dict
    hand: str = TEMPLATES

    def name(self):
        return "_".join(part for part in f"{self.group} {self.value}".replace(".", "p").replace("-", " ").split())

    def same(self):
        """Everything but the sensor, for comparison with another case."""
        return self.hand, tuple(sorted((path, value) for path, value in self.changes.items() if path != "motion.sensor"))

    def line(self, bumpy, evaluation):
        """The case as a line of a sweep. `bumpy` has the changes that make the hand of the scene bumpy."""
        hands = {TEMPLATES: {}, OTHER: {"body.hand": "{pose: index_up, length_mm: 178, breadth_mm: 79}"}, BUMPY: bumpy}
        changes = PLAIN | {"evaluation": evaluation} | self.changes | hands[self.hand]
        return f"  - {{name: {self.name()}, " + ", ".join(f"{path}: {value}" for path, value in changes.items()) + "}\n"


def bumpy_hand(program, folder):
    """Writes the mesh of a hand of 186 x 84 mm with smooth bumps of 0.8 mm rms; returns the changes of a scene that uses it."""
    smooth, bumpy = folder / "smooth.off", folder / "bumpy.off"
    made = subprocess.run([program, "hand", "--pose", "index_up", "--length-mm", "186", "--breadth-mm", "84", "--edge-mm", "2.5", "-o",
                           smooth, "--force", "--json"], check=True, capture_output=True, text=True).stdout
    head, count = smooth.read_text().split("\n")[:2], int(smooth.read_text().split()[1])
    vertices = numpy.loadtxt(smooth, skiprows=2, max_rows=count)
    triangles = numpy.loadtxt(smooth, int, skiprows=2 + count)[:, 1:]
    a, b, c = vertices[triangles.T]
    normals = numpy.zeros_like(vertices)
    for k in range(3):
        numpy.add.at(normals, triangles[:, k], numpy.cross(b - a, c - a))
    normals /= numpy.linalg.norm(normals, axis=1, keepdims=True)
    random = numpy.random.default_rng(3)
    height = numpy.zeros(count)
    for _ in range(60):
        away = ((vertices - vertices[random.integers(count)]) ** 2).sum(axis=1)
        height += random.normal() * numpy.exp(-away / (2 * 15.0 ** 2))  # [mm]
    vertices += normals * (0.8 * height / numpy.sqrt((height ** 2).mean()))[:, None]
    with bumpy.open("w") as file:
        file.write("\n".join([*head, ""]))
        numpy.savetxt(file, vertices, "%.6f")
        numpy.savetxt(file, triangles, "3 %d %d %d")
    pad = json.loads(made)["landmarks"]["index_pad"]
    return {"body.hand": "null", "body.mesh": f"{{file: {bumpy}, unit: mm, landmarks: {{index_pad: {pad}}}}}",
            "motion.change": "[{path: 'body.place.at_mm[0]', sine: {amplitude: -8, hz: 1}}]"}


def sensor(sight, hz=20):
    return {"motion.sensor": f"{{hz: {hz}, {sight}}}" if sight else f"{{hz: {hz}}}"}


def cameras(count=3, scale=1.0, hz=20, seed=1, **keys):
    """The sensor with `count` cameras. Their distances from the hand are those of the scene times `scale`."""
    def camera(at):
        place = [f"{look + scale * (x - look):.4g}" for x, look in zip(at, LOOK_AT)]
        more = "".join(f", {key}: {value}" for key, value in keys.items())
        return f"{{at_mm: [{', '.join(place)}], look_at_mm: {list(LOOK_AT)}{more}}}"

    return sensor(f"seed: {seed}, cameras: [{', '.join(camera(at) for at in BESIDE[:count])}]", hz)


def of_a_mesh():
    """The cameras of the scene for a body that is not a built-in hand; the sensor then names the hand that is fitted."""
    return {"motion.sensor": cameras()["motion.sensor"][:-1] + ", hand: {pose: index_up}}"}


def cases(quick=False):
    found = [Case("exact", "", sensor("")), Case("exact", OTHER, sensor(""), OTHER), Case("exact", BUMPY, sensor(""), BUMPY)]
    found += [Case("noise", f"{rms}", sensor(f"noise: {{noise_mm_rms: {rms}}}")) for rms in ([0.5] if quick else [0.25, 0.5, 1])]
    found += [Case("cameras", f"{count}", cameras(count)) for count in ([3] if quick else [1, 2, 3, 4])]
    if quick:
        return found
    found += [Case("disparity noise", f"{pixels}", cameras(disparity_noise_px=pixels)) for pixels in (0, 0.16, 0.32)]
    found += [Case("distance", f"{scale}", cameras(scale=scale)) for scale in (0.75, 1.5, 2)]
    found += [Case("place error", f"{error}", cameras(place_error_mm=error)) for error in (1, 2)]
    found += [Case("turn error", f"{error}", cameras(turn_error_deg=error)) for error in (0.3,)]
    found += [Case("model", model, cameras(model=model)) for model in ("d435", "d405")]
    found += [Case("hand", OTHER, cameras(), OTHER), Case("hand", BUMPY, of_a_mesh(), BUMPY)]
    return found
