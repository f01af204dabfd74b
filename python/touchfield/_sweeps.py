"""Sweeps: a scene with many values."""

import concurrent.futures
import json
import os
import re
import tempfile

import numpy as np

from . import _core, _display
from ._plain import Names, plain
from ._progress import reporting
from ._scenes import source, written


class Sweep(Names):
    """The table of a sweep: a dict of columns, a row of each case and method."""

    def to_frame(self):
        """The table as a `pandas.DataFrame`.

        Examples
        --------
        >>> tf.read_sweep("heights").to_frame().groupby("name").relative_error.min()  # doctest: +SKIP
        """
        import pandas

        return pandas.DataFrame(dict(self))

    def plot(self, x, y="relative_error", ax=None):
        """A column against another, a line of each method.

        Parameters
        ----------
        x : str
            A parameter of the sweep: its key path.
        y : str
            A metric.
        ax : matplotlib.axes.Axes, optional
            Default: new ones.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> ax = tf.read_sweep("heights").plot("body.place.at_mm.2")  # doctest: +SKIP
        """
        from ._figures import lines

        along, up = self._column(x), self._column(y)
        methods = dict.fromkeys(self["name"].tolist())
        order = np.argsort(along, kind="stable")
        rows = {method: order[self["name"][order] == method] for method in methods}
        return lines([(method, along[of], up[of]) for method, of in rows.items()], ax, x, y)

    def figure(self, x, y="relative_error", *, by=None, width="single"):
        """Columns against another, for a paper: a line of each method, in a panel of each column and each value of `by`.

        Parameters
        ----------
        x : str
            A parameter of the sweep: its key path.
        y : str or list of str
            Metrics, one below the other.
        by : str, optional
            Another parameter, whose values stand side by side.
        width : {"single", "double"}
            85 mm or 175 mm.

        Returns
        -------
        matplotlib.figure.Figure

        Examples
        --------
        >>> tf.read_sweep("heights").figure("body.place.at_mm.2").savefig("heights.pdf")  # doctest: +SKIP
        """
        from ._figures import panels

        metrics = [y] if isinstance(y, str) else list(y)
        parts, titles = [self], [""]
        if by is not None:
            column = self._column(by)
            parts = [Sweep((name, values[column == value]) for name, values in self.items()) for value in np.unique(column)]
            titles = [f"{by} = {_display.number(value)}" for value in np.unique(column).tolist()]

        def plot(ax, row, column):
            parts[column].plot(x, metrics[row], ax).set_title(titles[column] if row == 0 else "")

        return panels(len(metrics), len(parts), width, plot)

    def _column(self, name):
        if now := self.new_name(name):
            raise _core.InputError(f"sweep: the column {name} is called {now}")
        if name not in self:
            raise _core.InputError(f"sweep: there is no column '{name}', there are {', '.join(self)}")
        return np.asarray(self[name])

    def _repr_html_(self):
        return _display.table({name: np.asarray(column).tolist() for name, column in self.items()})


class _Files:
    """A sweep as files: the one that is given, or a dict of its keys in a folder that goes at the end."""

    def __init__(self, plan):
        self.plan = plan

    def __enter__(self):
        if not isinstance(self.plan, dict):
            self.folder = None
            return self.plan
        self.folder = tempfile.TemporaryDirectory()
        plan = dict(self.plan)
        base = source(plan.get("base", {}))
        if isinstance(base, str) and base in _core.scenes() and not os.path.isfile(base):
            base = _core.scene(base), ""
        if isinstance(base, tuple):
            plan["base"] = os.path.join(self.folder.name, "base.yaml")
            with open(plan["base"], "w") as file:
                file.write(base[0])
        else:
            if not isinstance(base, (str, os.PathLike)):
                raise TypeError(f"sweep: base must be a str, an os.PathLike or a dict, not {type(base).__name__}")
            plan["base"] = os.path.abspath(os.fspath(base))
        path = os.path.join(self.folder.name, "sweep.yaml")
        with open(path, "w") as file:
            json.dump(written(plan), file, default=plain)
        return path

    def __exit__(self, kind, error, trace):
        if self.folder:
            self.folder.cleanup()
            if isinstance(error, _core.InputError) and self.folder.name in str(error):  # a place in a file that nobody wrote
                places = re.escape(self.folder.name) + r"/\w+\.yaml(:\d+:\d+)?"
                raise _core.InputError(re.sub(places, "sweep", str(error))) from None


def _case(file, out, set, device, case, threads):
    """A case in a worker of an executor; its rows are not needed there."""
    _core._sweep(file, out, set, device, 1, threads, case)


def sweep(file, out, set=None, device=None, jobs=1, threads=None, *, executor=None, progress=None):
    """Computes the cases of a sweep into a folder, as `touchfield sweep`, in separate processes.

    Parameters
    ----------
    file : str, os.PathLike or dict
        A sweep file, or a dict of its keys: `base` (a scene, as of `Model`), `set`, `grid`, `zip`, `cases`, `random`.
    out : str or os.PathLike
        The folder.
    set : dict, optional
        Changes of every case by key path.
    device : {"auto", "cpu", "cuda", "cuda:N"}, optional
    jobs : int
        Cases at a time. Not with an executor.
    threads : int, optional
        Of all jobs together; with an executor of each case.
    executor : concurrent.futures.Executor, optional
        Computes the cases, each as a task of its own, in place of processes of the program. Its workers must see the
        folder, and have the package.
    progress : callable or bool, optional
        A function of stage and fraction, or True for a bar.

    Returns
    -------
    Sweep
        A dict of columns.

    Raises
    ------
    InputError
        That lists the problems of the sweep and its scenes. A case that fails is a row with its reason.

    Examples
    --------
    >>> plan = {"base": "capsule", "set": {"solve.methods": ["focus"]}, "grid": {"body.place.at_mm.2": [60, 70]}}
    >>> tf.sweep(plan, "heights", jobs=1)["case"].tolist()
    [1, 2]
    """
    with _Files(file) as path, reporting(progress) as reports:
        if executor is None:
            return Sweep(_core._sweep(path, out, set, device, jobs, threads))
        cases = _core._sweep_cases(path, set)
        path, out = os.path.abspath(os.fspath(path)), os.path.abspath(os.fspath(out))
        futures = [executor.submit(_case, path, out, set and written(set), device, number, threads) for number in range(1, cases + 1)]
        try:
            for done, future in enumerate(concurrent.futures.as_completed(futures), 1):
                future.result()
                if reports.report:
                    reports.report("sweep", done / cases)
        finally:
            for future in futures:
                future.cancel()
        return read_sweep(out)


def list_sweep(file, set=None):
    """Every case of a sweep and what it is expected to take, as `touchfield sweep --list --json`.

    Parameters
    ----------
    file, set
        As of `sweep`.

    Returns
    -------
    list of dict
        Of each case `case`, `name`, `inputs`, `seconds`, `memory_mib` and what else a line of the program has.

    Examples
    --------
    >>> [case["inputs"] for case in tf.list_sweep({"base": "capsule", "grid": {"array.level": [0.5, 1]}})]
    [{'array.level': '0.5'}, {'array.level': '1'}]
    """
    with _Files(file) as path:
        return _core._list_sweep(path, set)


def read_sweep(folder):
    """The columns of a sweep's table, for the finished cases.

    Parameters
    ----------
    folder : str or os.PathLike

    Returns
    -------
    Sweep

    Examples
    --------
    >>> tf.read_sweep("heights")["relative_error"]  # doctest: +SKIP
    """
    return Sweep(_core._read_sweep(folder))
