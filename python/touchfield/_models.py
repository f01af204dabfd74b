"""Runs of scenes, and what notebooks show of runs and motions."""

import json

import numpy as np

from . import _core, _display
from ._exports import extends
from ._plain import file_content, listed, millimetres, number, own_arguments, place, plain, read_content
from ._progress import reporting


@extends
class Model(_core.Model):
    def __reduce__(self):
        return Model, getattr(self, "_given", (self.scene,))


def felt(self, *, layers=None, bone=None, shear=None, tan_delta=None, modulation_hz=None, frames_per_second=None, highest_hz=None, at=None,
         points=None, reference=None):
    """What the skin does under the radiation pressure, as `touchfield felt`: of a still, its sound modulated; of a pattern, its frames.

    Parameters
    ----------
    layers, bone, shear, tan_delta, modulation_hz, frames_per_second, highest_hz, at, points, reference
        As the keys of `felt` in a scene, with `bone`, `at` and `points` in m and `shear` in Pa. Default: those of the scene.

    Returns
    -------
    Felt

    Raises
    ------
    InputError
        On a value out of range, or if the pressure is not known.

    Examples
    --------
    >>> run = tf.run("capsule", set={"solve.methods": ["focus"]})
    >>> run.felt(modulation_hz=100)["focus", "soft"].displacement.shape
    (49, 49)
    """
    keys = {name: value for name, value in locals().items() if name != "self" and value is not None}
    for name in keys.keys() - {"layers", "at", "points", "reference"}:
        keys[name] = number(keys[name], f"felt: {name}")
    if "at" in keys:
        keys["at_mm"] = place(keys.pop("at"), "felt: at")
    if "points" in keys:
        keys["points_mm"] = [place(point, f"felt: points[{n}]") for n, point in enumerate(listed(keys.pop("points"), "felt: points"))]
    if "bone" in keys:
        keys["bone_mm"] = millimetres(keys.pop("bone"), "bone")
    if "shear" in keys:
        keys["shear_kpa"] = keys.pop("shear") / 1e3
    return _felt_of(self, [f"felt.{key}={json.dumps(value, default=plain)}" for key, value in keys.items()])


def one_method(results, method, function):
    """The name of a method; of none that of the only one."""
    names = results.methods
    if method is None and len(names) == 1:
        return names[0]
    if method not in names:
        said = "method must be given," if method is None else f"method = '{method}' must be"
        raise _core.InputError(f"{function}: {said} one of {', '.join(names)}")
    return method


def frames(self, method=None):
    """Phases and amplitudes in the order of the device: by `array.device`, then by `array.channel`.

    A transducer at amplitude a and phase phi moves as a cos(omega t - phi), the real part of a exp(i phi) exp(-i omega t): a larger
    phase is later. Phase 0 is that of the carrier, which all transducers share. `send` rounds to the step round(L phi / 2 pi) mod L
    of a device with L phase levels. Amplitude 1 is the level at which the scene or `Array` drives the transducers.

    Parameters
    ----------
    method : str, optional
        Default: the only one.

    Returns
    -------
    phases, amplitudes : numpy.ndarray, shape (F, N)
        Of F frames, one of a run [rad], and 0 to 1.

    Examples
    --------
    >>> run = tf.run("capsule", set={"solve.methods": ["focus"]})
    >>> phases, amplitudes = run.frames()
    >>> phases.shape
    (1, 256)
    """
    name = one_method(self, method, "frames")
    order = np.lexsort((self.array.channel, self.array.device))
    return np.atleast_2d(self.phases[name])[:, order], np.atleast_2d(self.amplitudes[name])[:, order]


def _felt_of(result, changes):
    with own_arguments("felt"):
        made = _core._felt(result, changes)
    made._made_of = result, changes
    return made


@extends
class Felt(_core.Felt):
    def __reduce__(self):
        return _felt_of, self._made_of


@extends
class Run(_core.Run):
    felt = felt
    frames = frames

    def __reduce__(self):
        return _run_of_bytes, (file_content(self, "run.h5"),)

    def figure(self, methods=None, quantity=None, *, width="double", whole=True, top=None, cmap="YlGnBu"):
        """What is wanted on the skin and what the methods reach, by matplotlib, for a paper.

        The skin is seen from the array's side. Its colours are smoothed, and darker where it is slanted. Lines and texts stay
        vectors in a PDF or SVG.

        Parameters
        ----------
        methods : list of str, optional
            Default: all.
        quantity : {"radiation", "pressure"}, optional
            The radiation pressure P or the amplitude of the sound pressure. Default: P, which skin feels, if it is known.
        width : {"single", "double"}
            85 mm or 175 mm.
        whole : bool
            Whether the whole body is shown above the surroundings of the target.
        top : float, optional
            The end of the colours [Pa]. Default: a value between what is wanted and twice that. Suction has the colour of 0.
        cmap : str
            A colour map. The default survives a print in grey.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            On an unknown method, or a quantity that the run does not have.

        Examples
        --------
        >>> run = tf.run("capsule", set={"solve.methods": ["focus"]})
        >>> run.figure(width="single").savefig("capsule.pdf")
        """
        from ._figures import of_run

        return of_run(self, methods, quantity, width, whole, top, cmap)

    def view(self):
        """The skin and the results on it in 3D to turn, as `touchfield view`: Jupyter shows the page, elsewhere a browser opens it.

        Examples
        --------
        >>> run.view()  # doctest: +SKIP
        """
        return _display.viewed(self._page())

    def to_frame(self):
        """The metrics as a `pandas.DataFrame`, a row of each method.

        Examples
        --------
        >>> frame = tf.run("capsule", set={"solve.methods": ["focus"]}).to_frame()
        >>> frame.index.tolist()
        ['focus']
        """
        import pandas

        return pandas.DataFrame(self.metrics).T

    def _repr_html_(self):
        columns = ("relative_error", "leakage", "mean_inside_pa", "peak_pa", "force_target_n")
        rows = {"method": self.methods} | {name: [self.metrics[each][name] for each in self.methods] for name in columns}
        return _display.table(rows) + _display.image(self._repr_png_())


def _run_of_bytes(content):
    return read_content(content, "run.h5", _core.read_run)


@extends
class Motion(_core.Motion):
    felt = felt

    def __reduce__(self):
        return _motion_of_bytes, (file_content(self, "motion.h5"),)

    def view(self):
        """The moving skin in 3D with a slider of time, as `touchfield view`: Jupyter shows the page, elsewhere a browser opens it.

        Examples
        --------
        >>> motion.view()  # doctest: +SKIP
        """
        return _display.viewed(self._page())

    def to_frame(self, of="scores"):
        """A `pandas.DataFrame` of all methods.

        Parameters
        ----------
        of : {"scores", "frames"}

        Examples
        --------
        >>> motion.to_frame().groupby("method").relative_error.median()  # doctest: +SKIP
        """
        import pandas

        tables = _core.Motion.frames.__get__(self) if of == "frames" else self.scores
        return pandas.concat([pandas.DataFrame(table).assign(method=method) for method, table in tables.items()], ignore_index=True)

    def plot(self, metric="relative_error", ax=None):
        """A metric over time, a line of each method.

        Parameters
        ----------
        metric : str
            A column of `scores`.
        ax : matplotlib.axes.Axes, optional
            Default: new ones.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> ax = motion.plot("mean_inside_pa")  # doctest: +SKIP
        """
        from ._figures import lines

        return lines([(method, table["time_s"], table[metric]) for method, table in self.scores.items()], ax, "time_s", metric)

    def figure(self, metrics=("relative_error", "displacement_m", "mean_inside_pa"), *, width="single"):
        """Metrics over time one below the other, for a paper.

        Parameters
        ----------
        metrics : list of str
            Columns of `scores`.
        width : {"single", "double"}
            85 mm or 175 mm.

        Returns
        -------
        matplotlib.figure.Figure

        Examples
        --------
        >>> motion.figure().savefig("motion.pdf")  # doctest: +SKIP
        """
        from ._figures import panels

        return panels(len(metrics), 1, width, lambda ax, row, _: self.plot(metrics[row], ax))

    def _repr_html_(self):
        columns = ("relative_error_median", "relative_error_p95", "mean_inside_pa_median", "frames", "late", "dropped")
        return _display.table({"method": self.methods} |
                              {name: [self.summary[method][name] for method in self.methods] for name in columns})


def _motion_of_bytes(content):
    return read_content(content, "motion.h5", _core.read_motion)


@extends
class Pattern(_core.Pattern):
    frames = frames


def _place(at, argument):
    return at if isinstance(at, str) else place(at, argument)


def _above_zero(value, argument, most):
    if not 0 < number(value, argument) <= most:
        raise _core.InputError(f"{argument} = {value:g} must be > 0 and <= {most:g}")
    return value


def circle(at, radius, hz):
    """The keys of `pattern` in a scene for a spot that moves round a circle.

    Parameters
    ----------
    at : str or array_like, shape (3,)
        Centre: a landmark, or a point [m].
    radius, hz : float
        [m], and periods per second.

    Examples
    --------
    >>> tf.circle("index_pad", 3e-3, 100)
    {'circle': {'at': 'index_pad', 'radius_mm': 3.0, 'hz': 100}}
    """
    radius = millimetres(_above_zero(radius, "circle: radius", 0.2), "radius")
    return {"circle": {"at": _place(at, "circle: at"), "radius_mm": radius, "hz": _above_zero(hz, "circle: hz", 1e5)}}


def line(from_, to, hz):
    """The same for a spot that moves to and fro at constant speed.

    Parameters
    ----------
    from_, to : str or array_like, shape (3,)
        Both ends: landmarks, or points [m].
    hz : float
        Periods per second.

    Examples
    --------
    >>> tf.line([-4e-3, 0, 0.2], [4e-3, 0, 0.2], 50)
    {'line': {'from': [-4.0, 0.0, 200.0], 'to': [4.0, 0.0, 200.0], 'hz': 50}}
    """
    ends = {"from": _place(from_, "line: from_"), "to": _place(to, "line: to")}
    return {"line": ends | {"hz": _above_zero(hz, "line: hz", 1e5)}}


def run(scene, set=None, device=None, threads=None, own=None, progress=None):
    """Computes a scene, as `touchfield run`. Writes nothing.

    Parameters
    ----------
    scene : str, os.PathLike, dict or Model
        As of `Model`.
    set : dict, optional
        Changes of the scene by key path; not with a `Model`.
    device : {"auto", "cpu", "cuda", "cuda:N"}, optional
    threads : int, optional
        Default: OMP_NUM_THREADS, or all.
    own : dict, optional
        Methods of your own by name: phases [rad], complex drives of amplitudes 0 to 1, a `Solution`, or a function that makes
        one of these of the `Problem` of the scene. They are evaluated beside the methods of the scene.
    progress : callable or bool, optional
        A function of stage and fraction, or True for a bar.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        That lists every problem of the scene.
    NumericalError
        If a result is not reliable.

    Examples
    --------
    >>> run = tf.run("capsule", set={"solve.methods": ["focus"]}, own={"mine": tf.wgs})
    >>> run.methods
    ['focus', 'mine']
    """
    with reporting(progress):
        if isinstance(own, dict):
            if not isinstance(scene, Model) and any(callable(method) for method in own.values()):
                scene, set, device = Model(scene, set, device), None, None
            own = {name: method(_core.Problem.of_model(scene, threads)) if callable(method) else method for name, method in own.items()}
        return _core._run(scene, set, device, threads, own)
