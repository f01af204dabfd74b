"""Names of release 0.3: each is an error that says the new one."""

import csv

import pytest

import touchfield as tf
from conftest import SOURCE

with open(SOURCE / "tests/data/renamed.csv", newline="") as _file:
    ROWS = [tuple(row.values()) for row in csv.DictReader(_file) if row["where"] not in ("scene", "plot")]

PROBLEM = ([[1, 1j], [1j, 1]], [1, 1], [1, 1])


@pytest.fixture(scope="module")
def results(finger, run, tmp_path_factory):
    motion = tf.play(finger, threads=2, set={"solve.methods": ["focus"], "evaluation": "same", "solve.optimality_bound": False, "motion": {
        "seconds": 0.1, "change": [{"path": "body.place.at_mm.0", "rate": 40}], "solve_ms": 20}})
    plan = {"base": str(finger), "set": {"solve.methods": ["focus"], "solve.optimality_bound": False}, "grid": {"solve.outside_weight": [1]}}
    checked = tf.run(finger, set={"solve.methods": ["focus"], "solve.resonance_check": "always", "evaluation": "same"}, threads=2)
    seconds = run.seconds
    seconds.update(checked.seconds)
    return {"metrics": run.metrics["surface"], "seconds": seconds, "check": tf.check(finger),
            "compare": tf.compare(run, run), "send": tf.send(run, method="focus"), "frames": motion.frames["focus"],
            "sweep": tf.sweep(plan, tmp_path_factory.mktemp("sweep") / "out")}


@pytest.mark.parametrize("where, old, new", ROWS)
def test_an_old_name_is_answered_with_the_new(where, old, new, request):
    owner, _, name = old.rpartition(".")
    if where == "attribute":
        things = {"touchfield": lambda: tf, "Run": lambda: request.getfixturevalue("run"), "Problem": lambda: tf.Problem(*PROBLEM)}
        thing = things[owner]()
        with pytest.raises(AttributeError, match=f"^{old} is called {new}$"):
            getattr(thing, name)
        assert hasattr(thing, new)
    elif where == "argument":
        call = {"Problem": lambda **more: tf.Problem(*PROBLEM, **more), "of": lambda **more: tf.Problem.of(None, None, **more)}.get(
            owner, lambda **more: getattr(tf, owner)(tf.Problem(*PROBLEM), **more))
        with pytest.raises(TypeError, match=f"the argument {name} is called {new}$"):
            call(**{name: 1})
    else:
        values = request.getfixturevalue("results")[where]
        with pytest.raises(KeyError, match=f"{old} is called {new}'$"):
            values[old]
        assert new in values
