"""The page "From AcousTools": its code runs, and both packages find the same."""

import re

import numpy as np
import pytest

import touchfield as tf
from conftest import SOURCE

pytest.importorskip("acoustools")


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    patch = pytest.MonkeyPatch()
    patch.chdir(tmp_path_factory.mktemp("page"))
    patch.setattr("sys.argv", ["page"])  # which AcousTools reads
    tf.sphere(8e-3, 2e-3).save("ball.stl", unit=1.0)
    names = {}
    blocks = re.findall(r"```python\n(.*?)```", (SOURCE / "docs/from-acoustools.md").read_text(), re.DOTALL)
    assert len(blocks) == 10
    for number, block in enumerate(blocks):
        exec(compile(block, f"docs/from-acoustools.md, block {number + 1}", "exec"), names)
    patch.undo()
    return names


def test_focus(names):
    """Within 0.7 %: their series of the piston's directivity ends with the fourth power."""
    assert abs(names["our_focus"][0]) == pytest.approx(float(names["their_focus"].abs()), rel=0.01)


def test_points(names):
    theirs, ours = names["their_points"][0].numpy(), names["our_points"]
    assert np.ptp(ours) < 0.01 * ours.mean() and ours.mean() == pytest.approx(theirs.mean(), rel=0.02)


def test_body(names):
    theirs, ours = names["their_h"][0].numpy(), names["our_h"]
    faces = np.argsort(abs(ours).sum(axis=1))[-20:]  # the side that looks at the board
    assert theirs.shape == ours.shape
    assert np.linalg.norm(abs(theirs[faces]) - abs(ours[faces])) < 0.1 * np.linalg.norm(ours[faces])


def test_own_method(names):
    assert names["tensor"].data_ptr() == names["our_h"].__array_interface__["data"][0]
    assert float(names["our_loudest"]) == pytest.approx(float(names["their_loudest"]), rel=0.1)
