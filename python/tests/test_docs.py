"""Pages and docstrings: their code runs, every name exists, and the defaults are those of the library."""

import doctest
import importlib
import inspect
import json
import pathlib
import re
import subprocess
import sys

import numpy as np
import pytest

import touchfield as tf
from conftest import SOURCE

PAGE = (SOURCE / "docs/python.md").read_text()
CLASSES = [tf.Array, tf.Felt, tf.Mesh, tf.Model, tf.Motion, tf.Pattern, tf.Picture, tf.Problem, tf.RadiationProblem, tf.Run, tf.Scattering, tf.Solution, tf.Sweep, tf.Target,
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


def test_separate_parts_run(folder):
    names = run_blocks(blocks_of(PAGE, "Separate parts"), {"np": np, "tf": tf})
    assert names["problem"].cost(names["solution"].drives) >= names["proof"]["bound"] > 0
    run_blocks(blocks_of(PAGE, "Gradients")[1:], names)


def test_seven_tasks_in_ten_lines_each(folder, capsys):
    for package in ("pandas", "matplotlib", "scipy", "trimesh"):
        pytest.importorskip(package)
    blocks = blocks_of(PAGE, "Seven tasks")
    assert len(blocks) == 7 and max(len(block.strip().splitlines()) for block in blocks) <= 10
    scanned = tf.hand("flat", edge={"far": 8e-3, "near": {"palm_centre": 3e-3}})
    scanned.save("hand.stl")
    scanned.to_trimesh().export("hand.glb")
    names = run_blocks(blocks, {"np": np, "tf": tf})
    assert np.abs(names["free"]).max() == pytest.approx(np.abs(names["array"].transfer([[0, 0, 0.15]])).sum(), rel=0.1)
    assert names["pressure"].shape == (len(names["palm"]),) and np.abs(names["below"]).min() > 0
    assert set(names["run"].methods) == {"surface", "focus"} and len(set(names["levels"])) == 3
    assert len(set(names["heights"]["body.place.at_mm.2"])) == 3
    assert names["hz"][names["rms"].argmax()] == 200
    assert names["found"].fun < 1.1 * names["problem"].cost(tf.surface(names["problem"])) and "mine" in capsys.readouterr().out
    assert names["hand"].landmarks["palm"] == pytest.approx([0, 0, 0.15])
    assert {path.name for path in folder.glob("*.png")} == {"focus.png", "palm.png", "heights.png"} and (folder / "glb_hand/run.h5").exists()
    run_blocks(blocks_of(PAGE, "Figures and pages"), names)
    assert {path.name for path in folder.glob("*.[ps][dv][fg]")} == {"capsule.pdf", "capsule.svg", "heights.pdf"}
    run_blocks(blocks_of(PAGE, "What the skin does"), names)
    assert np.nanmax(names["soft"]) > 0 and (folder / "felt.pdf").exists()


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
    (folder / "quick").mkdir()  # no file that hides the scene
    run_blocks([block])
    assert (folder / "quick_3000/run.h5").exists() and (folder / "overview.png").read_bytes()[:4] == b"\x89PNG"


def test_reference_has_everything(tmp_path):
    assert (pathlib.Path(tf.__file__).parent / "py.typed").exists()
    subprocess.run([sys.executable, "-I", SOURCE / "docs/site/python_page.py", tmp_path], check=True)
    text = "".join(page.read_text() for page in (tmp_path / "python").iterdir())
    for name in tf.__all__:
        assert re.search(rf"^(## |\| `){name}\b", text + (tmp_path / "python.md").read_text(), re.MULTILINE), name
    for kind in CLASSES:
        for name in vars(kind):
            assert name.startswith("_") or re.search(rf"^(### {kind.__name__}\.|\| `){name}\b", text, re.MULTILINE), (kind, name)
    assert not re.search(r"^(--+|>>> .*|\.\. .*)$", text, re.MULTILINE)  # nothing that is left as numpydoc


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
