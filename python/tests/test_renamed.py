"""Names of release 0.3: each is an error that says the new one."""

import csv

import pytest

import touchfield as tf
from conftest import SOURCE

with open(SOURCE / "tests/data/renamed.csv", newline="") as _file:
    ROWS = [tuple(row.values()) for row in csv.DictReader(_file) if row["where"] in ("attribute", "argument")]

PROBLEM = ([[1, 1j], [1j, 1]], [1, 1], [1, 1])


@pytest.mark.parametrize("where, old, new", ROWS)
def test_an_old_name_is_answered_with_the_new(where, old, new, request):
    owner, _, name = old.rpartition(".")
    if where == "attribute":
        things = {"touchfield": lambda: tf, "Run": lambda: request.getfixturevalue("run"), "Problem": lambda: tf.Problem(*PROBLEM)}
        thing = things[owner]()
        with pytest.raises(AttributeError, match=f"^{old} is called {new}$"):
            getattr(thing, name)
        assert hasattr(thing, new)
    else:
        call = {"Problem": lambda **more: tf.Problem(*PROBLEM, **more), "of": lambda **more: tf.Problem.of(None, None, **more)}.get(
            owner, lambda **more: getattr(tf, owner)(tf.Problem(*PROBLEM), **more))
        with pytest.raises(TypeError, match=f"the argument {name} is called {new}$"):
            call(**{name: 1})
