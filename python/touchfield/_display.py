"""Tables and pictures for notebooks."""

import base64
import html
import io


def number(value):
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def table(columns):
    """An HTML table of a dict of columns."""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in columns)
    rows = ("".join(f"<td>{html.escape(number(value))}</td>" for value in row) for row in zip(*columns.values()))
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(f'<tr>{row}</tr>' for row in rows)}</tbody></table>"


def image(png):
    return f'<img style="max-width: 600px" src="data:image/png;base64,{base64.b64encode(png).decode()}">'


def shown(png, ax):
    """A picture of the program in matplotlib Axes."""
    import matplotlib.pyplot as plt

    ax = plt.figure().add_subplot() if ax is None else ax
    ax.imshow(plt.imread(io.BytesIO(png)))
    ax.set_axis_off()
    return ax


def lines(groups, ax, xlabel, ylabel):
    """A line of each group: name, x, y."""
    import matplotlib.pyplot as plt

    ax = plt.figure().add_subplot() if ax is None else ax
    for name, x, y in groups:
        ax.plot(x, y, marker=".", label=name)
    ax.set(xlabel=xlabel, ylabel=ylabel)
    ax.legend()
    return ax
