"""The page of the package: its code runs, its table names what there is, the stubs know it too."""

import pathlib
import re

import touchfield as tf
from conftest import SOURCE

PAGE = (SOURCE / "docs/python.md").read_text()


def test_code_of_the_page_runs(tmp_path, monkeypatch, capsys):
    (tmp_path / "scenes").symlink_to(SOURCE / "scenes")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) == 3 and len(blocks[0].strip().splitlines()) <= 12
    names = {}
    for number, block in enumerate(blocks):
        exec(compile(block, f"docs/python.md, block {number + 1}", "exec"), names)
    assert (tmp_path / "quick/run.h5").exists() and (tmp_path / "surface.png").read_bytes()[:4] == b"\x89PNG"
    assert "mine" in capsys.readouterr().out
    assert names["problem"].cost(names["solution"].drives) >= names["proof"]["bound"] > 0


def test_lines_of_the_readme_run(tmp_path, monkeypatch):
    (tmp_path / "scenes").symlink_to(SOURCE / "scenes")
    monkeypatch.chdir(tmp_path)
    block, = re.findall(r"```python\n(.*?)```", (SOURCE / "README.md").read_text(), re.DOTALL)
    assert len(block.strip().splitlines()) == 6
    exec(compile(block, "README.md", "exec"), {})
    assert (tmp_path / "quick_500/run.h5").exists() and (tmp_path / "surface.png").read_bytes()[:4] == b"\x89PNG"


def test_page_and_stubs_name_everything():
    stubs = (pathlib.Path(tf.__file__).parent / "_core.pyi").read_text()
    assert (pathlib.Path(tf.__file__).parent / "py.typed").exists()
    for name in tf.__all__:
        assert re.search(rf"(def|class) {name}\b|^{name}: ", stubs, re.MULTILINE), name
        assert name in ("Error", "Picture", "Solution", "Target", "Run") or f"`{name}" in PAGE, name
    for kind in (tf.Run, tf.Model, tf.Mesh, tf.Array, tf.Wave, tf.Problem, tf.Solution):
        for name in vars(kind):
            assert name.startswith("_") or f"`{name}" in PAGE or f"`{kind.__name__}.{name}" in PAGE, f"{kind.__name__}.{name}"
