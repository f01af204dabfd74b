"""Pages and docstrings: their code runs, every name exists, and the defaults are those of the library."""

import doctest
import importlib
import inspect
import json
import pathlib
import re

import numpy as np
import pytest

import touchfield as tf
from conftest import SOURCE

PAGE = (SOURCE / "docs/python.md").read_text()
CLASSES = [tf.Array, tf.Felt, tf.Mesh, tf.Model, tf.Motion, tf.Pattern, tf.Picture, tf.Problem, tf.RadiationProblem, tf.Run, tf.Solution, tf.Sweep, tf.Target,
           tf.Wave]
FUNCTIONS = [getattr(tf, name) for name in tf.__all__ if inspect.isfunction(getattr(tf, name))]
METHODS = [getattr(kind, name) for kind in CLASSES for name in vars(kind)
           if not name.startswith("_") and inspect.isroutine(getattr(kind, name))]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "scenes").symlink_to(SOURCE / "scenes")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def blocks_of(text, heading):
    return re.findall(r"```python\n(.*?)```", re.split(rf"^## {heading}$", text, flags=re.MULTILINE)[1].split("\n## ")[0], re.DOTALL)


def run_blocks(blocks, names=None):
    names = {} if names is None else names
    for number, block in enumerate(blocks):
        exec(compile(block, f"block {number + 1}", "exec"), names)
    return names


def test_ten_lines_run(folder, capsys):
    block, = blocks_of(PAGE, "Ten lines")
    assert len(block.strip().splitlines()) <= 12
    run_blocks([block])
    assert (folder / "capsule/run.h5").exists() and (folder / "overview.png").read_bytes()[:4] == b"\x89PNG"


def test_own_method_and_separate_parts_run(folder, capsys):
    run_blocks(blocks_of(PAGE, "A phase method of your own"), {"np": np, "tf": tf})
    assert "mine" in capsys.readouterr().out
    names = run_blocks(blocks_of(PAGE, "Separate parts"), {"np": np, "tf": tf})
    assert names["problem"].cost(names["solution"].drives) >= names["proof"]["bound"] > 0


def test_five_tasks_in_ten_lines_each(folder):
    for package in ("pandas", "matplotlib", "trimesh"):
        pytest.importorskip(package)
    blocks = blocks_of(PAGE, "Five tasks")
    assert len(blocks) == 5 and max(len(block.strip().splitlines()) for block in blocks) <= 10
    tf.hand("flat", edge=4e-3).save("hand.stl")  # the scan of the fourth task
    names = run_blocks(blocks, {"np": np, "tf": tf})
    assert (folder / "heights.png").read_bytes()[:4] == b"\x89PNG" and len(set(names["heights"]["body.place.at_mm.2"])) == 3
    assert abs(names["free"][0]) == pytest.approx(abs(names["array"].transfer([[0, 0, 0.15]])).sum(), rel=1e-9)
    assert names["pressure"].shape == (len(names["palm"]),)
    own = np.exp(1j * np.angle(names["q"]))
    assert abs(own.conj() @ names["gs"].drives) == pytest.approx(len(own), rel=1e-6)  # the same but for a common phase
    assert set(names["run"].methods) == {"surface", "focus"}
    run_blocks(blocks_of(PAGE, "Figures and pages"), names)
    assert {path.name for path in folder.glob("*.[ps][dv][fg]")} == {"capsule.pdf", "capsule.svg", "heights.pdf"}
    run_blocks(blocks_of(PAGE, "What the skin does"), names)
    assert np.nanmax(names["soft"]) > 0 and (folder / "felt.pdf").exists()
    report = names["report"]
    assert report["frames"] == 100 and not report["emitted"] and report["files"] > 0


def test_frames_leave_for_other_code(folder):
    own, other = blocks_of(PAGE, "Patterns")
    assert max(len(block.strip().splitlines()) for block in (own, other)) <= 11
    names = run_blocks([own], {"np": np, "tf": tf})
    assert np.array_equal(np.loadtxt("frames.csv", delimiter=","), np.hstack(names["pattern"].frames()))
    audit = pytest.importorskip("pyautd3.link.audit")  # an emulated unit
    names |= {"link": audit.Audit(), "segment": importlib.import_module("pyautd3.native_methods.autd3").Segment.S0}
    run_blocks([other.replace("Nop()", "link") + "    held = link.drives_at(0, segment, 3)\n"], names)
    phases, amplitudes = names["pattern"].frames()
    assert np.array_equal(names["held"], [(255 * amplitudes[3]).astype(int), np.round(256 * phases[3] / (2 * np.pi)).astype(int) % 256])


def test_the_notebook_runs(folder):
    for package in ("pandas", "matplotlib"):
        pytest.importorskip(package)
    cells = json.loads((SOURCE / "docs/tutorials/python.ipynb").read_text())["cells"]
    names = run_blocks(["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"])
    assert names["run"].methods == ["surface", "wgs", "focus"] and names["table"]["status"].tolist() == ["ok"] * 9
    assert not any(cell.get("outputs") for cell in cells)


def test_lines_of_the_readme_run(folder):
    block, = re.findall(r"```python\n(.*?)```", (SOURCE / "README.md").read_text(), re.DOTALL)
    assert len(block.strip().splitlines()) == 6
    run_blocks([block])
    assert (folder / "quick_3000/run.h5").exists() and (folder / "overview.png").read_bytes()[:4] == b"\x89PNG"


def test_page_names_everything():
    assert (pathlib.Path(tf.__file__).parent / "py.typed").exists()
    for name in tf.__all__:
        assert name in ("Error", "Picture", "Sweep") or f"`{name}" in PAGE, name
    for kind in CLASSES:
        for name in vars(kind):
            assert name.startswith("_") or f"`{name}" in PAGE or f"`{kind.__name__}.{name}" in PAGE, f"{kind.__name__}.{name}"


@pytest.mark.parametrize("function", [*FUNCTIONS, *METHODS, *CLASSES], ids=lambda function: function.__qualname__)
def test_signature_and_docstring(function):
    assert function.__doc__.strip()
    if function in (tf.Felt, tf.Run, tf.Motion, tf.Pattern, tf.Picture, tf.Sweep, tf.Solution):  # which are results
        return
    parameters = inspect.signature(function).parameters
    assert "Examples\n" in function.__doc__, "an example"
    described = re.split(r"\n\s+(?:Returns|Raises|Examples)\n", function.__doc__)[0]
    for name in parameters:
        assert name in ("self", "cls") or re.search(rf"\b{name}\b", described), f"the docstring lacks {name}"


def test_examples_run(folder):
    for package in ("pandas", "matplotlib"):
        pytest.importorskip(package)
    runner, finder = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS), doctest.DocTestFinder()
    for name in tf.__all__:
        for test in finder.find(getattr(tf, name), name, module=False, globs={"tf": tf, "np": np}):
            runner.run(test)
    assert runner.tries > 60 and runner.failures == 0
