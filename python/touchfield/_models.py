"""Scenes made concrete, and runs of them."""

import numpy as np

from . import _core, _display
from ._arrays import Array, Wave, drives_of
from ._bodies import Mesh
from ._phases import Problem, Solution
from ._plain import Part, core, file_content, named, read_content
from ._progress import reporting
from ._scenes import changes, source
from ._targets import Target


class Model(Part):
    """The mesh, array and target of a scene, with which a run computes, in the world's frame.

    Parameters
    ----------
    scene : str, os.PathLike or dict
        A file, YAML text, or a dict with the keys of a scene. In a dict a `Mesh` may stand for `body` or `mesh`, an `Array`
        for `array`, a `Target` of a box for `target`.
    set : dict, optional
        Changes of the scene by key path: ``{"solve.iterations": 10}``.
    device : {"auto", "cpu", "cuda", "cuda:N"}, optional

    Raises
    ------
    InputError
        That lists every problem of the scene.

    Examples
    --------
    >>> model = tf.Model("scenes/quick.yaml", set={"target.pressure_pa": 500})
    >>> parts = {"array": model.array, "body": model.mesh, "solve": {"methods": ["focus"]},
    ...          "target": tf.Target.box(model.mesh, "bottom", [8e-3, 20e-3, 6e-3], 500)}
    >>> len(tf.Model(parts).mesh) == len(model.mesh)
    True
    """

    def __init__(self, scene, set=None, device=None):
        self._core = _core.Model(source(scene), changes(set), device)
        self._scene = (scene, set, device) if isinstance(scene, dict) else (self.scene, None, None)

    def __reduce__(self):
        return Model, self._scene

    @property
    def name(self):
        """Of the scene."""
        return self._core.name

    @property
    def scene(self):
        """The scene as YAML with all defaults."""
        return self._core.scene

    @property
    def mesh(self):
        """The skin, a `Mesh` with landmarks."""
        return Mesh._of(self._core.mesh)

    @property
    def array(self):
        """The transducers, an `Array`."""
        return Array._of(self._core.array)

    @property
    def wave(self):
        """The sound, a `Wave`."""
        return Wave._of(self._core.wave)

    @property
    def target(self):
        """The `Target`; None if the scene has none."""
        target = self._core.target
        return target and Target._of(target, self.mesh)

    def score(self, pressure):
        """The metrics of a pressure on the skin.

        Parameters
        ----------
        pressure : array_like of complex, shape (M,)
            On every face of the mesh [Pa], of `scatter` or ``H @ drives``.

        Returns
        -------
        dict of str to float

        Examples
        --------
        >>> model = tf.Model("scenes/quick.yaml")
        >>> model.score(np.ones(len(model.mesh)))["peak_pa"]
        1.0
        """
        return named(self._core.score(pressure))


def evaluate(model, drives, threads=None):
    """The metrics of phases on the evaluation mesh of a scene, as for a method of the program.

    Parameters
    ----------
    model : Model
    drives : array_like, shape (N,), or Solution
        Phases [rad], or complex drives of amplitude 1.
    threads : int, optional

    Returns
    -------
    dict of str to float

    Examples
    --------
    >>> model = tf.Model("scenes/quick.yaml")
    >>> metrics = tf.evaluate(model, tf.focus(tf.transfer(model.mesh, model.array, model.wave), model.target))
    """
    return named(_core.evaluate(core(model, Model, "model"), _phases(drives), threads))


def check(scene, set=None, accuracy=False, threads=None):
    """Describes what a scene builds and costs, as `touchfield check --json`.

    Parameters
    ----------
    scene, set
        As of `Model`.
    accuracy : bool
        Whether the discretisation error is included, which takes longer.
    threads : int, optional

    Returns
    -------
    dict

    Examples
    --------
    >>> tf.check("scenes/quick.yaml")["channels"]
    256
    """
    return named(_core.check(source(scene), changes(set), accuracy, threads))


class Picture(Part):
    """A picture made by the program, as PNG; Jupyter displays it."""

    def save(self, path):
        """Writes it into a file.

        Parameters
        ----------
        path : str or os.PathLike
            That ends in .png.

        Examples
        --------
        >>> tf.run("scenes/quick.yaml", set={"solve.methods": ["focus"]}).picture("setup").save("setup.png")
        """
        self._core.save(path)

    def _repr_png_(self):
        return self._core._repr_png_()

    def __bytes__(self):
        return bytes(self._core)

    def __reduce__(self):
        raise TypeError("a picture cannot be pickled; bytes(picture) are those of its PNG file")


class Run(Part):
    """The results of a scene. Arrays are read-only views of them."""

    def __reduce__(self):
        return _run_of_bytes, (file_content(self._core, "run.h5"),)

    @property
    def name(self):
        """Of the scene."""
        return self._core.name

    @property
    def scene(self):
        """The scene as YAML with all defaults."""
        return self._core.scene

    @property
    def mesh(self):
        """The skin, a `Mesh`."""
        return Mesh._of(self._core.mesh)

    @property
    def array(self):
        """The transducers, an `Array`."""
        return Array._of(self._core.array)

    @property
    def target(self):
        """The `Target`; None if the scene has none."""
        target = self._core.target
        return target and Target._of(target, self.mesh)

    @property
    def methods(self):
        """Names of the methods."""
        return self._core.methods

    @property
    def metrics(self):
        """By method and name; NaN where not computed."""
        return named(self._core.metrics)

    @property
    def status(self):
        """By method: converged, iteration_limit, stalled or direct."""
        return self._core.status

    @property
    def pressures(self):
        """By method, on every face of `mesh` [Pa], complex."""
        return self._core.pressures

    @property
    def phases(self):
        """By method, of every channel [rad]."""
        return self._core.phases

    @property
    def amplitudes(self):
        """By method, of every channel, 0 to 1."""
        return self._core.amplitudes

    @property
    def drives(self):
        """By method, amplitude exp(i phase) of every channel."""
        return {name: self.amplitudes[name] * np.exp(1j * phases) for name, phases in self.phases.items()}

    @property
    def evaluation(self):
        """The evaluation mesh: none, same, truth, edge or split."""
        return self._core.evaluation

    @property
    def solved_skin(self):
        """Extent of the skin in `mesh` and `pressures`: 'whole', or 'part' (within keep_within_mm)."""
        return self._core.solved_skin

    @property
    def evaluation_mesh(self):
        """The evaluation mesh, if it is one of its own."""
        mesh = self._core.evaluation_mesh
        return mesh and Mesh._of(mesh)

    @property
    def evaluation_pressures(self):
        """By method, on the evaluation mesh [Pa]; empty if `pressures` are evaluated."""
        return self._core.evaluation_pressures

    @property
    def problems(self):
        """By scheme a `Problem`, if the scene's `write` has transfer."""
        return {scheme: Problem._of(problem) for scheme, problem in self._core.problems.items()}

    @property
    def fields(self):
        """By name of the grid and method [Pa], axes z, y, x; `points`: the positions, with a last axis x, y, z [m]."""
        return self._core.fields

    @property
    def levels(self):
        """Of every point among the fields and method a dict: point, method, amplitude_pa (peak), level_db (re 20 uPa, rms)."""
        return self._core.levels

    @property
    def exposure_limits(self):
        """Published for the frequency, if there are points, as dicts: source, for, limit_db. No assessment of safety."""
        return self._core.exposure_limits

    @property
    def seconds(self):
        """By stage [s]."""
        return named(self._core.seconds)

    @property
    def warnings(self):
        """Anything that makes a result unreliable."""
        return self._core.warnings

    @property
    def notes(self):
        """Information about results that are reliable."""
        return self._core.notes

    @property
    def provenance(self):
        """Program, machine, threads and time."""
        return self._core.provenance

    def field(self, points, threads=None, wave=None):
        """The pressure off the skin.

        Parameters
        ----------
        points : array_like, shape (J, 3)
            [m]
        threads : int, optional
        wave : Wave, optional
            Another than that of the run, whose pressures on the skin stay.

        Returns
        -------
        dict of str to numpy.ndarray of complex, shape (J,)
            By method [Pa]: 0 inside the body, NaN on a transducer.

        Examples
        --------
        >>> run = tf.run("scenes/quick.yaml", set={"solve.methods": ["focus"]})
        >>> run.field([[0, 0, 0.05]])["focus"].shape
        (1,)
        """
        return self._core.field(points, threads, wave and core(wave, Wave, "wave"))

    def save(self, path, force=False):
        """Writes one file if the name ends in .h5, otherwise a folder with the files that the scene's `write` lists.

        Parameters
        ----------
        path : str or os.PathLike
        force : bool
            Whether an older run is replaced.

        Examples
        --------
        >>> tf.run("scenes/quick.yaml", set={"solve.methods": ["focus"]}).save("quick.h5", force=True)
        """
        self._core.save(path, force)

    def picture(self, picture=None):
        """A picture of the program.

        Parameters
        ----------
        picture : str, optional
            setup, target, pressure_METHOD or field_GRID_METHOD; default: the pressure of the first method.

        Returns
        -------
        Picture

        Examples
        --------
        >>> png = bytes(tf.run("scenes/quick.yaml", set={"solve.methods": ["focus"]}).picture("setup"))
        """
        return Picture._of(self._core.plot(picture))

    def plot(self, picture=None, ax=None):
        """A picture of the program in matplotlib Axes.

        Parameters
        ----------
        picture : str, optional
            As of `picture`.
        ax : matplotlib.axes.Axes, optional
            Default: new ones.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> ax = tf.run("scenes/quick.yaml", set={"solve.methods": ["focus"]}).plot("pressure_focus")
        """
        return _display.shown(bytes(self.picture(picture)), ax)

    def to_frame(self):
        """The metrics as a `pandas.DataFrame`, a row of each method.

        Examples
        --------
        >>> frame = tf.run("scenes/quick.yaml", set={"solve.methods": ["focus"]}).to_frame()
        >>> frame.index.tolist()
        ['focus']
        """
        import pandas

        return pandas.DataFrame(self.metrics).T

    def _repr_png_(self):
        return self._core._repr_png_()

    def _repr_html_(self):
        columns = ("relative_error", "leakage", "mean_inside_pa", "peak_pa", "force_target_n")
        rows = {"method": self.methods} | {name: [self.metrics[each][name] for each in self.methods] for name in columns}
        return _display.table(rows) + _display.image(self._repr_png_())


def _run_of_bytes(content):
    return Run._of(read_content(content, "run.h5", _core.read_run))


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
        Methods of your own by name: phases [rad], complex drives of amplitude 1, a `Solution`, or a function that makes one
        of these of the `Problem` of the scene. They are evaluated beside the methods of the scene.
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
    >>> run = tf.run("scenes/quick.yaml", set={"solve.methods": ["focus"]}, own={"mine": tf.wgs})
    >>> run.methods
    ['focus', 'mine']
    """
    with reporting(progress):
        if isinstance(own, dict):
            if not isinstance(scene, Model) and any(callable(method) for method in own.values()):
                scene, set, device = Model(scene, set, device), None, None
            own = {name: _phases(_found(method, scene, threads)) for name, method in own.items()}
        given = scene._core if isinstance(scene, Model) else source(scene)
        return Run._of(_core.run(given, changes(set), device, threads, own))


def _found(method, model, threads):
    return method(Problem.of_model(model, threads)) if callable(method) else method


def _phases(found):
    """Phases of a solution at full drive, to the last bit; anything else as it is."""
    return found.phases if isinstance(found, Solution) and (found.amplitudes == 1).all() else drives_of(found)


def read_run(path):
    """Reads a run.h5, or the folder that contains it.

    Parameters
    ----------
    path : str or os.PathLike

    Returns
    -------
    Run

    Raises
    ------
    InputError
        If the file is missing, damaged or no run.

    Examples
    --------
    >>> tf.run("scenes/quick.yaml", set={"solve.methods": ["focus"]}).save("quick.h5", force=True)
    >>> run = tf.read_run("quick.h5")
    """
    return Run._of(_core.read_run(path))


def compare(a, b):
    """How two runs differ, as `touchfield compare`.

    Parameters
    ----------
    a, b : Run, str or os.PathLike
        Runs, or files of them.

    Returns
    -------
    dict
        That of `touchfield compare --json`: `verdict` (identical, same_to_rounding, different), `largest`,
        `largest_result`, `provenance` of both, `scene` (changes by key path), `methods` (a list) and more; and `text` for
        a person.

    Examples
    --------
    >>> run = tf.run("scenes/quick.yaml", set={"solve.methods": ["focus"]})
    >>> tf.compare(run, run)["verdict"]
    'identical'
    """
    a, b = (each if isinstance(each, Run) else read_run(each) for each in (a, b))
    return named(_core.compare(a._core, b._core))


def study(scene, set=None, *, edges=(), schemes=(), solvers=(), precisions=(), rung_seconds=300.0, threads=None, progress=None):
    """Solves a scene in several ways and compares error and time, as `touchfield study`.

    Parameters
    ----------
    scene, set
        As of `Model`.
    edges : sequence of float
        Edge lengths [m]; default: 1.4, 1 and 0.7 times the scene's.
    schemes, solvers, precisions : sequence of str
        Default: all.
    rung_seconds : float
        Ways that are expected to take longer are skipped [s].
    threads : int, optional
    progress : callable or bool, optional

    Returns
    -------
    list of dict
        A row of each way, for `pandas.DataFrame`.

    Examples
    --------
    >>> ways = tf.study("scenes/quick.yaml", edges=[4e-3], schemes=["burton_miller"], solvers=["lu"], precisions=["double"])
    >>> ways[0]["status"]
    'ok'
    """
    with reporting(progress):
        return _core.study(source(scene), changes(set), edges=list(edges), schemes=list(schemes), solvers=list(solvers),
                           precisions=list(precisions), rung_seconds=rung_seconds, threads=threads)
