"""Time and error of a frame of a moving hand, by faces, steps, scheme and precision: frame_study.csv, gpu_frames.csv.

Each row is `touchfield play` of scenes/moving.yaml without delay, so the error comes from mesh, scheme and few steps alone. All rows have one
evaluation mesh, the whole hand. `pareto`: no other row is both faster and nearer.
"""

import re
import statistics

from runs import table
from work import EVALUATED, ON_TWO_CORES

FINGERS = ["3, 7.5", "2.4, 6", "1.7, 4.2", "1.2, 3"]  # edges near the target and far [mm]: 400 to 2,000 faces
HANDS = ["2, 5.7", "1.6, 4.4", "1.2, 3.15"]  # 3,000 to 10,000 faces
POLISHED = "burton_miller_polished"
SETTLED = 4  # number of first frames that are left out: the descent has no memory of earlier ones yet
NO_DELAY = ["motion.solve_ms=0", "motion.array_ms=0", "motion.sensor.hz=20", "motion.score_hz=20", "motion.predict=none", "solve.methods=[surface]", EVALUATED]
STAGES = ["pose", "set_up", "factorise", "transfer", "phases"]
# (body, edges, scheme, steps, precision), the longest first.
STUDY = [("finger", "1.2, 3", POLISHED, 30, "double"), *(("finger", edges, "chief", steps, "single") for edges in FINGERS[1::-1] for steps in (3, 1)),
         *(("finger", edges, scheme, 5, "single") for edges in FINGERS[::-1] for scheme in (POLISHED, "chief"))]
CARD = [*((body, edges, POLISHED, 5, "single") for body, sizes in (("finger", [*FINGERS, "1.05, 2.65"]), ("hand", HANDS)) for edges in sizes),
        ("hand", HANDS[-1], "paper", 5, "single")]


def changes_of(body, edges, scheme, steps, precision, seconds):
    near, far = edges.split(", ")
    return [*NO_DELAY, f"motion.iterations={steps}", f"solve.scheme={scheme}", f"solve.precision={precision}",
            f"body.edge_mm={{near_target: {near}, far: {far}, within_mm: 12}}", f"motion.seconds={seconds}",
            *(["body.keep_within_mm=null"] if body == "hand" else []), *(["solve.methods=[paper]"] if scheme == "paper" else [])]


def row_of(case, folder):
    body, _, scheme, steps, precision = case
    frames = table(folder / "frames.csv")[SETTLED:]
    errors = [float(row["relative_error"]) for row in table(folder / "motion.csv") if int(row["frame"]) >= SETTLED]

    def spent(frame, stages):
        return 1e3 * sum(float(frame[f"seconds_{stage}"]) for stage in stages if frame.get(f"seconds_{stage}", "nan") != "nan")

    times = sorted(spent(frame, STAGES) for frame in frames)
    faces = re.search(r"body of (\d+) faces", (folder / "play.log").read_text())[1]
    return {"body": body, "faces": faces, "scheme": scheme, "steps": steps, "precision": precision, "ms": f"{statistics.median(times):.3g}",
            "ms_p95": f"{times[int(0.95 * (len(times) - 1))]:.3g}", "slowest_ms": f"{times[-1]:.3g}", "error": f"{statistics.mean(errors):.5f}"} | {
            f"ms_{stage}": f"{statistics.median(spent(frame, [stage]) for frame in frames):.3g}" for stage in STAGES}


def measured(work, cases, seconds, device, **how):
    folders = work.solved({case: ("moving", changes_of(*case, seconds), "--device", device) for case in cases}, "play", **how)
    rows = [row_of(case, folder) for case, folder in folders.items()]
    for row in rows:
        others = [other for other in rows if other["body"] == row["body"]]
        row["above_best"] = f"{float(row['error']) - min(float(other['error']) for other in others):.5f}"
        row["pareto"] = int(not any(float(other["ms"]) < float(row["ms"]) and float(other["error"]) <= float(row["error"]) for other in others))
    return sorted(rows, key=lambda row: (row["body"], float(row["ms"])))


def processor(work):
    return measured(work, STUDY, 0.5, "cpu", **ON_TWO_CORES)


def card(work):
    return measured(work, CARD, 2, "cuda", prefix=())
