"""Figures for papers, and pages."""

import html
import sys
import tempfile
import types
import webbrowser

import numpy as np
import pytest

import touchfield as tf

matplotlib = pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def figure(run):
    return run.figure(["surface", "focus"])


def test_files_are_vectors_with_embedded_fonts(figure, tmp_path):
    figure.savefig(tmp_path / "figure.pdf")
    figure.savefig(tmp_path / "figure.svg")
    pdf, svg = (tmp_path / "figure.pdf").read_bytes(), (tmp_path / "figure.svg").read_text()
    assert b"/FontFile2" in pdf and b"/CIDFontType2" in pdf and b"/Type3" not in pdf
    assert all(f">{text}<" in svg for text in ("wanted", "surface", "focus", "pressure [Pa]"))
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert svg.count("<image") == svg.count("data:image/png") == 4  # the skin in each panel, and what is wanted


@pytest.mark.parametrize("quantity", ["radiation", "pressure"])
def test_colours_are_those_of_the_values(run, tmp_path, quantity):
    shown = run.figure(["focus"], quantity, width="single", whole=False, top=1e3 if quantity == "pressure" else 4)
    shown.savefig(tmp_path / "figure.png", dpi=300)
    image = matplotlib.pyplot.imread(tmp_path / "figure.png")[::-1, :, :3]
    skin, target = run.evaluation_mesh, run.target
    focus = {"radiation": run.radiation["focus"], "pressure": abs(run.evaluation_pressures["focus"]) / 1e3}[quantity]
    most = target.amplitudes.max()
    wanted = most / 1e3 if quantity == "pressure" else run._drawing()["radiation_per_square"] * most**2
    colours = next(ax for ax in shown.axes if ax.get_ylabel().endswith("]"))._colorbar
    seen = np.linalg.norm(skin.centroids - run.mesh.centroids[target.centre], axis=1).argmin()
    for ax, value in zip(shown.axes, (wanted, focus[seen])):
        x, y, _ = skin.centroids[seen] @ np.array([[-1, 0, 0], [0, 1, 0], [0, 0, 1]])  # the array faces along z
        column, row = (ax.transData.transform((x, y)) * 300 / shown.dpi).astype(int)
        assert np.allclose(image[row, column], colours.mappable.to_rgba(value)[:3], atol=0.06)


@pytest.fixture
def opened(monkeypatch, tmp_path):
    """The addresses that a browser was asked for."""
    addresses = []
    monkeypatch.setattr(webbrowser, "open", lambda address: addresses.append(address) or True)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return addresses


@pytest.mark.parametrize("shell", [None, types.SimpleNamespace()])  # Python's own, and IPython in a terminal
def test_a_browser_opens_a_page(run, opened, monkeypatch, shell):
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))
    run.view()
    address, = opened
    with open(address.removeprefix("file://"), encoding="utf-8") as file:
        page = file.read()
    assert page == run._page() and page.startswith("<!DOCTYPE html>") and "surface" in page
    monkeypatch.setattr(webbrowser, "open", lambda address: False)
    with pytest.warns(tf.TouchfieldNote, match="no browser could be opened; the page is .*[.]html"):
        run.view()
