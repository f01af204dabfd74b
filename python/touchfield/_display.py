"""Tables, pictures and pages for notebooks."""

import base64
import html
import os
import sys
import tempfile
import webbrowser

from . import _core
from ._plain import warn


def number(value):
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def table(columns):
    """An HTML table of a dict of columns."""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in columns)
    rows = ("".join(f"<td>{html.escape(number(value))}</td>" for value in row) for row in zip(*columns.values()))
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(f'<tr>{row}</tr>' for row in rows)}</tbody></table>"


def image(png):
    return f'<img style="max-width: 600px" src="data:image/png;base64,{base64.b64encode(png).decode()}">'


class Page:
    """A page of results, which Jupyter shows."""

    def __init__(self, text):
        self._text = text

    def _repr_html_(self):
        return (f'<iframe sandbox="allow-scripts" style="width: 100%; height: 720px; border: 0" '
                f'srcdoc="{html.escape(self._text)}"></iframe>')


def viewed(text):
    """The page of this text; unless Jupyter will show it, a browser opens it."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if not hasattr(shell, "kernel"):
        descriptor, path = tempfile.mkstemp(prefix="touchfield-", suffix=".html")  # stays: the browser may outlive this process
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(text)
        if not webbrowser.open("file://" + path):
            warn(f"view: no browser could be opened; the page is {path}", _core.TouchfieldNote)
    return Page(text)
